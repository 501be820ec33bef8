"""Files of other tools, in and out: scenes and networks, bags, C for the computer of a robot.
Loaded on first use.
"""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
