"""Discards that other runs advise: few where errors are alike, as many as stick out or fail."""

import numpy as np
import pytest
from scipy.stats import binom

from parc_jax.learning.bound.counts import (
    MOST_SHARE,
    SURE,
    advised_discards,
    supported_eps,
    width_needed,
)

DELTA = 0.01
RNG = np.random.default_rng(0)


def test_where_runs_are_alike_there_is_room_for_a_first_failure_and_no_more():
    alike = RNG.uniform(0.9, 1.0, 100)
    advised = advised_discards(alike, 100, DELTA)
    assert advised == 2 and width_needed(alike, 100, advised) <= 1.0
    assert binom.cdf(1, 100, 1 / 101) < SURE <= binom.cdf(2, 100, 1 / 101)


def test_runs_that_stick_out_are_paid_for():
    few = np.concatenate([RNG.uniform(0.9, 1.0, 97), [30.0, 40.0, 50.0]])
    advised = advised_discards(few, 100, DELTA)
    assert 3 < advised <= MOST_SHARE * 100
    assert width_needed(few, 100, advised) < 1.0
    # as a search over all of them says
    cost = [supported_eps(100, DELTA, r) * width_needed(few, 100, r) for r in range(11)]
    assert advised == int(np.argmin([float(x) for x in cost]))


def test_never_more_than_their_share_but_for_failed_runs():
    heavy = RNG.pareto(0.5, 200)
    assert advised_discards(heavy, 100, DELTA) == MOST_SHARE * 100
    failing = np.concatenate([np.ones(80), np.full(20, np.inf)])
    advised = advised_discards(failing, 100, DELTA)
    assert width_needed(failing, 100, advised) == 1.0 and advised > 20
    assert not np.isfinite(width_needed(failing, 100, advised - 1))
    assert advised_discards(np.full(50, np.inf), 100, DELTA) == 0  # nothing helps


@pytest.mark.parametrize("discard", [0, 3])
def test_the_width_holds_as_often_as_it_says(discard):
    sizes = RNG.exponential(size=1000)
    width = width_needed(sizes, 50, discard)
    drawn = np.sort(RNG.choice(sizes, (4000, 50)), axis=1)[:, 49 - discard]
    assert SURE <= (drawn <= width).mean() + 0.02
    tighter = np.sort(sizes)[np.searchsorted(np.sort(sizes), width) - 1]
    assert (drawn <= tighter).mean() < SURE + 0.02


def test_few_runs_support_nothing_and_advise_nothing():
    assert advised_discards(np.ones(3), 0, DELTA) == 0
    assert advised_discards(np.array([1.0, np.inf]), 2, DELTA) == 0
