"""The inequality that separates is what exact numbers say of it, for any loop over it."""

from fractions import Fraction

import jax
import numpy as np
import pytest

from parc_jax.common.arrays import x64
from parc_jax.safe_set.separation.inequality import at_both_knots, excess, height, separates


@pytest.mark.parametrize("n_p", [2, 3])
@pytest.mark.parametrize("jitted", [False, True])
def test_excess_is_what_exact_numbers_say(jitted, n_p):
    rng = np.random.default_rng(n_p)
    w = rng.integers(-8, 9, (5, n_p)) / 8  # products and sums of these are exact
    path = rng.integers(-64, 65, (7, n_p)) / 16
    threshold = rng.integers(-64, 65, (5, 6)) / 16

    def of_all(w, p, threshold):
        return excess(at_both_knots(height(w.T[:, :, None], p.T[:, None]), 1), threshold)

    with x64():
        found = np.asarray((jax.jit(of_all) if jitted else of_all)(w, path, threshold))
    for d, t in np.ndindex(5, 6):
        along = [
            sum(Fraction(a) * Fraction(x) for a, x in zip(w[d], p, strict=True))
            for p in path[t : t + 2]
        ]
        assert Fraction(found[d, t]) == min(along) - Fraction(threshold[d, t])


@pytest.mark.parametrize("jitted", [False, True])
def test_separates_where_the_excess_is_positive_and_never_by_nan(jitted):
    numbers = [-np.inf, -1.0, 0.0, 1e-300, 1.0, np.inf, np.nan]
    a, b, threshold = np.meshgrid(numbers, numbers, numbers)
    with x64():
        told = (jax.jit(separates) if jitted else separates)([a, b], threshold)
    wanted = (np.minimum(a, b) > threshold) & ~np.isnan([a, b, threshold]).any(axis=0)
    np.testing.assert_array_equal(np.asarray(told), wanted)
