"""Separation in one interval, as `distance.separations` has it for many."""

from parc_jax.learning.bound.error_set import at
from parc_jax.safe_set.separation import distance


def separation(a, b, errors, vertices, radius):
    """Gap and direction of points a, b (i, n_p) with errors (i,)."""
    gap, w = distance.separations(a[None], b[None], at(errors, None), vertices, radius)
    return gap[0], w[0]
