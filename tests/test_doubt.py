"""Doubt: what may be said, and what is refused in one sentence."""

from fractions import Fraction

import numpy as np
import pytest

from parc_jax.doubt import Doubt, words
from parc_jax.errors import InputError
from parc_jax.problem import reach_avoid
from parc_jax.sets.box import box

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
    "both": ({"given": {"a": 1}, "unknown": {"a": (0, 1)}}, "given or unknown; a is both"),
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


def test_the_words_name_all_of_it():
    doubt = Doubt(
        start=[0.1, 0.2],
        heading=0.05,
        k={1: 0.5},
        goal=0.3,
        obstacles=WALL,
        given={"load": 5, "wind": (1, 2)},
        unknown={0: (3, 4)},
    )
    text = words(doubt, ["speed", "angle"])
    for part in (
        "every start within ±0.1, ±0.2 m",
        "every heading within ±0.05 rad",
        "angle off by up to 0.5",
        "every goal moved by up to ±0.3",
        "every place of the obstacles",
        "load = 5 (measured)",
        "every wind from 1 to 2 (measured)",
        "every speed from 3 to 4 (unknown)",
    ):
        assert part in text
