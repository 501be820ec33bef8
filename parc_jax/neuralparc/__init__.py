"""The published method (PARC, NeuralPARC), a baseline package: the method `Published` of a query,
and the sets and checked linear programs that it is written in: docs/sets.md. Nothing of the engine
comes in. Loaded on first use.
"""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
