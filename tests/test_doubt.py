"""Doubt: what may be said, and what is refused in one sentence."""

from fractions import Fraction

import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.problem.doubt import Doubt
from parc_jax.problem.problem import reach_avoid

GOAL = box([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0])
WALL = box([2.0, -1.0], [3.0, 1.0])

REFUSED = {
    "a negative start": (
        {"start": [-0.1, 0.1]},
        "doubt start: expected half widths >= 0; got -0.1",
    ),
    "a negative tolerance": ({"k": {"speed": -1.0}}, "doubt k of speed: expected half widths >= 0"),
    "a negative goal": ({"goal": -1.0}, "doubt goal: expected half widths >= 0"),
    "words for a start": ({"start": "wide"}, "doubt start: expected half widths, numbers"),
    "an endless start": ({"start": np.inf}, "doubt start: expected finite half widths"),
    "half a turn": ({"heading": 3.0}, "doubt heading: expected a half angle below 1 rad"),
    "unknown in no box": (
        {"unknown": {"load": None}},
        r"doubt unknown of load: expected a box \(lo",
    ),
    "unknown as a number": ({"unknown": {"load": 3.0}}, "doubt unknown of load: expected a box"),
    "a box inside out": (
        {"given": {"load": (2, 1)}},
        "doubt given of load: expected a box lo <= hi",
    ),
    "no names": ({"given": 3.0}, "doubt given: expected parameters by name"),
    "a number twice": ({"k": {"1": 0.5, 1: 0.1}}, "doubt k: expected every parameter once; 1 is"),
    "a name twice": ({"k": (("a", 0.5), ("a", 0.1))}, "doubt k: expected every parameter once; a"),
    "no parameter": ({"k": {True: 0.5}}, "doubt k: expected parameters by name, or by number"),
    "obstacles by a number": ({"obstacles": [0.1]}, "doubt of obstacle 0: expected a Box"),
    "more than certain": ({"sensing_eps": 1.5}, r"doubt sensing_eps: expected a probability in"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_doubt_is_refused(case):
    given, sentence = REFUSED[case]
    with pytest.raises(InputError, match=sentence):
        Doubt(**given)


def test_doubt_must_fit_the_scene():
    small = box([-0.1], [0.1])
    cases = {
        "doubt start: expected one half width, or 2": Doubt(start=[0.1, 0.1, 0.1]),
        "one set for all or one for each of 1; got 2": Doubt(obstacles=[None, None]),
        "doubt of obstacle 0: expected a set in the 2-D": Doubt(obstacles=small),
    }
    for sentence, doubt in cases.items():
        with pytest.raises(InputError, match=sentence):
            reach_avoid(GOAL, [WALL], 0.1, doubt=doubt)
    with pytest.raises(InputError, match="doubt: expected a Doubt; got float"):
        reach_avoid(GOAL, [WALL], 0.1, doubt=0.1)


def test_nothing_is_nothing_and_something_is_not():
    assert Doubt().is_nothing
    assert Doubt(start=0, k=[0.0, 0.0], goal=[0, 0], obstacles=[None], sensing_eps=0.5).is_nothing
    for one in (
        {"start": 0.1},
        {"heading": 0.1},
        {"k": [0, 0.1]},
        {"goal": 0.1},
        {"obstacles": WALL},
        {"given": {"load": 0}},
        {"unknown": {"load": (0, 1)}},
    ):
        assert not Doubt(**one).is_nothing


def test_one_number_serves_all_axes_and_names_are_kept():
    doubt = Doubt(start=0.1, k={"speed": 0.2, 1: 0.3}, given={"load": 5, 2: (1, 2)})
    assert doubt.shifts(3).tolist() == [0.1] * 3
    assert doubt.k == (("speed", 0.2), (1, 0.3))
    assert doubt.given == (("load", (5.0, 5.0)), (2, (1.0, 2.0)))
    assert Doubt(goal=[1, 2, 3]).of_goal(2, 1).tolist() == [1, 2, 3]
    assert Doubt(goal=[1, 2]).of_goal(2, 1).tolist() == [1, 2, 0]
    assert Doubt(sensing_eps="1e-3").sensing_eps == Fraction(1, 1000)
