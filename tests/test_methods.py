"""A search that cannot find anything is not made, or ends by its seconds."""

import itertools

import jax
import numpy as np
import pytest
from toy_models import line_model, model_of, random_network, uniform_tube

import parc_jax as pj
from parc_jax import checker
from parc_jax import method as methods
from parc_jax.common.status import Ended
from parc_jax.proof.absence.prove_no_plan import UNDECIDED, NoPlan

KEY = jax.random.key(0)
SETTINGS = pj.Settings(budget_s=300)


@pytest.fixture
def climbs(monkeypatch):
    """The scenes for which plans climbed."""
    made = []

    def counted(scene, rng, largest, limit):
        made.append(scene)
        return climb(scene, rng, largest, limit)

    climb = methods.where_safe
    monkeypatch.setattr(methods, "where_safe", counted)
    return made


def blocked(width: float):
    """A goal so wide [m] along the first axis, and a wall everywhere on the way to it."""
    goal = pj.box([0.5 - width / 2, -1.0, -10.0], [0.5 + width / 2, 1.0, 10.0])
    return pj.reach_avoid(goal, [pj.box([-90.0, -90.0], [90.0, 90.0])], 0.1, spans=[(1, 2)])


@pytest.mark.parametrize(("width", "made"), [(0.08, 0), (0.12, 1)])
def test_no_plan_climbs_to_a_goal_that_is_narrower_than_the_tube(climbs, width, made):
    planner = pj.Planner(line_model(e=0.05))
    answer = planner.solve(blocked(width), KEY, SETTINGS, at=(0.0, 0.0))
    assert len(climbs) == made and not answer.status.found


@pytest.mark.slow
@pytest.mark.parametrize(("width", "made"), [(0.08, 0), (0.12, 2)])
def test_nor_once_more_where_nothing_can_be_proved(climbs, width, made):
    n_k = checker.MAX_PARAMETERS + 1
    net = random_network(np.random.default_rng(0), 4, n_k=n_k)
    model = model_of(net, pj.box(-np.ones(n_k), np.ones(n_k)), *uniform_tube(4, 0.05))
    answer = pj.Planner(model).solve(blocked(width), KEY, SETTINGS)
    assert len(climbs) == made and not answer.status.found and answer.absence.kind == "undecided"
    assert ("narrower than the tube at the end" in answer.details()) is (made == 0)


def test_seconds_count_though_no_draw_was_safe(climbs, monkeypatch):
    clock = itertools.count(0.0, 1e4)
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))
    nothing = NoPlan(UNDECIDED, 0, 1, 1)
    monkeypatch.setattr(methods, "prove_no_plan", lambda scene, **asked: nothing)
    answer = pj.Planner(line_model(e=0.05)).solve(blocked(0.12), KEY, SETTINGS)
    assert len(climbs) == 1 and not answer.status.found and answer.cover.ended is Ended.SECONDS
