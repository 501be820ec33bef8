"""Classes of arguments and results, for annotations and `isinstance`: the docstring of each names
the function that makes it. Loaded on first use.
"""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
