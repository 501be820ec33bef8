"""Looking for bad runs: finds what is there, only ever widens."""

import jax
import numpy as np
import pytest
from synthetic_plants import failing, noisy, plant, spike, straight, straight_network

from parc_jax.error.calibrate import calibrate
from parc_jax.error.measure import measure
from parc_jax.error.score import score_system
from parc_jax.error.search import enlarge, search_worst
from parc_jax.error.shape import training_shape
from parc_jax.rollout.collect import collect

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
pytestmark = pytest.mark.soundness


def peak(key, k, s):
    """A smooth error peak of 1 m, width 0.05, at k = (0.3, 0.7)."""
    p, q = straight(k, s)
    distance = ((k - jax.numpy.array([0.3, 0.7], k.dtype)) ** 2).sum()
    return p + jax.numpy.exp(-distance / 0.05**2) * s[:, None], q


@pytest.mark.parametrize("gradients", [False, True])
def test_a_peak_is_climbed(gradients):
    system = plant(peak)
    shape = training_shape(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    attack = search_worst(NET, system, KEY, shape, 400, gradients=gradients)
    random = score_system(NET, system, KEY, shape, 400, quiet=True).score.max()
    assert attack.score.max() * shape.interval[0, -1, 0] > 0.99 and attack.score.max() > random
    assert np.abs(attack.k[attack.best] - [0.3, 0.7]).max() < 0.01


def test_the_tube_is_widened_only_where_something_was_found():
    system = plant(spike(width=0.02, height=3.0))
    train = collect(system, KEY, 100, quiet=True)
    train = train.select(np.abs(train.p[:, -1] - train.k).max(axis=1) < 0.1)  # the spike was not met in training
    shape = training_shape(NET, train, (4, 1))
    holdout = score_system(NET, system, KEY, shape, 60, quiet=True)
    keep = holdout.score < 100
    claim = calibrate(NET, collect(system, KEY, 60, 2, quiet=True).select(keep), shape, 0.2)
    attack = search_worst(NET, system, KEY, shape, 1000)
    wider = enlarge(claim, shape, attack)
    assert attack.score.max() > 100  # found
    grown = (wider.tube.interval > claim.tube.interval * (1 + 1e-9)).any(axis=(1, 2))
    assert grown.tolist() == [False, False, True, False]
    hit = measure(NET, collect(system, KEY, 1, k=attack.k[attack.best], quiet=True))
    assert (hit.interval[0] <= wider.tube.interval[2]).all()
    assert (wider.eps, wider.delta, wider.n) == (claim.eps, claim.delta, claim.n)
    assert wider.evidence["search"]["bins_widened"] == 1


def test_failed_runs_are_counted_and_do_not_make_the_tube_infinite():
    system = plant(failing)
    shape = training_shape(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    ok = collect(system, KEY, 120, 2, quiet=True)
    claim = calibrate(NET, ok.select(~ok.failed), shape, 0.1)
    wider = enlarge(claim, shape, search_worst(NET, system, KEY, shape, 64))
    assert wider.evidence["search"]["failed"] > 0 and wider.tube.claimed.all()


def test_the_search_repeats_itself():
    system = plant(noisy)
    shape = training_shape(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    first, second = (search_worst(NET, system, KEY, shape, 64) for _ in range(2))
    np.testing.assert_array_equal(first.score, second.score)
    other = search_worst(NET, system, jax.random.PRNGKey(1), shape, 64)
    assert not np.array_equal(first.score, other.score)
