"""Which bins hold a k, on the host and in kernels."""

import jax
import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.bins import Binned, open_bin_of
from parc_jax.learning.bound.profile import runs_per_bin

EDGES = (np.array([0.0, 1.0, 3.0]), np.array([0.0, 0.5, 1.0, 2.0]))
BINNED = Binned(EDGES)


def test_bins_are_row_major_closed_boxes(rng):
    k = rng.uniform([0, 0], [3, 2], (200, 2))
    for row, number in zip(k, BINNED.bin_of(k), strict=True):
        lo, hi = BINNED.bin_box(number)
        assert (lo <= row).all() and (row <= hi).all()
    assert (BINNED.bin_of(np.array([[0.5, 1.5], [3.0, 2.0], [3.1, 0.0]])) == [2, 5, -1]).all()


def test_a_parameter_on_a_shared_edge_belongs_to_every_bin_it_touches():
    numbers = BINNED.bins_of(np.array([[1.0, 0.5], [1.0, 2.0], [0.2, 0.2], [0.0, 0.0]]))
    assert [set(row) for row in numbers.tolist()] == [{0, 1, 3, 4}, {2, 5}, {0}, {0}]
    assert runs_per_bin(numbers, 6).tolist() == [3, 1, 1, 1, 1, 1]
    with pytest.raises(InputError, match="falls in no bin"):
        BINNED.bins_of(np.array([[1.0, np.nan]]))


def test_a_kernel_knows_the_bin_inside_and_none_on_a_border_between_bins(rng):
    asked = jax.jit(jax.vmap(lambda k: open_bin_of(EDGES, k)))
    k = rng.uniform([-0.5, -0.5], [3.5, 2.5], (200, 2))
    np.testing.assert_array_equal(asked(k), BINNED.bin_of(k))
    on_borders = np.array([[1.0, 0.2], [0.3, 0.5], [1.0, 1.0]])
    assert (np.asarray(asked(on_borders)) == -1).all()
    around_all = np.array([[0.0, 0.2], [3.0, 2.0], [0.3, 0.0]])  # the outer border of K
    np.testing.assert_array_equal(asked(around_all), BINNED.bin_of(around_all))
