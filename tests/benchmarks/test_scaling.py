"""Scaling curves: the robots that they are measured on, and what is made of the numbers."""

import numpy as np
import pytest

from benchmarks.arcs import bending_arcs, between_blocks
from parc_jax.learning.network.predict import trajectories


@pytest.mark.parametrize(("n_k", "bins"), [(2, ()), (8, (4, 4))])
def test_arcs_of_any_number_of_parameters_go_where_the_first_two_say(n_k, bins, rng):
    model = bending_arcs(n_k, (16, 16), n_steps=10, bins=bins)
    assert (model.n_k, model.tube.n_bins) == (n_k, int(np.prod(bins)))
    k = rng.uniform(-1, 1, (50, n_k))
    path, q = trajectories(model.net, model.layout, k)
    np.testing.assert_allclose(path[:, -1], np.array([6.0, 0.0]) + 2 * k[:, :2], atol=1e-9)
    np.testing.assert_allclose(q[:, 0], 0.3 * k[:, 1], atol=1e-9)
    middle = path[:, 5] - path[:, -1] / 2  # bent on the way, by all parameters
    assert 0.05 < np.abs(middle).max() < 5


def test_obstacles_are_added_beside_the_way():
    assert [len(between_blocks(more=n).obstacles) for n in (0, 3)] == [2, 5]
