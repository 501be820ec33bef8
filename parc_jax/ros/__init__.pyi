"""What the room offers: the one list, for type checkers and for the module beside it."""

from parc_jax.ros.driving import Driving as Driving
from parc_jax.ros.pilot import Pilot as Pilot
