"""Queries that differ only in values share their compiled kernels: the second one compiles
nothing.
"""

import jax
import numpy as np
import pytest
from compilations import compiled_by
from toy_models import random_model, rectangle_problem, toy_case

from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.learning.bound.bins import each_bin
from parc_jax.learning.bound.tube import tube
from parc_jax.planner import Planner
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict import scene as scenes


def solve(number: int, **changes):
    model, problem = toy_case(number)
    answer = Planner(model).solve(
        problem.replace(**changes),
        jax.random.key(number),
        Settings(target=0.3, samples=5, budget_s=300),
    )
    answer.contains(answer.samples[:, :2], answer.samples[:, 2:])
    return answer


@pytest.fixture(scope="module")
def warm():
    for number in (2, 4, 8):
        assert solve(number).status.found


def test_other_obstacles_goals_bodies_networks_and_tubes_compile_nothing(warm):
    # Numbers 9 and 50 have their own networks, tubes, goals and turned obstacles; radius and spans
    # are values too.
    assert compiled_by(lambda: solve(9)) == 0
    _, problem = toy_case(4)
    assert compiled_by(lambda: solve(4, body=problem.body.replace(radius=0.02))) == 0
    assert compiled_by(lambda: solve(4, spans=((0, 1), None))) == 0
    assert compiled_by(lambda: solve(4, goal=problem.goal.replace(b=problem.goal.b * 0.9))) == 0


def test_corridors_under_a_tube_of_one_bin_compile_nothing():
    answer = solve(4)
    many = answer.model.tube
    edges = [edge[[0, -1]] for edge in many.edges]
    one = tube(edges, many.interval.max(axis=0)[None], many.final.max(axis=0)[None])
    points = answer.cover.points

    def asked(of):
        corridors = Corridors(of, answer.corridors)
        bins = each_bin(of.edges, points.k)[1]
        corridors.coarse(points.path, bins)
        return corridors.kept_pairs(points.path, bins, *np.zeros((2, 1), int))

    assert many.n_bins > 1 and asked(many).all()
    assert compiled_by(lambda: asked(one)) == 0


@pytest.mark.slow
def test_a_new_size_compiles_and_is_counted(warm):
    rng = np.random.default_rng(0)
    model = random_model(rng, 5, (6, 5), (1, 2), 0.02)
    problem = rectangle_problem(rng, model)
    from parc_jax.safe_set.verdict.pointwise import verdicts

    scene = scenes.scene_of(problem, model)
    assert compiled_by(lambda: verdicts(scene, np.zeros((1, 2)), np.zeros((1, 2)))) > 0


KEY = jax.random.key(0)
COVER = Settings(target=0.1, samples=5, budget_s=300, proof=False)
SEVERAL = Settings.fast().replace(samples=100)


def calls_about(n_obstacles: int, more_rows: int = 0) -> dict:
    """Calls about one scene, by name, in the order in which they must be made."""
    model, problem = toy_case(4)
    one = problem.obstacles[0]
    beside = [
        one.replace(b=one.b + one.A @ [0.02 * (i % 5), 0.0]) for i in range(1, n_obstacles - 1)
    ]
    obstacles = (*problem.obstacles, *beside)
    goal = problem.goal
    A, b = (np.concatenate([rows, rows[:more_rows]]) for rows in (goal.A, goal.b))
    asked = problem.replace(obstacles=obstacles, spans=None, goal=hpolytope(A, b))
    planner = Planner(model)
    prepared = planner.prepare(asked)
    assert int(prepared.scene.count) == n_obstacles  # none of them is out of reach
    answers = []

    def contains():
        answers[0].contains(answers[0].samples[:, :2], answers[0].samples[:, 2:])

    return {
        "first": lambda: prepared.first(KEY),
        "first of solve": lambda: planner.solve(asked, KEY, Settings.fast()),
        "many samples": lambda: planner.solve(asked, KEY, SEVERAL),
        "corridors": lambda: answers.append(planner.solve(asked, KEY, COVER)),
        "polytopes": lambda: answers[0].polytopes(KEY, 200),
        "contains": contains,
        "sample": lambda: answers[0].sample(KEY, 20),
        "best": lambda: answers[0].best("clearance", KEY),
    }


@pytest.fixture(scope="module")
def warm_calls():
    for n_obstacles in (2, 4):
        for call in calls_about(n_obstacles).values():
            call()


@pytest.mark.slow
@pytest.mark.parametrize(("n_obstacles", "more_rows"), [(3, 0), (5, 0), (2, 1)])
def test_another_number_of_obstacles_or_rows_compiles_nothing(warm_calls, n_obstacles, more_rows):
    calls = calls_about(n_obstacles, more_rows)
    assert {name: compiled_by(call) for name, call in calls.items()} == dict.fromkeys(calls, 0)


@pytest.mark.slow
@pytest.mark.parametrize("n_obstacles", [9, 17, 33, 65, 128])
def test_first_plans_among_many_obstacles_compile_nothing(warm_calls, n_obstacles):
    calls = calls_about(n_obstacles)
    for name in ("first", "first of solve"):
        assert compiled_by(calls[name]) == 0, name
