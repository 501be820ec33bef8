"""Every figure by its name, for papers and notebooks: `from parc_jax import figures`, then
`figures.samples(answer)`. `parc_jax.app.plot` describes each. Loaded on first use.
"""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
