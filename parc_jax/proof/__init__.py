"""Proofs: certificates, absence of plans, regions of a network.

Names are loaded on first use.
"""

from parc_jax.common.on_use import on_use

__getattr__, __dir__, __all__ = on_use(__name__)
