"""A node of ROS 2 that never stops being safe: measurements in, proved manoeuvres out. Only `node`
imports ROS (the extra `ros`); `pilot` takes messages that any library decoded.
"""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
