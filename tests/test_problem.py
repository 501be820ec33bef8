"""Problems: goals over several reference points, workspaces."""

import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.problem.body import Body, Disc, Part, hull
from parc_jax.problem.problem import goal_of_points, reach_avoid
from parc_jax.problem.uncertainty import Uncertainty

NAMES = ("centre", "left", "right")
BAY = box([0.0, 1.0], [2.0, 3.0])


def test_a_goal_may_ask_all_points_into_one_set(rng):
    goal = goal_of_points(NAMES, BAY, box([-1.0], [1.0]))
    assert goal.n == 7
    for _ in range(200):
        ends = rng.uniform([-0.5, 0.5], [2.5, 3.5], (3, 2))
        q = rng.uniform(-1.5, 1.5)
        state = np.append(ends.ravel(), q)
        inside = ((ends >= BAY.lo) & (ends <= BAY.hi)).all() and abs(q) <= 1
        assert (goal.A @ state <= goal.b).all() == inside


def test_a_goal_may_ask_for_some_points_alone():
    goal = goal_of_points(NAMES, {"right": BAY, "centre": box([-9.0, -9.0], [9.0, 9.0])})
    free = np.array([0, 0, 1e6, -1e6, 1.0, 2.0])
    assert goal.n == 6 and (goal.A @ free <= goal.b).all()
    assert not (goal.A @ np.array([0, 0, 0, 0, 3.0, 2.0]) <= goal.b).all()


def test_goals_over_points_there_are_not_are_refused():
    with pytest.raises(InputError, match=r"\(centre, left, right\); got 'nose'"):
        goal_of_points(NAMES, {"nose": BAY})
    with pytest.raises(InputError, match="one dimension for all points; right has 3, not 2"):
        goal_of_points(NAMES, {"left": BAY, "right": box([0.0] * 3, [1.0] * 3)})
    with pytest.raises(InputError, match="at least one reference point"):
        goal_of_points(NAMES, {})
    with pytest.raises(InputError, match="one for each that is named; got 'left' and 1"):
        goal_of_points(NAMES, {"left": BAY, 1: box([5, 5], [6, 6])})


def test_a_problem_keeps_the_names_its_goal_was_made_for():
    goal = goal_of_points(np.array(NAMES), {"right": BAY})
    assert goal.points == NAMES
    problem = reach_avoid(goal, [BAY], hull("left", "right"))
    assert problem.points == NAMES
    assert type(problem.goal) is HPolytope and (problem.goal.A == goal.A).all()
    assert reach_avoid(box([0.0] * 6, [1.0] * 6), [BAY], 0.5).points == ()


def test_a_problem_says_what_its_body_is():
    problem = reach_avoid(goal_of_points(NAMES, BAY), [BAY], hull("left", "right", radius=0.5))
    assert [part.points for part in problem.parts] == [("left", "right")]
    assert "hull of left, right, grown by Disc(radius=0.5)" in repr(problem)


def test_what_is_replaced_is_given_as_to_a_new_problem():
    problem = reach_avoid(BAY, [], 0.5, spans=[])
    wall = box([5.0, 0.0], [6.0, 1.0])
    other = problem.replace(goal=wall, obstacles=[BAY, wall], body=0.25, start=BAY)
    made = reach_avoid(wall, [BAY, wall], 0.25, BAY)
    assert repr(other) == repr(made) and other.spans == made.spans
    np.testing.assert_array_equal(other.obstacles[1].A, made.obstacles[1].A)
    assert other.body == made.body
    named = reach_avoid(goal_of_points(NAMES, BAY), [BAY], hull("left"), spans=[(0, 1)])
    assert named.replace(body=hull("right")).points == NAMES
    assert named.replace(obstacles=[wall], spans=named.spans).spans == ((0, 1),)
    for wrong, said in (
        ({"obstacles": [1.0], "spans": [None]}, "obstacle: expected a Box or an HPoly"),
        ({"obstacles": [BAY, wall], "spans": named.spans}, r"one per obstacle \(2\); got 1"),
        ({"obstacle": [BAY]}, "entries to change among goal, obstacles.* got obstacle"),
        ({"body": -1.0}, "radius: expected a number >= 0"),
    ):
        with pytest.raises(InputError, match=said):
            named.replace(**wrong)


def test_new_obstacles_do_not_take_over_what_the_old_ones_have_one_by_one():
    """They did by their place in the list: a wall existed while the van before it had."""
    wall, error = box([5.0, 0.0], [6.0, 1.0]), box([-0.1, -0.1], [0.1, 0.1])
    spans, each = reach_avoid(BAY, [BAY, wall], 0.5, spans=[(0, 1), None]), [None, error]
    errors = reach_avoid(BAY, [BAY, wall], 0.5, uncertainty=Uncertainty(obstacles=each))
    for told, name in ((spans, "spans"), (errors, "uncertainty")):
        with pytest.raises(InputError, match=f"problem: expected {name} beside new obstacles"):
            told.replace(obstacles=[wall, BAY])
        assert getattr(told.replace(obstacles=[wall], **{name: None}), name) in ((None,), None)
    alike = reach_avoid(BAY, [BAY], 0.5, spans=[None], uncertainty=Uncertainty(obstacles=error))
    assert alike.replace(obstacles=[BAY, wall]).uncertainty == alike.uncertainty  # one for all


ROWS = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_sets_made_by_hand_are_validated(wrong):
    bad = HPolytope(ROWS, np.array([0.5, -0.3, wrong, 3.0]))
    with pytest.raises(InputError, match="obstacle: polytope b: expected finite numbers; got 1"):
        reach_avoid(BAY, [BAY, bad], 0.05)
    with pytest.raises(InputError, match="goal: polytope b: expected finite"):
        reach_avoid(bad, [], 0.05)
    with pytest.raises(InputError, match="start: polytope A: expected finite"):
        reach_avoid(BAY, [], 0.05, HPolytope(np.where(ROWS, wrong, 0.0), np.ones(4)))
    with pytest.raises(InputError, match="goal of left: polytope b: expected finite"):
        goal_of_points(NAMES, {"left": bad})
    with pytest.raises(InputError, match="uncertainty of obstacle 1: polytope b: expected finite"):
        Uncertainty(obstacles=[None, bad])
    with pytest.raises(InputError, match="obstacle: hpolytope: expected a nonzero normal"):
        reach_avoid(BAY, [HPolytope(0 * ROWS, np.ones(4))], 0.05)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ((), "body: expected at least one part; got none"),
        ((Part((0,), Disc(-0.5)),), "part 0 of the body radius: expected a number >= 0; got -0.5"),
        ((Part((0,), Disc(True)),), "part 0 of the body radius: expected numbers of .*; got True"),
        ((Part((0,), Disc(np.nan)),), "part 0 of the body radius: expected finite numbers"),
        ((Part((), Disc(0.5)),), "part 0 of the body: expected at least one reference point"),
    ],
)
def test_bodies_made_by_hand_are_validated(parts, said):
    problem = reach_avoid(BAY, [BAY], hull(0))
    for make in (lambda body: reach_avoid(BAY, [BAY], body), lambda b: problem.replace(body=b)):
        with pytest.raises(InputError, match=said):
            make(Body(parts))


def test_boxes_made_by_hand_are_validated():
    with pytest.raises(InputError, match="obstacle: box: expected lo <= hi"):
        reach_avoid(BAY, [Box(BAY.hi, BAY.lo)], 0.05)  # no wall at all, as a set
    with pytest.raises(InputError, match="obstacle: box upper corner: expected finite"):
        reach_avoid(BAY, [Box(BAY.lo, BAY.hi + np.inf)], 0.05)
