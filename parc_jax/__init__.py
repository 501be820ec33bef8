"""parc_jax: whole sets of provably safe manoeuvres for robots that can be run but not written down.

Names are loaded on first use, so the checker (`python -m parc_jax.checker`) starts without JAX.
Progress goes to the logger "parc_jax", which is quiet by default.
"""

import logging

from parc_jax.common.on_use import on_use

logging.getLogger(__name__).addHandler(logging.NullHandler())

__version__ = "0.1.0"
__getattr__, __dir__, __all__ = on_use(__name__)
