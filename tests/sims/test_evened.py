"""A profile made even: bins grow by what they lacked for runs held back, and by nothing else."""

import jax
import numpy as np
import pytest
from profiles import training_profile
from scored import score_batch
from synthetic_plants import noisy, plant, straight_network

from parc_jax.learning.runs.collect import collect
from sims.evened import evened

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
