"""Uncertainty: what may be said, and what is refused in one sentence."""

from fractions import Fraction

import numpy as np
import pytest
from toy_models import line_model

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.problem.body import hull
from parc_jax.problem.problem import goal_of_points, reach_avoid
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.statement import about_pose

GOAL = box([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0])
WALL = box([2.0, -1.0], [3.0, 1.0])

REFUSED = {
    "a negative start": (
        {"start": [-0.1, 0.1]},
        "uncertainty start: expected finite half widths >= 0",
    ),
    "a negative tolerance": (
        {"k": {"speed": -1.0}},
        "uncertainty k of speed: expected finite half widths >= 0",
    ),
    "a negative goal": ({"goal": -1.0}, "uncertainty goal: expected finite half widths >= 0"),
    "a width of nothing": ({"k": {"speed": 1e-320}}, "speed: .* none between 0 and 1e-100"),
    "more than a place": ({"start": 10**400}, "uncertainty start: expected half widths, numbers"),
    "words for a start": ({"start": "wide"}, "uncertainty start: expected half widths, numbers"),
    "an endless start": ({"start": np.inf}, "uncertainty start: expected finite half widths"),
    "half a turn": ({"heading": 3.0}, "uncertainty heading: expected a half angle below 1 rad"),
    "unknown in no box": (
        {"unknown": {"load": None}},
        r"uncertainty unknown of load: expected a box \(lo",
    ),
    "unknown as a number": (
        {"unknown": {"load": 3.0}},
        "uncertainty unknown of load: expected a box",
    ),
    "a box inside out": (
        {"given": {"load": (2, 1)}},
        "uncertainty given of load: expected a box lo <= hi",
    ),
    "no names": ({"given": 3.0}, "uncertainty given: expected parameters by name"),
    "a number twice": (
        {"k": {"1": 0.5, 1: 0.1}},
        "uncertainty k: expected every parameter once; 1 is",
    ),
    "a name twice": (
        {"k": (("a", 0.5), ("a", 0.1))},
        "uncertainty k: expected every parameter once; a",
    ),
    "no parameter": (
        {"k": {True: 0.5}},
        "uncertainty k: expected parameters by name or number from 0",
    ),
    "obstacles by a number": ({"obstacles": [0.1]}, "uncertainty of obstacle 0: expected a Box"),
    "a number for obstacles": ({"obstacles": 0.1}, "uncertainty of obstacle 0: expected a Box"),
    "yes for a start": ({"start": True}, "uncertainty start: expected half widths, numbers"),
    "more than certain": (
        {"sensing_eps": 1.5},
        r"uncertainty sensing_eps: expected a probability in",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_uncertainty_is_refused(case):
    given, sentence = REFUSED[case]
    with pytest.raises(InputError, match=sentence):
        Uncertainty(**given)


def test_without_a_set_all_obstacles_are_exact():
    assert Uncertainty(obstacles=None).is_nothing


def test_a_goal_of_several_points_says_nothing_of_the_workspace():
    """Its rows were taken for that of a robot of one point, whose start has as many axes."""
    of_rear = {"rear": box([1.0, -1.0], [3.0, 1.0])}
    goal = goal_of_points(("rear", "front"), of_rear, q=box([-0.5], [0.5]))
    known = Uncertainty(start=[0.05, 0.02])
    for obstacles in ([], [WALL]):
        asked = reach_avoid(goal, obstacles, hull(0, 1, radius=0.1), uncertainty=known)
        assert asked.replace(spans=None).uncertainty is known
    with pytest.raises(InputError, match="or 2, one per axis of the workspace; got 3"):
        problem = reach_avoid(GOAL, [], 0.1, uncertainty=Uncertainty(start=[0.1, 0.1, 0.1]))
        query(problem, line_model()).nominal()


def test_uncertainty_must_fit_the_scene():
    small = box([-0.1], [0.1])
    cases = {
        "uncertainty start: expected one half width, or 2": Uncertainty(start=[0.1, 0.1, 0.1]),
        "one set for all or one for each of 1; got 2": Uncertainty(obstacles=[None, None]),
        "uncertainty of obstacle 0: expected a set in the 2-D": Uncertainty(obstacles=small),
    }
    for sentence, uncertainty in cases.items():
        with pytest.raises(InputError, match=sentence):
            reach_avoid(GOAL, [WALL], 0.1, uncertainty=uncertainty)
    with pytest.raises(InputError, match=r"uncertainty: expected Uncertainty; got 0.1"):
        reach_avoid(GOAL, [WALL], 0.1, uncertainty=0.1)


def test_nothing_is_nothing_and_something_is_not():
    assert Uncertainty().is_nothing
    assert Uncertainty(start=0, k=[0.0, 0.0], goal=[0, 0], obstacles=[None]).is_nothing
    for one in (
        {"start": 0.1},
        {"heading": 0.1},
        {"k": [0, 0.1]},
        {"goal": 0.1},
        {"obstacles": WALL},
        {"given": {"load": 0}},
        {"unknown": {"load": (0, 1)}},
        {"sensing_eps": 0.5},
    ):
        assert not Uncertainty(**one).is_nothing


def test_one_number_serves_all_axes_and_names_are_kept():
    uncertainty = Uncertainty(start=0.1, k={"speed": 0.2, 1: 0.3}, given={"load": 5, 2: (1, 2)})
    assert uncertainty.shifts(3).tolist() == [0.1] * 3
    assert uncertainty.k == (("speed", 0.2), (1, 0.3))
    assert uncertainty.given == (("load", (5.0, 5.0)), (2, (1.0, 2.0)))
    assert Uncertainty(goal=[1, 2, 3]).of_goal(2, 1).tolist() == [1, 2, 3]
    assert Uncertainty(goal=[1, 2]).of_goal(2, 1).tolist() == [1, 2, 0]
    assert Uncertainty(sensing_eps="1e-3").sensing_eps == Fraction(1, 1000)


def test_how_far_obstacles_and_poses_are_off_is_said_in_numbers():
    line = line_model(4, 0.01, rests=True)
    off = Uncertainty(obstacles=[box([-0.3, -0.1], [0.2, 0.1]), None])
    asked = reach_avoid(GOAL, [WALL, WALL], 0.1, uncertainty=off)
    assert query(asked, line).nominal().uncertainty.words == (
        "obstacle 0 moved by an error of its set, which lies within -0.3 to 0.2, -0.1 to 0.1 m"
    )
    told = about_pose(([1234.5678, 2.0], 0.1234567), line)
    assert "(1234.5678, 2) m with heading 0.1234567 rad" in told
