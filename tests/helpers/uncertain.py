"""Draws from boxes of doubt."""

import numpy as np

NEARLY = 1 - 1e-12  # so that the rounding of a moved scene leaves it within the uncertainty


def corners_and_inside(rng, n: int) -> np.ndarray:
    """(n,) shares of half widths: every axis at an end or between, alike often."""
    inside = rng.uniform(-1, 1, n)
    return np.where(rng.random(n) < 0.5, np.sign(inside), inside) * NEARLY
