"""Queries that differ only in values share their compiled kernels: the second one compiles
nothing.
"""

import jax
import numpy as np
import pytest
from compilations import compiled_by
from toy_models import random_model, rectangle_problem, toy_case

from parc_jax.planner import Planner
from parc_jax.settings import Settings
from parc_jax.verdict import scene as scenes


def solve(number: int, **changes):
    model, problem = toy_case(number)
    answer = Planner(model).solve(
        problem.replace(**changes),
        jax.random.key(number),
        Settings(target=0.3, n_samples=5, budget_s=300),
    )
    answer.contains(answer.samples[:, :2], answer.samples[:, 2:])
    return answer


@pytest.fixture(scope="module")
def warm():
    for number in (2, 4, 8):
        assert solve(number).found


def test_other_obstacles_goals_bodies_networks_and_tubes_compile_nothing(warm):
    # Numbers 9 and 50 have their own networks, tubes, goals and turned obstacles; radius and spans
    # are values too.
    assert compiled_by(lambda: solve(9)) == 0
    _, problem = toy_case(4)
    assert compiled_by(lambda: solve(4, body=problem.body.replace(radius=0.02))) == 0
    assert compiled_by(lambda: solve(4, spans=((0, 1), None))) == 0
    assert compiled_by(lambda: solve(4, goal=problem.goal.replace(b=problem.goal.b * 0.9))) == 0


def test_a_new_size_compiles_and_is_counted(warm):
    rng = np.random.default_rng(0)
    model = random_model(rng, 5, (6, 5), (1, 2), 0.02)
    problem = rectangle_problem(rng, model)
    from parc_jax.verdict.pointwise import verdicts

    scene = scenes.scene_of(problem, model)
    assert compiled_by(lambda: verdicts(model, scene, np.zeros((1, 2)), np.zeros((1, 2)))) > 0


def test_host_only_parts_in_the_kernels_arguments_would_be_noticed(warm, monkeypatch):
    monkeypatch.setattr(scenes.Scene, "arrays", property(lambda self: self))
    model, problem = toy_case(51)
    from parc_jax.verdict.pointwise import verdicts

    scene = scenes.scene_of(problem, model)
    assert compiled_by(lambda: verdicts(model, scene, np.zeros((1, 2)), np.zeros((1, 2)))) > 0
