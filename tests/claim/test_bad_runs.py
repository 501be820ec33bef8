"""Looking for bad runs: finds what is there, only ever widens."""

import io
import sys

import jax
import numpy as np
import pytest
from profiles import training_profile
from scored import score_system
from synthetic_plants import failing, noisy, plant, spike, straight, straight_network

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.bound import bad_runs
from parc_jax.learning.bound.asked import BoundSettings
from parc_jax.learning.bound.bad_runs import enlarge, search_size, search_worst
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.simulate import simulator

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
# kernels of its own: of the gate
pytestmark = [pytest.mark.soundness, pytest.mark.slow]


def peak(key, k, s):
    """A smooth error peak of 1 m, width 0.05, at k = (0.3, 0.7)."""
    p, q = straight(k, s)
    distance = ((k - jax.numpy.array([0.3, 0.7], k.dtype)) ** 2).sum()
    return p + jax.numpy.exp(-distance / 0.05**2) * s[:, None], q


@pytest.mark.slow
def test_a_peak_is_climbed():
    system = plant(peak)
    profile = training_profile(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    attack = search_worst(NET, system, KEY, profile, 400, quiet=True)
    random = score_system(NET, system, KEY, profile, 400, quiet=True).score.max()
    assert attack.score.max() * profile.interval[0, -1, 0] > 0.99 and attack.score.max() > random
    assert np.abs(attack.k[attack.best] - [0.3, 0.7]).max() < 0.01


def test_the_tube_is_widened_only_where_something_was_found():
    system = plant(spike(width=0.02, height=3.0))
    train = collect(system, KEY, 100, quiet=True)
    train = train.select(
        np.abs(train.p[:, -1] - train.k).max(axis=1) < 0.1
    )  # the spike was not met in training
    profile = training_profile(NET, train, (4, 1))
    holdout = score_system(NET, system, KEY, profile, 60, quiet=True)
    keep = holdout.score < 100
    claim = calibrate(NET, collect(system, KEY, 60, 2, quiet=True).select(keep), profile, eps=0.2)
    attack = search_worst(NET, system, KEY, profile, 1000, quiet=True)
    wider = enlarge(claim, profile, attack)
    assert attack.score.max() > 100  # found
    grown = (wider.tube.interval > claim.tube.interval * (1 + 1e-9)).any(axis=(1, 2))
    assert grown.tolist() == [False, False, True, False]
    hit = measure(NET, collect(system, KEY, 1, k=attack.k[attack.best], quiet=True))
    assert (hit.interval[0] <= wider.tube.interval[2]).all()
    assert (wider.eps, wider.delta, wider.n) == (claim.eps, claim.delta, claim.n)
    assert wider.evidence["search"]["bins_widened"] == 1


def test_failed_runs_are_counted_and_do_not_make_the_tube_infinite():
    system = plant(failing)
    profile = training_profile(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    ok = collect(system, KEY, 120, 2, quiet=True)
    claim = calibrate(NET, ok.select(~ok.failed), profile, eps=0.1)
    wider = enlarge(claim, profile, search_worst(NET, system, KEY, profile, 64, quiet=True))
    assert wider.evidence["search"]["failed"] > 0 and wider.tube.claimed.all()


def test_the_search_repeats_itself():
    system = plant(noisy)
    profile = training_profile(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    first, second = (search_worst(NET, system, KEY, profile, 64, quiet=True) for _ in range(2))
    np.testing.assert_array_equal(first.score, second.score)
    other = search_worst(NET, system, jax.random.PRNGKey(1), profile, 64, quiet=True)
    assert not np.array_equal(first.score, other.score)


def test_the_search_runs_the_program_of_all_other_runs():
    system = plant(noisy)
    profile = training_profile(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    found = search_worst(NET, system, KEY, profile, 50, quiet=True)
    assert simulator(system)._many._cache_size() == 1
    first_round = score_system(NET, system, KEY, profile, 6, Stage.SEARCH, chunk=32, quiet=True)
    assert len(found.score) == 48 and np.isin(first_round.score, found.score).all()


@pytest.mark.slow
def test_the_search_is_never_larger_than_what_was_asked(monkeypatch):
    assert search_size(None, 59) == 59 and search_size(None, 10**6) == 2048
    assert search_size(5000, 59) == 5000 and search_size(0, 59) == 0
    with pytest.raises(InputError, match="search"):
        BoundSettings(search=-1)
    sizes, real = [], bad_runs.search_worst
    monkeypatch.setattr(
        "parc_jax.learning.bound.runs.search_worst",
        lambda *a, **b: (sizes.append(a[4]), real(*a, **b))[1],
    )
    claim = bound_error(NET, plant(noisy), KEY, eps=0.1, delta=0.05, bins=(1, 1), quiet=True)
    assert sizes == [claim.n] == [29] and claim.evidence["search"]["runs"] <= 29
    few = search_worst(NET, plant(noisy), KEY, claim.tube, 3, quiet=True)
    assert len(few.score) == 3


def test_a_stopped_search_continues_with_the_same_numbers(tmp_path, monkeypatch):
    system = plant(noisy)
    profile = training_profile(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    whole = search_worst(NET, system, KEY, profile, 64, quiet=True)
    real, calls = bad_runs._Search.run, []

    def stopping(self, k, keys, bar=None):
        calls.append(len(k))
        if len(calls) == 5:
            raise KeyboardInterrupt
        return real(self, k, keys, bar)

    monkeypatch.setattr(bad_runs._Search, "run", stopping)
    with pytest.raises(KeyboardInterrupt):
        search_worst(NET, system, KEY, profile, 64, path=tmp_path, quiet=True)
    calls[:] = range(100)
    again = search_worst(NET, system, KEY, profile, 64, path=tmp_path, quiet=True)
    assert len(calls) == 105  # four rounds were kept, one of them is run again to compare
    for field in ("k", "keys", "score"):
        np.testing.assert_array_equal(getattr(again, field), getattr(whole, field))
    with pytest.raises(InputError, match="the same seed"):
        search_worst(NET, system, jax.random.PRNGKey(5), profile, 64, path=tmp_path, quiet=True)


def test_the_search_shows_that_it_runs(monkeypatch):
    system, said = plant(noisy), io.StringIO()
    profile = training_profile(NET, collect(system, KEY, 50, quiet=True), (1, 1))
    monkeypatch.setattr(sys, "stderr", said)
    search_worst(NET, system, KEY, profile, 64)
    assert "plant: search for bad runs" in said.getvalue() and "64/64" in said.getvalue()
    said.truncate(0)
    search_worst(NET, system, KEY, profile, 64, quiet=True)
    assert "search" not in said.getvalue()
