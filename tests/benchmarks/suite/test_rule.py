"""The rule that "none" rests on: of every scene that has a plan, one plan in two hundred that are
drawn evenly succeeds.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.suite.binomial import tail
from benchmarks.suite.boxes import TOYS
from benchmarks.suite.entries import by_tube
from benchmarks.suite.entries.kit import SCARCE
from benchmarks.suite.instances import instances
from benchmarks.suite.result import SCORES
from benchmarks.suite.score import NONE, share_failing, succeed

RESULTS = Path(by_tube.__file__).parents[1] / "results"
SELDOM = 0.01  # would as many be seen, were plans as scarce as the rule allows
SOLVABLE = [one for one in instances() if one.known != NONE]


def of(boxes):
    found = [one for one in SOLVABLE if one.box.partition(":")[0] in boxes]
    return pytest.mark.parametrize("one", found, ids=lambda one: one.id)


@pytest.mark.slow
@of(TOYS)
def test_plans_of_toys_that_truly_succeed_are_not_rare(one):
    """By the sum over all that chance may do; and single runs of these plans bear it out."""
    plans = np.random.default_rng(0).uniform(*one.bounds, (4000, one.bounds.shape[1]))
    good = plans[share_failing(one, plans, one.eps) <= one.eps]
    assert tail(len(plans), len(good), SCARCE) < SELDOM
    failed = int((~succeed(one, good, np.random.default_rng(1))).sum())
    assert tail(len(good), failed, one.eps) > 1e-4


def test_plans_of_robots_are_not_rare_where_truth_was_drawn():
    scores = json.loads((RESULTS / SCORES).read_text())["instances"]
    drawn = [one.id for one in SOLVABLE if one.id in scores]
    assert len(drawn) > 5
    for name in drawn:
        truth = scores[name]["truth"]
        assert tail(truth["plans"], truth["good"], SCARCE) < SELDOM, name
