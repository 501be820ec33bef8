"""Episodes: one proved manoeuvre after another, each with its stop in hand. [T37, T38]

Names are loaded on first use: worker processes of episodes start without an engine.
"""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
