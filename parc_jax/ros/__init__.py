"""A node of ROS 2 that never stops being safe: what is measured goes in, proved manoeuvres come
out. Only `node` knows ROS (the extra `ros`); `pilot` is told messages of whoever decoded them.
"""

from parc_jax.ros.driving import Driving
from parc_jax.ros.pilot import Pilot

__all__ = [
    "Driving",
    "Pilot",
]
