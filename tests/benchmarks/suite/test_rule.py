"""The rule that "none" rests on: of every scene that has a plan, one plan in two hundred that are
drawn evenly succeeds.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.suite.binomial import tail
from benchmarks.suite.boxes import ROBOTS, TOYS, bar, puck
from benchmarks.suite.entries import by_tube
from benchmarks.suite.entries.kit import SCARCE
from benchmarks.suite.instances import instances
from benchmarks.suite.result import SCORES
from benchmarks.suite.score import NONE, succeed

RESULTS = Path(by_tube.__file__).parents[1] / "results"
GUSTS = {"puck": puck.GUST, "bar": bar.GUST}
SELDOM = 0.01  # would as many be seen, were plans as scarce as the rule allows
SOLVABLE = [one for one in instances() if one.known != NONE]


def of(boxes):
    found = [one for one in SOLVABLE if one.box.partition(":")[0] in boxes]
    return pytest.mark.parametrize("one", found, ids=lambda one: one.id)


@of(TOYS)
def test_plans_of_toys_that_no_gust_can_spoil_are_not_rare(one):
    """A run without a gust that clears all by the largest one is of a plan that succeeds in any,
    where no jump and no caster comes into it.
    """
    own, _, variant = one.box.partition(":")
    sloping = variant == "slope"  # has a gust of its own, which another is twice as far from
    calm = replace(one, box=one.box if sloping else f"{own}:calm")
    spoilt = np.full(2, (1 + sloping) * GUSTS[own])
    calm.__dict__["scene"] = by_tube.shrunk(one.scene, spoilt, 0.0, spoilt)
    plans = np.random.default_rng(0).uniform(*one.bounds, (20_000, one.bounds.shape[1]))
    good = succeed(calm, plans, np.random.default_rng(1)) & ~_trapped(variant, plans)
    assert tail(len(plans), int(good.sum()), SCARCE) < SELDOM


def _trapped(variant, plans):
    ahead, left = plans[:, -2:].T
    if variant == "jumps":
        return ahead > puck.FAST
    return (variant == "hidden") & (ahead < puck.GENTLE) & (left > puck.LEFT)


def test_plans_of_robots_are_not_rare_where_truth_was_drawn():
    scores = json.loads((RESULTS / SCORES).read_text())["instances"]
    drawn = [one.id for one in SOLVABLE if one.id in scores]
    assert len(drawn) > 5
    for name in drawn:
        truth = scores[name]["truth"]
        assert tail(truth["plans"], truth["good"], SCARCE) < SELDOM, name


@pytest.mark.night
@of(ROBOTS)
def test_plans_of_robots_succeed_in_single_runs(one):
    plans = np.random.default_rng(0).uniform(*one.bounds, (300, one.bounds.shape[1]))
    good = succeed(one, plans, np.random.default_rng(1))
    assert tail(len(plans), int(good.sum()), SCARCE) < SELDOM
