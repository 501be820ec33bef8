"""Bins and widths."""

import numpy as np
import pytest

from parc_jax.error.score import bins_of
from parc_jax.error.shape import runs_per_bin
from parc_jax.error.tube import tube
from parc_jax.errors import InputError

EDGES = [[0.0, 1.0, 3.0], [0.0, 0.5, 1.0, 2.0]]


def widths(n_bins=6):
    return np.full((n_bins, 4, 2), 0.1), np.full((n_bins, 3), 0.2)


def test_bins_are_row_major_closed_boxes(rng):
    t = tube(EDGES, *widths())
    k = rng.uniform([0, 0], [3, 2], (200, 2))
    for row, number in zip(k, t.bin_of(k), strict=True):
        lo, hi = t.bin_box(number)
        assert (lo <= row).all() and (row <= hi).all()
    assert (t.bin_of(np.array([[0.5, 1.5], [3.0, 2.0], [3.1, 0.0]])) == [2, 5, -1]).all()


def test_a_parameter_on_a_shared_edge_belongs_to_every_bin_it_touches():
    t = tube(EDGES, *widths())
    numbers = bins_of(t, np.array([[1.0, 0.5], [1.0, 2.0], [0.2, 0.2], [0.0, 0.0]]))
    assert [set(row) for row in numbers.tolist()] == [{0, 1, 3, 4}, {2, 5}, {0}, {0}]
    assert runs_per_bin(numbers, 6).tolist() == [3, 1, 1, 1, 1, 1]
    with pytest.raises(InputError, match="falls in no bin"):
        bins_of(t, np.array([[1.0, np.nan]]))


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
