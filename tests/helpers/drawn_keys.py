"""Keys of runs drawn in NumPy: nothing is compiled, so a test file may make them as it is read."""

import numpy as np


def drawn_keys(seed: int, n: int) -> np.ndarray:
    """Keys (n, 2), uint32, as `jax.random.split` gives them, but other ones."""
    return np.random.default_rng(seed).integers(2**32, size=(n, 2), dtype=np.uint32)
