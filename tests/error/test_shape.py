"""Shapes: learnt from training data, never from the holdout."""

import jax
import numpy as np
import pytest
from synthetic_plants import disturbed, failing, noisy, plant, straight_network

from parc_jax.error.measure import measure
from parc_jax.error.shape import choose_bins, default_candidates, training_shape, uniform_edges
from parc_jax.errors import InputError
from parc_jax.rollout.collect import collect
from parc_jax.sets.box import box

KEY, NET = jax.random.PRNGKey(0), straight_network(4)


def test_one_bin_is_the_training_maximum_plus_the_floor():
    train = collect(plant(noisy), KEY, 300, quiet=True)
    shape, errors = training_shape(NET, train, (1, 1), floor=1e-3), measure(NET, train)
    np.testing.assert_allclose(shape.interval[0], errors.interval.max(axis=0) + 1e-3)
    np.testing.assert_allclose(shape.final[0], errors.final.max(axis=0) + 1e-3)


def test_bins_hold_their_own_maximum_and_borrow_from_neighbours():
    train = collect(plant(noisy), KEY, 400, quiet=True)
    shape, errors = training_shape(NET, train, (4, 4), floor=1e-3), measure(NET, train)
    number = shape.bin_of(train.k)
    own = np.zeros_like(shape.interval)
    np.maximum.at(own, number, errors.interval)
    assert (shape.interval >= own + 1e-3 - 1e-15).all() and (shape.interval <= own.max(axis=0) + 1e-3).all()
    grid = own.reshape(4, 4, 4, 2)
    assert (shape.interval.reshape(4, 4, 4, 2)[1, 2] >= 0.5 * grid[:3, 1:].max(axis=(0, 1))).all()


def test_empty_bins_get_a_width_too():
    train = collect(plant(noisy), KEY, 200, quiet=True)
    left = train.select(train.k[:, 0] < 0.1)
    shape = training_shape(NET, left, (8, 1))
    np.testing.assert_allclose(shape.interval[7], measure(NET, left).interval.max(axis=0) + 1e-3)
    assert (shape.interval[1] >= shape.interval[0] * 0.5).all()


def test_failed_runs_do_not_shape():
    shape = training_shape(NET, collect(plant(failing), KEY, 200, quiet=True), (1, 1))
    assert np.isfinite(shape.interval).all()


def test_bins_are_chosen_where_they_help_and_not_elsewhere():
    varied = choose_bins(NET, collect(plant(noisy), KEY, 1000, quiet=True))
    assert varied[0] >= 4 and varied[1] <= 2  # the error grows along the first axis only
    assert choose_bins(NET, collect(plant(disturbed), KEY, 1000, quiet=True)) == (1, 1)


def test_candidates_keep_twenty_runs_in_a_bin():
    assert default_candidates(2, 100) == [(1, 1), (1, 2), (1, 4), (2, 1), (2, 2), (4, 1)]
    assert default_candidates(3, 5) == [(1, 1, 1)]


def test_edges_end_exactly_at_the_domain():
    edges = uniform_edges(box([0.1, -1.0], [0.7, np.pi]), (3, 7))
    assert edges[0][0] == 0.1 and edges[0][-1] == 0.7 and edges[1][-1] == np.pi and len(edges[1]) == 8
    with pytest.raises(InputError, match="2 numbers >= 1"):
        uniform_edges(box([0, 0], [1, 1]), (3,))
