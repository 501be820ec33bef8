"""Widths by bin, and what a tube says of itself."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.tube import tube

EDGES = [[0.0, 1.0, 3.0], [0.0, 0.5, 1.0, 2.0]]


def widths(n_bins=6):
    return np.full((n_bins, 4, 2), 0.1), np.full((n_bins, 3), 0.2)


def test_one_infinite_width_takes_the_claim_from_its_bin():
    interval, final = widths()
    interval[2, 1, 0], final[4, 0] = np.inf, np.inf
    t = tube(EDGES, interval, final)
    assert t.claimed.tolist() == [True, True, False, True, False, True]
    assert np.isinf(t.interval[2]).all()


def test_bad_widths_are_refused():
    interval, final = widths()
    with pytest.raises(InputError, match="negative"):
        tube(EDGES, -interval, final)
    with pytest.raises(InputError, match="NaN"):
        tube(EDGES, interval * np.nan, final)
    with pytest.raises(InputError, match="expected shape"):
        tube(EDGES, interval[:5], final)


def test_on_a_shared_edge_a_proof_allows_for_the_widest_bin(rng):
    interval = rng.uniform(0.1, 1.0, (6, 4, 2))
    final = rng.uniform(0.1, 1.0, (6, 3))
    t = tube(EDGES, interval, final)
    k = np.array([[0.2, 0.2], [1.0, 0.5], [3.0, 2.0]])
    most = t.widest_at(k)
    for number, (widths, ends) in enumerate([t.widest([0]), t.widest([0, 1, 3, 4]), t.widest([5])]):
        np.testing.assert_array_equal(most[0][number], widths)
        np.testing.assert_array_equal(most[1][number], ends)


def test_host_and_kernel_are_told_the_same(rng):
    t = tube(EDGES, rng.uniform(0.1, 1.0, (6, 4, 2)), rng.uniform(0.1, 1.0, (6, 3)))
    A = rng.normal(size=(5, 3))
    with x64():
        during, end = jax.jit(lambda b: (t.during(b, 2), t.at_end(b)))(jnp.asarray(4))
        lost = jax.jit(lambda t, b: t.support_at_end(A, b))(t, jnp.asarray(4))
    np.testing.assert_array_equal(during.half, t.during(4).half[2])
    np.testing.assert_array_equal(end.half, t.at_end(4).half)
    corners = np.array(list(itertools.product([-1, 1], repeat=3))) * t.final[4]
    np.testing.assert_allclose(lost, (A @ corners.T).max(axis=1), rtol=1e-15)
    assert (t.n_steps, t.n_p, t.n_q, t.n_k, t.grid) == (4, 2, 1, 2, (2, 3))
