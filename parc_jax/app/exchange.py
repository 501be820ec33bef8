"""Files of other tools: scenes, networks, bags, C for a robot's computer. Loaded on first use."""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
