"""The error scale as a ReLU head: it follows the error over K, its bounds hold in every bin, its
claim is a claim.
"""

import jax
import numpy as np
import pytest
from synthetic_plants import noisy, plant, straight_network

from parc_jax.claim import scale
from parc_jax.claim.calibrate import calibrate
from parc_jax.claim.measure import measure
from parc_jax.claim.pipeline import learn_profiles
from parc_jax.claim.profile import edges_of
from parc_jax.claim.scale import fit_scale, scale_profile, upper_bounds
from parc_jax.claim.score import score_batch
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.network.predict import outputs
from parc_jax.rollout.collect import collect

pytestmark = pytest.mark.slow

KEY, NET = jax.random.PRNGKey(0), straight_network(4)


@pytest.fixture(scope="module")
def seen():
    """Training runs whose error grows with k_0, and their profile on 6 x 2 bins."""
    scale_of = pytest.MonkeyPatch()
    scale_of.setattr(scale, "STEPS", 300)
    train = collect(plant(noisy), KEY, 1500, quiet=True)
    profile = scale_profile(train.k, measure(NET, train), train.domain, (6, 2), (6,), KEY)
    scale_of.undo()
    return train, profile


def test_it_follows_the_error_over_k_and_never_vanishes(seen):
    train, profile = seen
    assert profile.n_bins == 12 and [len(e) for e in profile.edges] == [7, 3]
    end = profile.final[:, 0].reshape(6, 2).max(axis=1)
    assert (np.diff(end) > 0).all() and end[-1] > 2 * end[0]  # the plant's error grows along k_0
    least = scale.LEAST * measure(NET, train).interval.max(axis=0)
    assert (profile.interval >= least[None]).all() and (profile.interval > 0).all()


@pytest.mark.slow
def test_the_bounds_hold_in_every_bin_and_corners_alone_would_not():
    """A random head with kinks inside the bins: its value nowhere exceeds the bound, and the bound
    is attained.
    """
    rng = np.random.default_rng(1)
    k = rng.uniform(0, 1, (600, 2))
    bump = np.exp(-40 * ((k - [0.37, 0.61]) ** 2).sum(axis=1))
    head = fit_scale(k, np.stack([bump, bump[::-1]], axis=1), 1, (8,), KEY)
    edges = edges_of(plant(noisy).domain, (2, 2))
    bound, missed = upper_bounds(head, edges), False
    for number in range(4):
        lo = np.array([edges[0][number // 2], edges[1][number % 2]])
        inside = outputs(head, lo + 0.5 * rng.uniform(0, 1, (20_000, 2)))
        assert (inside <= bound[number] + 1e-9).all()
        np.testing.assert_allclose(inside.max(axis=0), bound[number], atol=0.05)
        corners = outputs(head, lo + 0.5 * np.array([[0, 0], [0, 1], [1, 0], [1, 1]], float)).max(
            axis=0
        )
        missed |= bool((inside > corners + 0.01).any())
    assert missed  # what the vertices of the regions are for


@pytest.mark.night
def test_a_study_may_ask_for_it(seen, monkeypatch):
    monkeypatch.setattr(scale, "STEPS", 20)
    one, two = learn_profiles([NET, NET], seen[0], (), (2, 1), (3,), KEY)
    assert one.hash == two.hash and one.n_bins == 2
    assert one.hash != learn_profiles([NET], seen[0], (), (2, 1), None, KEY)[0].hash


def test_the_claim_holds_on_new_runs(seen):
    train, profile = seen
    system = plant(noisy)
    holdout = collect(system, KEY, 300, Stage.BOUND, quiet=True)
    claim = calibrate(NET, holdout, profile, 0.02, 0.05, train=train)
    new = score_batch(NET, collect(system, KEY, 4000, Stage.VALIDATE, quiet=True), claim.tube)
    assert claim.kind == "pac" and (new.score > 1).mean() < 0.02
    with pytest.raises(InputError, match="hidden layer"):
        scale_profile(train.k, measure(NET, train), train.domain, (2, 2), (), KEY)
