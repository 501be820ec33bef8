"""The scorer against what is known in closed form, against answers that cheat, and against its own
noise.
"""

import json

import numpy as np
import pytest
from scipy.stats import binom
from suite_cases import GOAL, HI, LO, case, fails, grid, reaching, robust, text

from benchmarks.suite.binomial import interval, tail
from benchmarks.suite.boxes import TOYS, puck
from benchmarks.suite.instances import instances
from benchmarks.suite.score import LOST, STANDS, WHOLE, score, seed_of, share_failing, succeed


def judged(instance, answer: bytes, chance="0"):
    """What came of one answer."""
    return score(instance, {"one": answer}, chance)["entries"]["one"]


def test_counts_of_trials_are_those_of_another_program():
    for n, x, p in ((400, 7, 0.01), (4000, 90, 0.01), (200_000, 40, 2e-4), (50, 50, 0.9)):
        assert tail(n, x, p) == pytest.approx(binom.sf(x - 1, n, p), rel=1e-9)
    low, high = interval(100, 7)
    assert binom.sf(6, 100, low) == pytest.approx(0.025, rel=1e-6)
    assert binom.cdf(7, 100, high) == pytest.approx(0.025, rel=1e-6)
    assert interval(10, 0)[0] == 0 and interval(10, 10)[1] == 1


def test_a_plan_fails_as_often_as_the_closed_form_says():
    plans = np.array([[0, 0, 2.0, 0.39], [0.1, -0.2, 2.27, 0.2], [0, 0, 2.4, 0.4], [0, 0, 2.9, 0]])
    n, rng = 4000, np.random.default_rng(0)
    for plan, share in zip(plans, fails(plans), strict=True):
        failed = n - succeed(case(), plan[None].repeat(n, axis=0), rng).sum()
        low, high = interval(n, int(failed), 1 - 1e-4)
        assert low <= share <= high


def test_the_share_of_plans_that_truly_succeed_is_the_closed_form():
    told = score(case(), {"one": text("unknown")}, "0")["truth"]
    low, high = interval(told["plans"], told["good"], 0.999)
    assert low <= (fails(grid()) <= 0.01).mean() <= high


def test_shares_of_failing_runs_are_the_closed_form():
    """To what a square of nodes leaves out, half of a row of it along each axis."""
    plans = grid(8)
    assert np.abs(share_failing(case(), plans) - fails(plans)).max() < 0.06
    known = fails(plans)
    clear = (known < 1e-9) | (known > 0.03)  # an edge of nodes is 1/800
    assert ((share_failing(case(), plans, 0.01) <= 0.01) == (known <= 0.01))[clear].all()


def test_truth_sees_what_is_rarer_than_any_run_shows():
    """A jump in one run of a thousand, at eps = 0.0002: 200 runs a plan hardly ever see it."""
    (one,) = instances("large", ["puck_06"])
    plans = np.array([[0.0, 0.0, puck.FAST + d, 0.0] for d in (-0.1, 0.1)])
    jumps = case(box="puck:jumps", goal=np.array([[1.6, -0.4], [2.4, 0.4]]))
    assert share_failing(jumps, plans) == pytest.approx([0.0, puck.JUMPS])
    assert one.eps < puck.JUMPS


@pytest.mark.slow
def test_a_yield_is_the_share_in_closed_form_and_five_scorers_agree_about_it():
    answer, plans = text(polytopes=[robust()]), grid()
    good = fails(plans) < 1e-9
    held = good & (plans[:, 2] <= 2.5)
    truth = held.sum() / good.sum()
    found = [judged(case(eps=0.001), answer, str(chance)) for chance in range(5)]
    assert all(one["status"] == "stands" and one["failures"]["sets"] == 0 for one in found)
    yields = np.array([one["yield"] for one in found])
    assert ((yields[:, 1] <= truth + 0.01) & (truth - 0.01 <= yields[:, 2])).sum() >= 4
    assert yields[:, 1].max() <= yields[:, 2].min()  # every two intervals have something in common
    points = [one["points"] for one in found]
    within = STANDS + (WHOLE - STANDS) * yields[:, 1:]
    assert (within.min() <= np.array(points)).all() and (np.array(points) <= within.max()).all()


@pytest.mark.parametrize(
    ("eps", "status"), [(0.005, "refuted"), (0.03, "stands")], ids=["too often", "rarely enough"]
)
def test_failures_decide_against_eps(eps, status):
    """Plans of the whole goal fail where the gust takes them over its edge, in 7 runs of 100 as
    drawn; half of them, in its middle, hardly ever.
    """
    edge = np.array([[0.0, 0.0], [0.0, 0.0]])
    edge[:, 0] = (0.012, -0.012)
    answer = text(polytopes=[reaching(GOAL + edge)])
    if status == "stands":
        answer = text(polytopes=[reaching(GOAL + np.array([[0.02], [-0.02]]))])
    assert judged(case(eps=eps), answer)["status"] == status


def whole():
    return [{"lo": (-1e9 * np.ones(4)).tolist(), "hi": (1e9 * np.ones(4)).tolist()}]


def dust(n):
    """Slices of all plans, so thin that no draw is in one."""
    slices = [[0, 0, 1, 1], [0, 0, -1, -1]]
    ends = [[at, 1e-7 - at] for at in np.linspace(2.0, 3.0, n)]
    return [{"lo": LO.tolist(), "hi": HI.tolist(), "A": slices, "b": b} for b in ends]


def twins(n):
    """A set that holds, told so often, each a little smaller than the one before."""
    one = robust()
    return [one | {"b": [float(b) - 1e-7 * i for b in one["b"]]} for i in range(n)]


CHEATS = {
    "dust": (text(polytopes=dust(5)), "empty", 0),
    "twins": (text(polytopes=twins(100)), "invalid", 0),
    "the whole space": (text(boxes=whole()), "refuted", LOST),
    "all plans": (text(boxes=[{"lo": LO.tolist(), "hi": HI.tolist()}]), "refuted", LOST),
    "NaN": (b'{"verdict": "some", "plans": [[NaN, 0, 2, 0]]}', "invalid", 0),
    "infinity": (b'{"verdict": "some", "plans": [[1e999, 0, 2, 0]]}', "invalid", 0),
    "nothing": (text(), "empty", 0),
    "an empty polytope": (text(polytopes=[robust() | {"b": [-9, -9, -9, -9]}]), "empty", 0),
    "a plan": (text(plans=[[0, 0, 2, 0]]), "stands", STANDS),
    "a flat box": (text(boxes=[{"lo": [0, 0, 2, 0], "hi": [0, 0, 2, 0.1]}]), "stands", STANDS),
    "a flat box that fails": (
        text(boxes=[{"lo": [0, 0, 1, 0], "hi": [0, 0, 1, 1]}]),
        "refuted",
        LOST,
    ),
    "a bad plan among good sets": (
        text(polytopes=[robust()], plans=[[0, 0, 1, 0]]),
        "refuted",
        LOST,
    ),
    "none where there are some": (text("none"), "refuted", LOST),
    "unknown": (text("unknown"), "unknown", 0),
}


def test_dust_beside_a_set_that_holds_adds_nothing():
    alone, more = (judged(case(), text(polytopes=[robust(), *dust(n)])) for n in (0, 5))
    assert more["status"] == alone["status"] == "stands"
    assert more["yield"][1] <= alone["yield"][0] <= more["yield"][2]  # other draws, the same share


@pytest.mark.parametrize("name", CHEATS)
def test_a_cheat_gains_nothing(name):
    answer, status, points = CHEATS[name]
    found = judged(case(), answer)
    assert (found["status"], found["points"]) == (status, points), found


def test_plans_for_seeds_that_were_seen_fail_with_others():
    """The goal is narrower than the gust: with a seed in hand a plan can be aimed."""
    narrow = np.array([[1.98, -0.02], [2.02, 0.02]])
    instance = case(goal=narrow)
    plan = np.array([[0.0, 0.0, 2.0, 0.0]])
    p, _ = instance.black_box.rollout(plan[:, :2], plan[:, 2:], 7)
    aimed = plan.copy()
    aimed[0, 2:] += [2.0, 0.0] - p[0, -1, 0]
    assert instance.scene.succeeds(*instance.black_box.rollout(aimed[:, :2], aimed[:, 2:], 7)).all()
    assert judged(instance, text(plans=aimed.tolist()))["status"] == "refuted"


def test_none_is_right_where_there_is_none_by_construction_and_else_open():
    for known, status, points in (("none", "right", STANDS), ("", "open", 0)):
        narrow = case(goal=np.array([[1.98, -0.02], [2.02, 0.02]]), known=known)
        found = judged(narrow, text("none"))
        assert (found["status"], found["points"]) == (status, points)


def test_seeds_depend_on_the_answers_and_on_chance_that_was_drawn_later():
    one = case()
    seeds = {
        seed_of(one, {"a": b"x"}, "0"),
        seed_of(one, {"a": b"y"}, "0"),
        seed_of(one, {"b": b"x"}, "0"),
        seed_of(one, {"a": b"x"}, "1"),
        seed_of(one, {"a": b"x", "b": b"x"}, "0"),
    }
    assert len(seeds) == 5 and seed_of(one, {"a": b"x"}, "0") in seeds
    again = [score(one, {"a": text(polytopes=[robust()])}, "0") for _ in range(2)]
    assert json.dumps(again[0]) == json.dumps(again[1])


@pytest.mark.slow
def test_what_no_plan_solves_by_construction_has_none():
    for one in instances("large", TOYS):
        if one.known == "none":
            told = score(one, {"none": text("none")}, "0")
            assert told["truth"]["good"] == 0
            assert told["entries"]["none"]["status"] == "right"
