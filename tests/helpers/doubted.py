"""Draws from boxes of doubt, and plain questions as the checker's boxes of doubt are about them."""

import numpy as np

from parc_jax.body import hull
from parc_jax.certificate.write import question_parts

NEARLY = 1 - 1e-12  # so that the rounding of a moved scene leaves it within the doubt


def corners_and_inside(rng, n: int) -> np.ndarray:
    """(n,) shares of half widths: every axis at an end or between, alike often."""
    inside = rng.uniform(-1, 1, n)
    return np.where(rng.random(n) < 0.5, np.sign(inside), inside) * NEARLY


def as_format_2(problem, model):
    """Problem, network and tube of a question about one point, spelled in format 2."""
    return question_parts(problem.replace(body=hull(0, radius=problem.body.radius)), model)
