"""Bad input: one clear sentence that says what was expected and what came. Files are whole or
absent.
"""

import jax
import numpy as np
import pytest
from toy_models import line_model, model_of, told, toy_case, uniform_tube

import parc_jax
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.runs.law import subject
from parc_jax.learning.system import time_grid
from parc_jax.planner import Planner
from parc_jax.problem.body import Disc, Polygon
from parc_jax.problem.problem import Span, reach_avoid
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.outline import require_fit
from parc_jax.safe_set.verdict.scene import scene_of

GOAL, OBSTACLE = box([-0.5, -0.5, -1], [0.5, 0.5, 1]), box([2, 2], [3, 3])


def one_sentence(error) -> str:
    text = str(error.value)
    assert (
        "expected" in text and text.endswith((".", "?")) and "\n" not in text and len(text) < 400
    ), text
    return text


PROBLEMS = {
    "NaN in a box": (lambda: box([0, np.nan], [1, 2]), "1 NaN or infinite"),
    "infinite obstacle": (lambda: box([0, 0], [np.inf, 2]), "1 NaN or infinite"),
    "NaN in rows": (lambda: hpolytope([[1, np.nan]], [1]), "1 NaN or infinite"),
    "rows and offsets": (
        lambda: hpolytope([[1, 0], [0, 1]], [1, 2, 3]),
        r"expected shape \(2,\); got \(3,\)",
    ),
    "zero row": (lambda: hpolytope([[1, 0], [0, 0]], [1, 1]), "row 1 is zero"),
    "text for numbers": (lambda: box(["a", "b"], [1, 2]), "expected numbers"),
    "goal is a list": (
        lambda: reach_avoid([0, 1], [OBSTACLE], 0.1),
        "expected a Box or an HPolytope; got list",
    ),
    "NaN radius": (lambda: reach_avoid(GOAL, [OBSTACLE], np.nan), "1 NaN or infinite"),
    "infinite disc": (
        lambda: reach_avoid(GOAL, [OBSTACLE], Disc(np.inf)),
        "body radius: expected finite",
    ),
    "two radii": (lambda: reach_avoid(GOAL, [OBSTACLE], [0.1, 0.2]), "body radius"),
    "3-D vertices": (
        lambda: reach_avoid(GOAL, [OBSTACLE], Polygon(np.zeros((4, 3)))),
        "vertices in the 2-D workspace",
    ),
    "mixed dimensions": (lambda: reach_avoid(GOAL, [OBSTACLE, box([1], [2])], 0.1), "obstacle 1"),
    "start of another size": (lambda: reach_avoid(GOAL, [OBSTACLE], 0.1, box([0], [1])), "start"),
    "goal too small": (
        lambda: reach_avoid(box([0], [1]), [OBSTACLE], 0.1),
        "goal: expected at least",
    ),
    "span reversed": (lambda: reach_avoid(GOAL, [OBSTACLE], 0.1, spans=[(3, 1)]), "first <= last"),
    "span of fractions": (
        lambda: reach_avoid(GOAL, [OBSTACLE], 0.1, spans=[(0.5, 1.5)]),
        "whole numbers",
    ),
    "spans of two moments": (
        lambda: reach_avoid(
            GOAL, [OBSTACLE] * 2, 0.1, spans=[Span((0, 1), at=0.0), Span((0, 1), at=0.6)]
        ),
        "one moment.* some were made for 0.0 s of the clock, others for 0.6 s",
    ),
    "span of one number": (lambda: reach_avoid(GOAL, [OBSTACLE], 0.1, spans=[3]), "whole numbers"),
    "time runs backwards": (lambda: time_grid(0.1, -1.0), "0 < dt_record <= dt <= t_f"),
    "time does not divide": (lambda: time_grid(0.3, 1.0), "whole number"),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_problems_are_refused_in_one_sentence(name):
    build, words = PROBLEMS[name]
    with pytest.raises(InputError, match=words) as caught:
        build()
    one_sentence(caught)


def test_parts_of_a_model_must_fit_each_other():
    line = line_model(4)
    with pytest.raises(InputError, match="tube as its runs are: 5 intervals, got 4") as caught:
        told(line, time=time_grid(0.2, 1.0))
    one_sentence(caught)
    with pytest.raises(
        InputError, match=r"8 \+ 1 network outputs for this tube .*; got 5"
    ) as caught:
        model_of(line_model(2).net, line.domain, *uniform_tube(4))
    one_sentence(caught)
    with pytest.raises(InputError, match="3 inputs") as caught:
        net = relu_network([np.zeros((9, 2))], [np.zeros(9)])
        model_of(net, box([0] * 3, [1] * 3), *uniform_tube(4))
    one_sentence(caught)
    with pytest.raises(InputError, match="along axis 1 they cover") as caught:
        told(line, domain=box([-1, -1], [1, 2]))
    one_sentence(caught)
    with pytest.raises(InputError, match="NaN"):
        relu_network([np.full((9, 2), np.nan)], [np.zeros(9)])


def test_a_robot_on_a_line_is_refused_before_it_is_learned():
    """No normal of an obstacle was known there: a KeyError, after all runs were made."""
    robot = subject("cart", box([0], [1]), time_grid(0.5, 1.0), 1, 0)
    with pytest.raises(InputError, match="x, y or x, y, z; got 1 axes") as caught:
        require_fit(reach_avoid(box([0], [1]), [box([2], [3])], 0.1), robot)
    one_sentence(caught)
    robot = subject("arm", box([0], [1]), time_grid(0.5, 1.0), 4, 0)
    with pytest.raises(InputError, match=r"got 4 axes\. States beside the place are q\."):
        require_fit(reach_avoid(box([0] * 4, [1] * 4), [], 0.1), robot)


@pytest.mark.parametrize(
    ("goal", "obstacles"),
    [
        (GOAL, [box([-2, -2], [2, 2])]),
        (box([-0.5, -0.5, 5], [0.5, 0.5, 6]), [OBSTACLE]),
        (
            hpolytope(
                [[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0], [0, 0, 1], [0, 0, -1]],
                [0.1] * 4 + [1, 1],
            ),
            [],
        ),
    ],
    ids=["obstacle over the goal", "goal out of reach", "goal empty after shrinking"],
)
@pytest.mark.slow
def test_questions_without_an_answer_say_so_with_a_proof(goal, obstacles):
    model = line_model(4, 0.09)
    answer = Planner(model).solve(reach_avoid(goal, obstacles, 0.1), jax.random.key(0), Settings())
    assert not answer.status.found and not len(answer.corridors)
    assert answer.details().startswith("Proved in exact arithmetic: the model has no safe (p0, k)")
    assert "its tube has no safe plan.\n" in answer.summary()  # of nothing that is uncertain
    assert not answer.contains(np.zeros(2), np.zeros(2))[0]
    with pytest.raises(InputError, match="expected an answer with corridors; this one has none"):
        answer.sample(jax.random.key(0), 3)
    with pytest.raises(InputError, match="there are none"):
        answer.polytopes(jax.random.key(0)).centre()


@pytest.fixture(scope="module")
def answer():
    model, problem = toy_case(4)
    return Planner(model).solve(
        problem, jax.random.key(0), Settings(target=0.3, samples=3, budget_s=300)
    )


def test_models_survive_a_file_and_damage_is_refused(tmp_path):
    model, problem = toy_case(4)
    path = model.save(tmp_path / "deep" / "model.npz")
    again = parc_jax.load(path, system="toy")
    assert (
        again.net.hash == model.net.hash
        and again.tube.hash == model.tube.hash
        and again.time == model.time
    )
    assert again.claim.details() == model.claim.details()
    np.testing.assert_array_equal(
        scene_of(problem, again).obstacles.vertices, scene_of(problem, model).obstacles.vertices
    )
    assert [p.name for p in path.parent.iterdir()] == ["model.npz"]

    with pytest.raises(InputError, match="model of 'boat'; it was learned from 'toy'"):
        parc_jax.load(path, system="boat")
    with pytest.raises(InputError, match="no such file"):
        parc_jax.load(tmp_path / "nothing.npz")
    whole = path.read_bytes()
    for size in (0, 3, 100, len(whole) // 2, len(whole) - 1):
        short = tmp_path / "short.npz"
        short.write_bytes(whole[:size])
        with pytest.raises(InputError) as caught:
            parc_jax.load(short)
        assert "truncated" in one_sentence(caught) or "complete" in str(caught.value)
    (tmp_path / "text.npz").write_text("not a model")
    with pytest.raises(InputError):
        parc_jax.load(tmp_path / "text.npz")


@pytest.mark.parametrize("lost", ["meta", "W1", "b0", "edges1", "interval", "final", "edges0"])
def test_models_with_a_part_missing_are_refused(tmp_path, lost):
    model, _ = toy_case(4)
    path = model.save(tmp_path / "model.npz")
    with np.load(path) as archive:
        parts = {name: archive[name] for name in archive.files if name != lost}
    np.savez(path, **parts)
    with pytest.raises(InputError) as caught:
        parc_jax.load(path)
    one_sentence(caught)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("interval", np.zeros((2, 4, 3))),
        ("interval", -np.ones((2, 4, 2))),
        ("final", np.zeros((1, 3))),
        ("W0", np.full((6, 2), np.nan)),
        ("edges1", np.array([-2.0, -1.0, 1.0])),
        ("edges0", np.array([1.0, -1.0])),
    ],
)
def test_models_with_a_wrong_part_are_refused(tmp_path, name, value):
    model, _ = toy_case(4)
    path = model.save(tmp_path / "model.npz")
    with np.load(path) as archive:
        parts = {n: archive[n] for n in archive.files}
    np.savez(path, **(parts | {name: value}))
    with pytest.raises(InputError):
        parc_jax.load(path)


def test_a_failed_save_leaves_the_old_file(tmp_path, monkeypatch, answer):
    import os

    path = answer.save(tmp_path / "answer.json")
    before = path.read_bytes()

    def full_disc(*_):
        raise OSError("no space left on device")

    monkeypatch.setattr(os, "replace", full_disc)
    with pytest.raises(OSError, match="no space"):
        answer.save(path)
    assert path.read_bytes() == before


TEXT, NONE, HALF = "3", None, 1.5
ODD = {
    "settings: target": [lambda x, o: Settings(target=o), TEXT, NONE, [1]],
    "settings: work": [lambda x, o: Settings(work=o), TEXT, NONE],
    "sample": [lambda x, o: x.sample(KEY, o), -1, HALF, True, NONE, np.nan, TEXT],
    "starts: most": [lambda x, o: x.starts(KEY, K, o), -1, HALF, TEXT],
    "polytopes": [lambda x, o: x.polytopes(KEY, o), -1, HALF, NONE, np.nan, TEXT],
    "key": [lambda x, o: x.choose(key=o), 3, "a"],
    "first": [lambda x, o: asked(x).first(KEY, o), 0, 99, HALF, True, NONE, TEXT],
    "solve_batch: draws": [lambda x, o: batch(x, draws=o), 0, HALF, True, NONE, np.nan, TEXT],
    "solve_batch whole": [lambda x, o: batch(x, whole=o), 3, NONE, ["a"], [5], [1.0]],
    "solve_batch warm": [lambda x, o: batch(x, warm=o), "a", 3],
    "problem 0 of the batch": [lambda x, o: Planner(x.model).solve_batch(o, KEY), [3], "a"],
    "model": [lambda x, o: parc_jax.drive.Loop(o, 0.1, leave=0.5), 3, NONE],
}
KEY, K = jax.random.PRNGKey(0), np.zeros((1, 2))


def asked(x):
    """The query of an answer, prepared."""
    return Planner(x.model).prepare(x.scene.nominal.query.problem)


def batch(x, **options):
    return Planner(x.model).solve_batch([x.scene.nominal.query.problem] * 2, KEY, **options)


@pytest.mark.parametrize("name", ODD)
def test_odd_arguments_are_one_sentence(name, answer):
    call, *odd = ODD[name]
    for value in odd:
        with pytest.raises(InputError, match=rf"^{name}: expected") as error:
            call(answer, value)
        one_sentence(error)


def test_what_is_no_place_for_a_file_is_one_sentence(tmp_path, answer):
    (tmp_path / "file").touch()
    for place in (None, 3, tmp_path, "", tmp_path / ("a" * 300), tmp_path / "file" / "a.json"):
        with pytest.raises(InputError, match="expected a place for a file") as error:
            answer.save(place)
        assert len(str(error.value)) < 900
        with pytest.raises(InputError):
            parc_jax.load(place)
    for long in ("a" * 250, "é" * 125):  # a name as long as files may have
        assert answer.save(tmp_path / long).read_bytes()
