"""Shapes: learnt from training data, never from the holdout."""

import jax
import numpy as np
import pytest
from profiles import training_profile
from synthetic_plants import disturbed, failing, noisy, plant, straight_network

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.bound import profile
from parc_jax.learning.bound.edges import choose_edges, edges_of
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.profile import largest_errors
from parc_jax.learning.runs.collect import collect

KEY, NET = jax.random.PRNGKey(0), straight_network(4)


def test_one_bin_is_the_training_maximum_plus_the_floor():
    train = collect(plant(noisy), KEY, 300, quiet=True)
    profile, errors = training_profile(NET, train, (1, 1), floor=1e-3), measure(NET, train)
    np.testing.assert_allclose(profile.interval[0], errors.interval.max(axis=0) + 1e-3)
    np.testing.assert_allclose(profile.final[0], errors.final.max(axis=0) + 1e-3)


def test_bins_hold_their_own_maximum_and_borrow_from_neighbours():
    train = collect(plant(noisy), KEY, 400, quiet=True)
    profile, errors = training_profile(NET, train, (4, 4), floor=1e-3), measure(NET, train)
    number = profile.bin_of(train.k)
    own = np.zeros_like(profile.interval)
    np.maximum.at(own, number, errors.interval)
    assert (profile.interval >= own + 1e-3 - 1e-15).all() and (
        profile.interval <= own.max(axis=0) + 1e-3
    ).all()
    grid = own.reshape(4, 4, 4, 2)
    assert (profile.interval.reshape(4, 4, 4, 2)[1, 2] >= 0.5 * grid[:3, 1:].max(axis=(0, 1))).all()


def test_failed_runs_do_not_shape():
    profile = training_profile(NET, collect(plant(failing), KEY, 200, quiet=True), (1, 1))
    assert np.isfinite(profile.interval).all()


def test_errors_of_some_runs_are_held_at_a_time(monkeypatch):
    train = collect(plant(noisy), KEY, 200, quiet=True)
    edges, sizes = edges_of(train.domain, (3, 2)), []
    whole = largest_errors(NET, train, edges)

    def seen(net, batch):
        sizes.append(batch.n)
        return measure(net, batch)

    monkeypatch.setattr(profile, "measure", seen)
    monkeypatch.setattr(profile, "AT_ONCE", 64)
    some = largest_errors(NET, train, edges)
    assert max(sizes) == 64 and sum(sizes) == train.n
    jax.tree.map(np.testing.assert_array_equal, whole[1:], some[1:])


def chosen(run, n=2000):
    train = collect(plant(run), KEY, n, quiet=True)
    return choose_edges(train.k, measure(NET, train), train.domain)


def test_k_is_cut_where_that_helps_and_nowhere_else():
    varied = chosen(noisy)
    assert len(varied[0]) >= 4 and len(varied[1]) == 2  # the error grows along the first axis only
    assert (
        sum(len(edge) - 2 for edge in chosen(disturbed)) <= 1
    )  # the same everywhere: at most one cut, by chance


def test_edges_end_exactly_at_the_domain():
    edges = edges_of(box([0.1, -1.0], [0.7, np.pi]), (3, 7))
    assert (
        edges[0][0] == 0.1 and edges[0][-1] == 0.7 and edges[1][-1] == np.pi and len(edges[1]) == 8
    )
    with pytest.raises(InputError, match="2 numbers >= 1"):
        edges_of(box([0, 0], [1, 1]), (3,))
    given = edges_of(box([0, 0], [1, 1]), ([0, 0.2, 1], 2))
    assert given[0].tolist() == [0, 0.2, 1] and given[1].tolist() == [0, 0.5, 1]
    with pytest.raises(InputError, match="axis 0 from"):
        edges_of(box([0, 0], [1, 1]), ([0, 0.2, 0.9], 2))
