"""The stopping rule: only announced looks stop, and each pays for its chance to be wrong."""

import numpy as np
from scipy.stats import binom

from parc_jax.safe_set.corridors import stopping
from parc_jax.safe_set.corridors.stopping import ARMED, stopping_rule


def test_announced_looks_alone_satisfy_a_rule_and_it_pays_for_each():
    good = np.arange(1000) >= 20
    rule = stopping_rule(0.1, 0.99).after(good)
    assert rule.coverage.at_least > 0.9 and not rule.satisfied  # nothing had announced it
    assert rule.after(good).satisfied and not rule.satisfied
    rule = stopping_rule(0.1, 0.99)
    bounds = []
    for _ in range(5):
        rule = rule.after(np.arange(1000) >= 0.1 * ARMED * 1000 - 1)  # announces, never satisfies
        bounds.append(rule.coverage.at_least)
    assert bounds == sorted(bounds, reverse=True) and bounds[-1] < bounds[1]
    rule = rule.after(np.zeros(10, bool))
    assert rule.coverage.share == rule.coverage.at_least == 0


def test_a_satisfied_rule_stays_as_it_is():
    good = np.arange(1000) >= 20
    rule = stopping_rule(0.1, 0.99).after(good).after(good)
    assert rule.satisfied and rule.after(np.zeros(1000, bool)) == rule


def wrongly_satisfied(repeats, confidence, share, rng):
    """How often a rule is satisfied by a cover that leaves a little more than its target, asked
    again and again.
    """
    wrong = 0
    for _ in range(repeats):
        rule = stopping_rule(0.1, confidence)
        for _ in range(30):
            rule = rule.after(rng.random(300) < share)
        wrong += rule.satisfied
    return wrong


def test_looking_often_does_not_help_a_bad_cover(rng, monkeypatch):
    assert wrongly_satisfied(300, 0.8, 0.899, rng) <= binom.ppf(0.9999, 300, 0.2)

    def no_part_for_each_look(n, out, confidence, looks):
        return float(binom.ppf(0.8, n, out / n)) / n

    monkeypatch.setattr(stopping, "largest_share", no_part_for_each_look)
    assert wrongly_satisfied(300, 0.8, 0.899, rng) > binom.ppf(0.9999, 300, 0.2)


def test_the_look_at_which_time_runs_out_has_its_own_part_of_the_error():
    """After one announced look the search may be stopped by the clock at a look that was not: its
    bound must not use the first one's part again. [T31]
    """
    good = np.arange(1000) >= 20
    bad = np.arange(1000) >= 200
    rule = stopping_rule(0.01, 0.99).after(np.arange(1000) >= 12)  # announces the next look
    rule = rule.after(bad)  # the first that counts: does not satisfy, announces nothing
    assert rule.looks == 1 and not rule.announced
    last = rule.after(good)
    assert last.coverage.at_least == 1 - stopping.largest_share(1000, 20, 0.99, 2)
    assert last.coverage.at_least < 1 - stopping.largest_share(1000, 20, 0.99, 1)
    assert last.looks == 1  # it spent nothing that an announced one may need
