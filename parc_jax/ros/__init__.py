"""A node of ROS 2 that never stops being safe: measurements in, proved manoeuvres out. Only `node`
imports ROS (the extra `ros`); `pilot` takes messages that any library decoded.
"""

from parc_jax.ros.driving import Driving
from parc_jax.ros.pilot import Pilot

__all__ = [
    "Driving",
    "Pilot",
]
