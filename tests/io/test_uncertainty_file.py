"""Uncertainty in scene files: read as it stands, written and read again alike."""

from fractions import Fraction

import numpy as np
import pytest
from scene_text import problem_of_text

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.problem_file import load_problem, save_problem
from parc_jax.problem.uncertainty import Uncertainty

SCENE = """
[goal]
lo = [-1, -1, -1]
hi = [1, 1, 1]
[body]
radius = 0.1
[[obstacles]]
lo = [2, -1]
hi = [3, 1]
[[obstacles]]
lo = [-3, -1]
hi = [-2, 1]
uncertainty = { A = [[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], b = [0.1, 0.1, 0.1] }
"""
UNCERTAINTY = """
[uncertainty]
start = [0.05, 0.02]
heading = 0.03
k = { speed = 0.1, 1 = 0.2 }
goal = 0.1
obstacles = { lo = [-0.1, -0.1], hi = [0.1, 0.1] }
given = { load = 3.5, wind = [1, 2], v0 = "free" }
unknown = { grip = [0.7, 0.9] }
sensing_eps = 0.001
"""


def same(a: Uncertainty, b: Uncertainty) -> bool:
    plain = ("start", "heading", "k", "goal", "given", "unknown", "sensing_eps")
    sets = zip(a.obstacles, b.obstacles, strict=True)
    return all(getattr(a, name) == getattr(b, name) for name in plain) and all(
        x is y or (np.array_equal(x.A, y.A) and np.array_equal(x.b, y.b)) for x, y in sets
    )


def test_the_table_says_what_it_says():
    uncertainty = problem_of_text(SCENE + UNCERTAINTY, "scene").uncertainty
    asked = Uncertainty(
        start=[0.05, 0.02],
        heading=0.03,
        k={"speed": 0.1, 1: 0.2},
        goal=0.1,
        obstacles=[box([-0.1] * 2, [0.1] * 2), uncertainty.obstacles[1]],
        given={"load": 3.5, "wind": (1, 2), "v0": "free"},
        unknown={"grip": (0.7, 0.9)},
        sensing_eps="0.001",
    )
    assert same(uncertainty, asked) and len(uncertainty.obstacles[1].b) == 3
    alone = problem_of_text(SCENE, "scene").uncertainty
    assert alone.obstacles[0] is None and alone.start == ()


def test_what_is_written_is_read_again(tmp_path):
    first = problem_of_text(SCENE + UNCERTAINTY, "scene")
    again = load_problem(save_problem(tmp_path / "scene.toml", first))
    assert same(first.uncertainty, again.uncertainty)
    box_of_all = Uncertainty(obstacles=box([-0.1] * 2, [0.1] * 2))
    one = reach_avoid(first.goal, first.obstacles, 0.1, uncertainty=box_of_all)
    again = load_problem(save_problem(tmp_path / "one.toml", one)).uncertainty
    assert len(again.obstacles) == 2 and again.obstacles[0] is not None


@pytest.mark.parametrize("told", ["0.001", "1/3", Fraction(1, 10**330), "0.1000000000000000000001"])
def test_no_chance_of_a_wrong_measurement_is_rounded_away(told, tmp_path):
    known = Uncertainty(sensing_eps=told)
    asked = problem_of_text(SCENE, "scene").replace(uncertainty=known)
    again = load_problem(save_problem(tmp_path / "scene.toml", asked)).uncertainty
    assert again.sensing_eps == known.sensing_eps > 0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[uncertainty]\nstrat = 1", "uncertainty: expected start, heading, .*; got 'strat'"),
        (
            "[uncertainty]\nk = { 1 = 0.5, 01 = 0.001 }",
            "uncertainty k: expected every parameter once; 1 is",
        ),
        ("[uncertainty]\nstart = [[1]]", "uncertainty start: expected a list of numbers"),
        ("[uncertainty]\nunknown = { load = 1 }", "uncertainty unknown of load: expected a box"),
        ("[uncertainty]\nheading = [1]", "uncertainty heading: expected one number"),
        (
            "[uncertainty]\nobstacles = { lo = [0] }",
            "uncertainty obstacles: expected `lo` and `hi`",
        ),
    ],
)
def test_bad_tables_are_refused_by_name(text, sentence):
    with pytest.raises(InputError, match=sentence):
        problem_of_text(SCENE + text, "scene")


def test_an_entry_stands_once():
    twice = SCENE + "[uncertainty.k]\nspeed = 0.5\nspeed = 0.001\n"
    with pytest.raises(InputError, match=r"scene in TOML; .*overwrite a value"):
        problem_of_text(twice, "scene.toml")
