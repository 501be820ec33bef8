"""The stopping rule: only announced looks stop, and each pays for its chance to be wrong."""

import numpy as np
import pytest
from scipy.stats import binom

import parc_jax as pj
from parc_jax.safe_set.corridors import stopping
from parc_jax.safe_set.corridors.stopping import ARMED, TOGETHER, stopping_rule


def test_announced_looks_alone_satisfy_a_rule_and_it_pays_for_each():
    good = np.arange(1000) >= 20
    rule = stopping_rule(0.1, 0.99).after(good)
    assert rule.coverage.at_least > 0.9 and not rule.satisfied  # nothing had announced it
    assert rule.after(good).satisfied and not rule.satisfied
    rule = stopping_rule(0.1, 0.99)
    bounds = []
    for _ in range(4):  # each judged alone
        rule = rule.after(np.arange(1000) >= 0.1 * ARMED * 1000 - 1)  # announces, never satisfies
        bounds.append(rule.coverage.at_least)
    assert bounds == sorted(bounds, reverse=True) and bounds[-1] < bounds[1]
    rule = rule.after(np.zeros(10, bool))
    assert rule.coverage.share == rule.coverage.at_least == 0


def test_many_looks_show_together_what_none_shows_alone_and_no_more_than_the_target():
    """82 of 1,000 outside, again and again, where a tenth may be."""
    rule = stopping_rule(0.1, 0.99)
    for _ in range(30):
        rule = rule.after(np.arange(1000) >= 82)
    one = [stopping.largest_share(1000, 82, 0.99, part) for part in range(1, len(rule.looks) + 1)]
    assert rule.satisfied and min(one) > 0.1 and rule.coverage.at_least == 1 - rule.target
    n, out = rule.coverage.fresh_safe, rule.coverage.fresh_uncovered
    assert 1000 < n <= 1000 * len(rule.looks) / TOGETHER and out == 0.082 * n
    assert stopping.largest_share(n, out, 0.995, len(rule.looks)) <= 0.1


def test_what_was_outside_before_more_was_built_tells_against_the_cover(rng):
    """A cover that grows until it leaves a little more than its target, asked again and again, is
    confirmed as seldom as one that never grew. [T31]
    """
    wrong = 0
    for _ in range(300):
        rule = stopping_rule(0.1, 0.8)
        for share in np.linspace(0.8, 0.899, 30):
            rule = rule.after(rng.random(300) < share)
        wrong += rule.satisfied
    assert wrong <= binom.ppf(0.9999, 300, 0.2)


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

    def no_part_for_each_look(n, out, confidence, part):
        return float(binom.ppf(0.8, n, out / n)) / n

    monkeypatch.setattr(stopping, "largest_share", no_part_for_each_look)
    assert wrongly_satisfied(300, 0.8, 0.899, rng) > binom.ppf(0.9999, 300, 0.2)


def test_the_last_look_of_a_search_has_its_own_part_of_the_error():
    """Each look after the announcement may be the last one, whatever the one before it showed: its
    bound must not use the first one's part again. [T31]
    """
    rule = stopping_rule(0.01, 0.99).after(np.arange(1000) >= 12)  # announces the next look
    rule = rule.after(np.arange(1000) >= 200)  # the first that counts: does not satisfy
    last = rule.after(np.arange(1000) >= 20)
    assert last.coverage.at_least == 1 - stopping.largest_share(1000, 20, 0.99, 2)
    assert last.coverage.at_least < 1 - stopping.largest_share(1000, 20, 0.99, 1)


@pytest.mark.parametrize(
    "wrong",
    [
        {"target": 0.0},
        {"target": 1.0},
        {"confidence": 1.0},
        # "at least" would lie above what was seen
        {"confidence": 0.4},
        {"confidence": 1e-300},
        {"work": 0.0},
        {"work": float("inf")},
        {"samples": 0},
        {"target": "little"},
    ],
    ids=str,
)
def test_settings_without_meaning_are_refused(wrong):
    with pytest.raises(pj.InputError, match=f"^settings: .*{next(iter(wrong))}"):
        pj.Settings(**wrong)
    assert pj.Settings(confidence=0.5).confidence == 0.5
