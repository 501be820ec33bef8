"""A profile made even: bins grow by what they lacked for runs held back, and by nothing else."""

from typing import NamedTuple

import jax
import numpy as np
import pytest
from profiles import training_profile
from scored import score_batch
from synthetic_plants import noisy, plant, straight_network

from parc_jax.common.keys import Stage
from parc_jax.learning.bound.pipeline import bound_error, bound_errors
from parc_jax.learning.bound.profile import SHARE, evened, learnt_from
from parc_jax.learning.bound.settings import BoundSettings
from parc_jax.learning.bound.start_gap import StartTrial
from parc_jax.learning.runs.collect import collect

KEY, NET, BINS = jax.random.PRNGKey(0), straight_network(4), (3, 1)


@pytest.fixture(scope="module")
def runs():
    return collect(plant(noisy), KEY, 300, quiet=True)


def pieces(batch, size):
    rows = np.arange(batch.n)
    return [batch.select((rows >= i) & (rows < i + size)) for i in range(0, batch.n, size)]


def test_every_bin_grows_by_its_own_largest_score(runs):
    few, rest = pieces(runs, 60)[0], pieces(runs, 60)[1:]
    profile = training_profile(NET, few, BINS)
    even = evened(NET, profile, iter(rest))
    seen = [score_batch(NET, batch, profile) for batch in rest]
    score = np.concatenate([s.score for s in seen])
    bins = profile.bin_of(np.concatenate([s.k for s in seen]))
    worst = np.array([max(1.0, score[bins == b].max(initial=0.0)) for b in range(3)])
    assert worst.max() > 1.1  # few runs were too few
    for before, after in zip(profile.halves, even.halves, strict=True):
        factor = (after / before).reshape(3, -1)
        np.testing.assert_allclose(factor, np.broadcast_to(worst[:, None], factor.shape))
    assert max(score_batch(NET, batch, even).score.max() for batch in rest) <= 1 + 1e-12


def test_without_runs_a_profile_stays_as_it_is(runs):
    profile = training_profile(NET, runs, BINS)
    assert evened(NET, profile, iter(())) is profile


def test_a_quarter_is_held_back(runs):
    batches = iter(pieces(runs, 15))
    early = list(learnt_from(batches, 300))
    assert sum(batch.n for batch in early) == 300 - 300 // SHARE
    assert sum(batch.n for batch in batches) == 300 // SHARE
    assert list(learnt_from(iter(()), 0)) == []


def test_the_pipeline_learns_from_the_rest_only_and_holds_all(runs):
    class Given(NamedTuple):
        """Runs that are there already."""

        batches: list
        held: object

        def further(self, n):
            return iter(self.batches)

        def fresh(self, n):
            return (self.held,)

    holdout = collect(plant(noisy), KEY, 120, Stage.BOUND, quiet=True)
    given = Given(pieces(runs, 60), holdout)
    asked = BoundSettings(eps=0.1, delta=0.05, bins=BINS, profile_runs=300, fresh=120, even=True)
    start = StartTrial(0.0, None)
    (claim,) = bound_errors(NET, given, None, asked, start)
    profile = training_profile(NET, joined(given.batches[:4]), BINS)
    even = evened(NET, profile, given.batches[4:])
    scale = float.fromhex(claim.evidence["scale"])
    for ours, theirs in zip(claim.tube.halves, even.halves, strict=True):
        np.testing.assert_allclose(ours, scale * theirs, rtol=1e-6, atol=1e-9)


@pytest.mark.slow
def test_the_one_call_takes_it_too(runs):
    asked = {"eps": 0.1, "delta": 0.05, "bins": BINS, "train": runs, "profile_runs": 40}
    claims = [
        bound_error(NET, plant(noisy), KEY, quiet=True, even=even, **asked)
        for even in (True, False)
    ]
    assert claims[0].evidence["profile"] != claims[1].evidence["profile"]


def joined(batches):
    """One batch of the rows of several."""
    rows = {name: [] for name in ("rows", "k", "p", "q")}
    for batch in batches:
        for name, parts in rows.items():
            parts.append(getattr(batch, name))
    return batches[0].replace(**{name: np.concatenate(parts) for name, parts in rows.items()})
