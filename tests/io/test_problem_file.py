"""Scenes survive the way to a file and back, keep their decimals, and say what is wrong with
them.
"""

import json
from fractions import Fraction

import numpy as np
import pytest
from scene_text import problem_of_text
from toy_models import line_model, random_polygon

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.problem.body import Part, Polygon, body_of, hull
from parc_jax.problem.problem import Span, goal_of_points, reach_avoid
from parc_jax.problem.problem_file import load_problem, problem_text, save_problem
from parc_jax.proof.certificate.write import problem_part

SCENE = """
[goal]
lo = [29.7, -16.8, -1]
hi = [31.3, -15.2, 1.0]

[body]
radius = 0.1

[[obstacles]]
lo = [22.9665, -16.994]
hi = [27.2335, -15.006]
steps = [0, 3]
"""


def scenes(rng):
    goal = box([-0.2, -0.2, -1.0], [0.2, 0.2, 1.0])
    yield reach_avoid(goal, [], 0.0)
    yield reach_avoid(
        goal, [box([1.0, 0.0], [2.0, 1.0])], 0.25, box([-1.0, -1.0], [0.0, 0.1]), spans=[(1, 2)]
    )
    blocks = [box([1.0, 0.0], [2.0, 1.0])] * 3
    law = 'Movers each "leave" their \\ tube with probability at most 0.1.'
    made = [
        Span((0, 1), 0.25),
        Span((1, 2), at=0.0),
        Span((2, 3), 0.25, 0.0, said=law, mover="one"),
    ]
    yield reach_avoid(goal, blocks, 0.25, spans=made)
    triangle = Polygon(np.array([[0.1, 0.0], [0.0, 0.1], [-0.1, -0.3]]))
    yield reach_avoid(
        goal,
        [random_polygon(rng, [3.0, 1.0], 0.4), box([0, 0], [1, 1])],
        triangle,
        spans=[None, (0, 3)],
    )


def test_a_scene_survives_its_file(rng, tmp_path):
    for number, problem in enumerate(scenes(rng)):
        again = load_problem(save_problem(tmp_path / f"{number}.toml", problem))
        assert problem_part(again, line_model()) == problem_part(problem, line_model())
        for one, other in zip(problem.all_spans, again.all_spans, strict=True):
            assert one == other and getattr(one, "__dict__", {}) == getattr(other, "__dict__", {})


def test_decimals_are_the_floats_nearest_to_them():
    problem = problem_of_text(SCENE, "scene.toml")
    spelled = problem_part(problem, line_model())
    assert Fraction(31.3) in map(Fraction, spelled["goal"]["b"])
    assert Fraction(-22.9665) in map(Fraction, spelled["obstacles"][0]["b"])
    assert Fraction(spelled["body"]["parts"][0]["radius"]) == Fraction(0.1)
    assert spelled["obstacles"][0]["steps"] == [0, 3]
    assert problem_of_text(problem_text(problem), "again").spans == ((0, 3),)


WRONG = [
    ("radius = 0.1", "radius = nan", "body radius: expected finite numbers; got NaN"),
    ("radius = 0.1", "radius = -0.1", "radius: expected a number >= 0"),
    ("radius = 0.1", "size = 0.1", "'size'. Is it misspelled?"),
    ("radius = 0.1", "radius = 0.1\nvertices = [[0, 0]]", "either `radius` or `vertices`"),
    ("radius = 0.1", "vertices = [[0.0, 1.0], [2.0]]", "list of rows of as many numbers"),
    ("hi = [31.3, -15.2, 1.0]", "hi = [31.3, -15.2]", "expected shape (3,); got (2,)"),
    (
        "hi = [31.3, -15.2, 1.0]",
        "hi = [28.3, -15.2, 1.0]",
        "axis 0 has lo = 29.7 > hi = 28.3. Swap",
    ),
    ("hi = [31.3, -15.2, 1.0]", "", "`lo` and `hi`, or rows `A` and `b`; got lo"),
    ("hi = [31.3, -15.2, 1.0]", "hi = 31.3", "expected a list of numbers"),
    ("hi = [31.3, -15.2, 1.0]", "hi = ['a', 1, 2]", "expected finite numbers; got a"),
    ("hi = [31.3, -15.2, 1.0]", "hi = [31.3000000000000000001, -15.2, 1.0]", "Round it"),
    ("hi = [27.2335, -15.006]", "hi = [27.2335, -15.006, 0.0]", "expected shape (2,); got (3,)"),
    ("steps = [0, 3]", "steps = [3, 0]", "0 <= first <= last"),
    ("steps = [0, 3]", "steps = 3", "whole numbers 0 <= first <= last"),
    ("steps = [0, 3]", "steps = [true, true]", "whole numbers 0 <= first <= last"),
    ("steps = [0, 3]", "steps = [0, 3]\nedge = 'xyz'", "edge: expected text of a saved scene"),
    ("steps = [0, 3]", "steps = [0, 3]\nedge = ' 0 nan'", "edge: expected text of a saved scene"),
    ("steps = [0, 3]", "steps = [0, 3]\nedge = 1", "edge: expected text of a saved scene, not"),
    ("steps = [0, 3]", "steps = [0, 3]\nat = '1'", "obstacle 0 at: expected finite numbers"),
    ("steps = [0, 3]", "steps = [0, 3]\nsaid = 1", "obstacle 0: span: said: expected text"),
    # what is told of some intervals alone was dropped without them
    ("steps = [0, 3]", "said = 'a gate'", "obstacle 0: expected steps = [first, last] beside said"),
    ("steps = [0, 3]", "at = 12.5", "obstacle 0: expected steps = [first, last] beside at"),
    ("steps = [0, 3]", "dt = 0.25", "obstacle 0: expected steps = [first, last] beside dt"),
    ("steps = [0, 3]", "mover = 'a'", "obstacle 0: expected steps = [first, last] beside mover"),
    ("steps = [0, 3]", "steps = [0, 3]\nmover = 1", "obstacle 0: span: mover: expected text"),
    ("[goal]", "[gaol]", "'gaol'. Is it misspelled?"),
    ("[body]\nradius = 0.1", "", "expected an entry 'body'"),
    ("[goal]", "[goal", "expected a scene in TOML"),
    ("steps = [0, 3]", "steps = [0, 3]\nsaid = 'a\u2028b'", "expected text on one line"),
    ("steps = [0, 3]", f"steps = {'[' * 100_000}", "expected a scene in TOML; got RecursionError"),
    ("radius = 0.1", f"radius = 1{'0' * 400}", "a float64 keeps"),
]


@pytest.mark.parametrize(("old", "new", "message"), WRONG, ids=[w[2][:40] for w in WRONG])
def test_wrong_scenes_are_refused_in_one_sentence(old, new, message):
    assert old in SCENE
    with pytest.raises(InputError) as caught:
        problem_of_text(SCENE.replace(old, new), "scene.toml")
    assert message in str(caught.value) and "scene.toml: " in str(caught.value)


def test_rows_and_files_of_other_kinds(tmp_path):
    rows = {"A": [[1, 0.5], [-1, 0], [0, -1]], "b": [1, 0, 0]}
    problem = problem_of_text(
        f"[goal]\nA = {rows['A']}\nb = {rows['b']}\n[body]\nradius = 0\n", "scene.toml"
    )
    assert (problem.goal.A == np.array(rows["A"])).all() and problem.start is None
    with pytest.raises(InputError, match="expected finite numbers; got NaN"):
        problem_of_text("[goal]\nlo = [nan]\nhi = [1]\n[body]\nradius = 0\n", "scene.toml")
    (tmp_path / "scene.json").write_text(json.dumps({"goal": rows, "body": {"radius": 0}}))
    with pytest.raises(InputError, match=r"scene.json: expected a scene in TOML"):
        load_problem(tmp_path / "scene.json")
    with pytest.raises(InputError, match="no such file"):
        load_problem(tmp_path / "other.toml")


POINTS = ("centre", "nose", "left", "right")
PARTS = """
[goal]
points = ["nose"]
lo = [0.0, 1.0]
hi = [2.0, 3.0]

[goal.q]
lo = [-0.5]
hi = [0.5]

[[body]]
points = ["nose", "left", "right"]

[[body]]
capsule = ["centre", "nose"]
radius = 0.1

[[obstacles]]
lo = [4.0, 4.0]
hi = [5.0, 5.0]
"""


def test_points_are_named_in_body_and_goal():
    problem = problem_of_text(PARTS, "scene.toml", points=POINTS)
    assert problem.body == body_of(
        [hull("nose", "left", "right"), hull("centre", "nose", radius=0.1)]
    )
    assert problem.goal.n == 4 * 2 + 1
    ends = np.zeros((3, 9))
    ends[:, 2:4] = [[1.0, 2.0], [1.0, 2.0], [1.0, 3.5]]
    ends[1, 8] = 0.6
    inside = (ends @ problem.goal.A.T <= problem.goal.b).all(axis=1)
    assert inside.tolist() == [True, False, False]


def test_a_scene_with_points_survives_its_file(tmp_path):
    goals = [
        goal_of_points(POINTS, {"nose": box([0, 1], [2, 3])}, box([-0.5], [0.5])),
        goal_of_points(POINTS, box([0, 1], [2, 3])),
        goal_of_points(POINTS, {"nose": box([0, 1], [2, 3]), "left": box([0, 0], [1, 1])}),
    ]
    square = Polygon(np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]]))
    bodies = [hull("nose"), body_of([hull(0, 1, radius=0.2), Part(("left",), square)])]
    for goal in goals:
        for body in bodies:
            problem = reach_avoid(goal, [box([4, 4], [5, 5])], body)
            path = save_problem(tmp_path / "scene.toml", problem, points=POINTS)
            again = load_problem(path, POINTS)
            np.testing.assert_array_equal(again.goal.A, goal.A)
            np.testing.assert_array_equal(again.goal.b, goal.b)
            assert repr(again.body) == repr(body)
    assert 'points = ["nose"]' in problem_text(
        reach_avoid(goals[0], [box([4, 4], [5, 5])], bodies[0]), points=POINTS
    )


def test_a_saved_scene_is_one_of_the_points_that_its_goal_was_made_for(tmp_path):
    """In rows or by name: without being told, and no robot with others may read it."""
    by_name = goal_of_points(POINTS, {"nose": box([0, 1], [2, 3])})
    in_rows = goal_of_points(POINTS, {"nose": box([0, 1], [2, 3]), "left": box([0, 0], [1, 1])})
    for goal in (by_name, in_rows):
        problem = reach_avoid(goal, [box([4, 4], [5, 5])], hull("nose"))
        path = save_problem(tmp_path / "scene.toml", problem)
        for again in (load_problem(path), load_problem(path, POINTS)):
            assert again.points == POINTS and again.all_spans == problem.all_spans
            np.testing.assert_array_equal(again.goal.A, goal.A)
        for others in (("centre", "left", "nose", "right"), POINTS[:3], (*POINTS[:3], "tail")):
            with pytest.raises(InputError, match=r"points: .*the scene was made for centre, nose"):
                load_problem(path, others)
            with pytest.raises(InputError, match="goal: expected the reference points of this"):
                save_problem(path, problem, points=others)


WRONG_POINTS = [
    ('"nose", "left", "right"]', '"nose", "tail"]', "(centre, nose, left, right); got 'tail'"),
    ('points = ["nose"]', 'points = ["tip"]', "(centre, nose, left, right); got 'tip'"),
    ('points = ["nose", "left", "right"]', "points = []", "expected names of reference points"),
    ('points = ["nose", "left", "right"]', "points = [0.5]", "expected names of reference points"),
    ('points = ["nose", "left", "right"]', "radius = 0.1", "expected its reference points, once"),
    ('capsule = ["centre", "nose"]', 'capsule = "nose"', "2 reference points for a capsule; got 1"),
    ('capsule = ["centre", "nose"]', 'box = ["nose"]', "8 reference points for a box; got 1"),
    ("radius = 0.1", "radius = 0.1\nvertices = [[0, 0]]", "either `radius` or `vertices`"),
    ("radius = 0.1", "vertices = [[0, 0, 0]]", "vertices in the 2-D workspace"),
    ("hi = [2.0, 3.0]", "hi = [2.0, 3.0, 4.0]", "expected shape (2,); got (3,)"),
    ("lo = [4.0, 4.0]", "lo = [4.0, 4.0, 4.0]", "expected shape (3,); got (2,)"),
]


@pytest.mark.parametrize(("old", "new", "message"), WRONG_POINTS, ids=[w[2] for w in WRONG_POINTS])
def test_wrong_points_are_refused_in_one_sentence(old, new, message):
    assert old in PARTS
    with pytest.raises(InputError) as caught:
        problem_of_text(PARTS.replace(old, new), "scene.toml", points=POINTS)
    assert message in str(caught.value) and "scene.toml: " in str(caught.value)


def test_a_goal_that_names_points_needs_to_know_them():
    with pytest.raises(InputError, match=r"scene.toml: goal: .*points=model.points"):
        problem_of_text(PARTS, "scene.toml")


def test_an_obstacle_by_its_vertices():
    """In the same place as by rows, and only an obstacle: a goal may not grow."""
    right, left = "[27.2335, -16.994], [27.2335, -15.006]", "[22.9665, -15.006], [22.9665, -16.994]"
    box_of = f"vertices = [{right}, {left}]"
    by_rows = problem_of_text(SCENE, "scene")
    text = SCENE.replace("lo = [22.9665, -16.994]\nhi = [27.2335, -15.006]", box_of)
    by_vertices = problem_of_text(text, "scene")
    ours, theirs = (
        sorted(zip(p.obstacles[0].A.tolist(), p.obstacles[0].b.tolist(), strict=True))
        for p in (by_vertices, by_rows)
    )
    assert ours == theirs and by_vertices.spans == ((0, 3),)
    for wrong, sentence in (
        (
            text.replace("hi = [31.3, -15.2, 1.0]", "vertices = [[1, 2, 3]]"),
            "goal: expected lo, hi",
        ),
        (text.replace("vertices = [[", "lo = [0, 0]\nvertices = [["), "obstacle 0: expected vert"),
        (SCENE.replace("lo = [22.9665", "low = [22.9665"), "obstacle 0: expected lo, hi, A"),
        (
            SCENE.replace("lo = [22.9665, -16.994]\n", ""),
            "or rows `A` and `b`, or `vertices`; got hi",
        ),
    ):
        with pytest.raises(InputError, match=sentence):
            problem_of_text(wrong, "scene")
