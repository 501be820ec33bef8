"""Where K is cut: the same as by one candidate after another, each judged by itself."""

import numpy as np
import pytest

from parc_jax.common.sets.box import box
from parc_jax.learning.bound import edges
from parc_jax.learning.bound.edges import choose_edges, smoothed
from parc_jax.learning.bound.measure import Errors
from parc_jax.learning.bound.profile import bin_maxima

FLOOR = 1e-3
SIDES = np.array([1.0, 2.0, 3.0])


def runs(rng, dims, n=1200):
    """k (n, dims) and errors that jump along the first axis and grow along the last."""
    k = rng.uniform(0, SIDES[:dims], (n, dims))
    size = 0.1 + (k[:, 0] > 0.6) * (k[:, 0] < 0.8) + 0.5 * (k[:, -1] > 0.5 * SIDES[dims - 1])
    error = np.abs(rng.standard_normal((n, 5, 2))) * size[:, None, None]
    return k, Errors(error, np.abs(rng.standard_normal((n, 3))) * size[:, None])


def log_size(k, errors, cut):
    """Of the tube on these edges: a quarter of the runs in turn gives the scale, the rest the
    profile; by the functions that make profiles.
    """
    share = 1.0
    for edge in cut:
        share = np.multiply.outer(share, np.diff(edge) / (edge[-1] - edge[0]))
    found = []
    for first in range(4):
        held = np.arange(len(k)) % 4 == first
        parts = []
        for some in (~held, held):
            empty, largest, counts = bin_maxima(k[some], Errors(*(e[some] for e in errors)), cut)
            flat = [part.reshape(empty.n_bins, -1) for part in largest]
            parts.append((np.concatenate(flat, axis=1).reshape(*empty.grid, -1), counts))
        (fit, count), (most, _) = parts
        profile = smoothed(fit, count.reshape(share.shape)) + FLOOR
        width = np.log(profile[..., : errors.interval[0].size]).mean(axis=-1)
        found.append(np.log((most / profile).max()) + (width * share).sum())
    return np.mean(found)


def one_by_one(k, errors, places, most):
    """The edges by trying every cut of every axis."""
    cut = [edge[[0, -1]] for edge in places]
    while True:
        size, best, gain = log_size(k, errors, cut), None, 0.0
        bins = np.prod([len(edge) - 1 for edge in cut])
        for axis, edge in enumerate(places):
            more = bins // (len(cut[axis]) - 1)
            for place in np.setdiff1d(edge, cut[axis]) if bins + more <= most else ():
                finer = [*cut[:axis], np.union1d(cut[axis], place), *cut[axis + 1 :]]
                won = size - log_size(k, errors, finer)
                if won > 0.03 and won / more > gain:
                    best, gain = finer, won / more
        if best is None:
            return cut
        cut = best


@pytest.mark.parametrize("dims, cells", [(1, 12), (2, 64), (3, 64)])
@pytest.mark.parametrize("at_once", [1, 2**18])
def test_cuts_are_those_found_one_by_one(rng, monkeypatch, dims, cells, at_once):
    monkeypatch.setattr(edges, "_CELLS", cells)
    monkeypatch.setattr(edges, "_AT_ONCE", at_once)
    k, errors = runs(rng, dims)
    domain = box(np.zeros(dims), SIDES[:dims])
    found = choose_edges(k, errors, domain, FLOOR)
    places = [np.linspace(0, side, round(cells ** (1 / dims)) + 1) for side in SIDES[:dims]]
    expected = one_by_one(k, errors, places, len(k) // 20)
    assert [len(edge) for edge in found] == [len(edge) for edge in expected]
    for edge, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(edge, other)
    assert sum(len(edge) for edge in found) > 2 * dims


def test_sets_of_bins_are_smoothed_apart(rng):
    maxima, counts = rng.uniform(0, 1, (3, 4, 5, 2)), rng.integers(0, 400, (3, 4, 5))
    maxima[1, :3] = counts[1, :3] = 0  # bins with nothing near take the most of their own set
    together = smoothed(maxima, counts, sets=1)
    for one in range(3):
        np.testing.assert_array_equal(together[one], smoothed(maxima[one], counts[one]))
    assert (together[1, 0] == maxima[1].max(axis=(0, 1))).all()
