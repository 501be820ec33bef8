"""Laws of tubes and claims over random inputs."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from parc_jax.learning.bound.calibrate import kept_maximum, scaled
from parc_jax.learning.bound.measure import Errors, ratios
from parc_jax.learning.bound.tube import tube, tube_from_json, tube_to_json

pytestmark = pytest.mark.property
PROFILE = settings(derandomize=True, deadline=None, max_examples=60)


def random_case(seed, n, bins):
    rng = np.random.default_rng(seed)
    edges = [np.concatenate([[0.0], np.sort(rng.random(b - 1)), [1.0]]) for b in bins]
    n_bins, size = int(np.prod(bins)), 10.0 ** rng.uniform(-9, 3)
    profile = tube(
        edges, size * rng.uniform(1e-3, 1, (n_bins, 4, 2)), size * rng.uniform(1e-3, 1, (n_bins, 3))
    )
    k = rng.random((n, len(bins)))
    on_edge = rng.random(n) < 0.2
    k[on_edge, 0] = rng.choice(edges[0], on_edge.sum())
    errors = Errors(size * rng.exponential(size=(n, 4, 2)), size * rng.exponential(size=(n, 3)))
    return rng, profile, k, errors


@PROFILE
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 4), st.integers(1, 3))
def test_a_run_fits_the_tube_exactly_when_its_score_does(seed, n, b0, b1):
    rng, profile, k, errors = random_case(seed, n, (b0, b1))
    tried = [ratios(errors, profile, bins).max(axis=1) for bins in profile.bins_of(k).T]
    score = np.maximum.reduce(tried)
    discard = int(rng.integers(0, n))
    scale = kept_maximum(score, discard)
    held = scaled(profile, np.full(profile.n_bins, scale), np.zeros(2))
    numbers = profile.bins_of(k)
    fits = (errors.interval <= held.interval[numbers].min(axis=1)).all(axis=(1, 2))
    fits &= (errors.final <= held.final[numbers].min(axis=1)).all(axis=1)
    assert fits[score <= scale].all() and (~fits[score > scale * (1 + 1e-12)]).all()
    assert (~fits).sum() <= discard


@PROFILE
@given(st.integers(0, 2**32 - 1), st.floats(0, 1e300), st.floats(0, 1e-300))
def test_tubes_travel_through_json_bit_for_bit(seed, large, small):
    _, profile, _, _ = random_case(seed, 3, (2, 2))
    interval = np.array(profile.interval)
    interval[0, 0], interval[3] = [large, small], np.inf
    before = tube(profile.edges, interval, profile.final)
    after = tube_from_json(json.loads(json.dumps(tube_to_json(before))))
    assert after.hash == before.hash and (after.claimed == before.claimed).all()


@PROFILE
@given(st.integers(0, 2**32 - 1), st.integers(2, 30))
def test_more_discards_never_widen_and_failures_count_first(seed, n):
    score = np.random.default_rng(seed).exponential(size=n)
    kept = [kept_maximum(score, r) for r in range(n)]
    assert kept == sorted(kept, reverse=True)
    score[0] = np.inf
    assert kept_maximum(score, 0) == np.inf and kept_maximum(score, 1) <= kept[0]
