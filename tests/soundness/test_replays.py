"""Certified plans in the black box: a run inside the tube must succeed, a run outside it is
counted, not hidden.
"""

import jax
import numpy as np
import pytest
from dense_oracle import distance, polygon_corners
from synthetic_plants import between_knots, disturbed, exact, plant, straight_network
from toy_models import model_of, told

import parc_jax
from parc_jax.app.study import replay as replaying
from parc_jax.app.study.replay import replay
from parc_jax.common.errors import SoundnessError
from parc_jax.common.sets.box import box
from parc_jax.common.status import Status
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.soundness

T = 4


def straight_model(system, e, bins=1):
    """The straight-line network, which predicts the undisturbed plant exactly, with a tube of half
    width e.
    """
    edges = [np.linspace(0, 1, bins + 1), [0.0, 1.0]]
    interval, final = np.full((bins, T, 2), float(e)), np.full((bins, 3), float(e))
    line = model_of(straight_network(T), system.domain, interval, final, edges)
    return told(line, time=system.time, system=system.name)


def problem_with(wall, radius=0.05):
    return reach_avoid(box([0.2, 0.2, -1], [1.2, 1.2, 2]), [wall], radius)


WALL = box([0.2, -1.0], [0.7, 0.05])


def plans(rng, n):
    """Starts near the origin, k all over K: many pass close to the wall."""
    return np.concatenate([rng.uniform(0, 0.3, (n, 2)), rng.uniform(0, 1, (n, 2))], axis=1)


def test_what_a_replay_reports_is_what_the_runs_did(rng):
    system = plant(disturbed, T)
    model, problem = straight_model(system, 5.0), problem_with(WALL)
    x = plans(rng, 300)
    wide = replay(system, scene_of(problem, model), x, jax.random.key(0))
    assert wide.inside.all() and wide.failed.any()  # in a tube of five metres nothing is proved
    tight = straight_model(system, 1e-6)
    out = replay(system, scene_of(problem, tight), x, jax.random.key(0))
    assert not out.inside.any()
    corners = polygon_corners(problem.obstacles[0].A, problem.obstacles[0].b)
    s = np.linspace(0, 1, 21)[:, None]
    fine = (out.path[:, :-1, None] * (1 - s) + out.path[:, 1:, None] * s).reshape(300, -1, 2)
    gap = distance(corners[None, None], fine).min(axis=1) - 0.05
    clear = gap > 1e-3
    assert 20 < clear.sum() < 280
    np.testing.assert_allclose(out.clearance[clear], gap[clear], atol=2e-4)
    np.testing.assert_array_equal(out.touched[np.abs(gap) > 1e-3], gap[np.abs(gap) > 1e-3] < 0)
    end = np.concatenate([out.path[:, -1], out.q], axis=1)
    np.testing.assert_array_equal(out.reached, problem.goal.contains(end))
    np.testing.assert_array_equal(out.failed, ~out.reached | out.touched)
    np.testing.assert_allclose(out.path[:, 0], x[:, :2])


def test_certified_plans_never_fail_inside_the_tube(rng):
    system = plant(disturbed, T)
    model, problem = straight_model(system, 0.15), problem_with(WALL)
    scene, x = scene_of(problem, model), plans(rng, 4000)
    x = x[verdicts(scene, x[:, :2], x[:, 2:]).safe]
    out = replay(system, scene, x, jax.random.key(2))
    assert len(x) > 200
    assert 0.5 < out.inside.mean() < 0.95  # N(0, 0.1) against 0.15, two axes
    assert not out.failed[out.inside].any() and out.failed[~out.inside].any()


def test_a_proof_that_contradicts_the_plant_is_reported(monkeypatch):
    """And a plan that nobody proved contradicts nothing."""
    system = plant(exact, T)
    model, problem = straight_model(system, 0.01), problem_with(WALL)
    scene = scene_of(problem, model)
    x = np.array([[0.0, 0.0, 1.0, 0.3]])  # straight through the wall
    missed = np.array([[0.0, 0.8, 0.0, 0.9]])  # clear of the wall, past the goal
    for plan in (x, missed):
        out = replay(system, scene, plan, jax.random.key(0))
        assert out.inside.all() and out.failed.all()
    blind = scene_of(problem.replace(obstacles=()), model)
    monkeypatch.setattr(replaying, "verdicts", lambda scene, p0, k: verdicts(blind, p0, k))
    assert replay(system, scene, missed, jax.random.key(0)).failed.all()
    with pytest.raises(
        SoundnessError, match="1 of 1 plans failed although their run stayed inside"
    ):
        replay(system, scene, x, jax.random.key(0))
    for given, said in (
        ((system, x, scene), "replay: scene, after the system: expected Scene"),
        ((scene, system, x), "replay: scene, after the system: expected Scene"),
        ((system, scene, jax.random.PRNGKey(0)), "replay: plans, after the scene: expected shape"),
        ((system, scene, jax.random.key(0)), "replay: plans, after the scene: expected numbers"),
    ):
        with pytest.raises(parc_jax.InputError, match=said):
            replay(*given)


def test_a_bend_between_knots_is_replayed():
    """The run is at its knots where the model says, and hits a pole between the first two."""
    system = plant(between_knots(T), T, stride=10)
    pole = box([0.42, 0.36], [0.43, 0.37])  # (1, 0.5) / 8 + 0.3
    model = straight_model(system, 1e-3)
    scene, x = scene_of(problem_with(pole, 0.0), model), np.array([[0.0, 0.0, 1.0, 0.5]])
    assert verdicts(scene, x[:, :2], x[:, 2:]).clearance > 0
    out = replay(system, scene, x, jax.random.key(0))
    assert out.touched.all() and out.reached.all() and not out.inside.any()


def test_obstacles_are_there_during_their_steps_only(rng):
    system = plant(exact, T, stride=10)
    thin = box([0.12, -1.0], [0.121, 1.0])
    model = straight_model(system, 0.001)
    x = np.array([[0.0, 0.3, 1.0, 0.5]])
    for steps, touched in (((0, 0), True), ((1, 3), False)):
        problem = problem_with(thin, 0.0).replace(spans=(steps,))
        out = replay(system, scene_of(problem, model), x, jax.random.key(0))
        assert out.inside.all() and out.touched[0] == touched


@pytest.fixture(scope="module")
def parking():
    """The committed model of the parking car, its scene and an answer."""
    from pathlib import Path

    from sims.drift_parking import scenario

    model = parc_jax.load(
        Path(__file__).parents[1] / "data" / "drift_4x8.npz", system="drift_parking"
    )
    answer = Planner(model).solve(
        scenario.problem(),
        jax.random.key(0),
        Settings(target=0.05, samples=100, budget_s=300),
    )
    return model, answer


@pytest.mark.night
def test_two_thousand_drifts_from_the_safe_set_touch_nothing(parking):
    import sims

    _, answer = parking
    assert answer.status is Status.PROVED and answer.cover.refused == 0
    x = answer.sample(jax.random.key(1), 2000)
    system = sims.load("drift_parking", plant="ode")
    out = replay(system, answer.scene, x, jax.random.key(2))  # raises on a failure inside the tube
    assert not out.failed[out.inside].any()
    assert (
        ~out.inside
    ).sum() <= 2000 * 0.01  # the claim: 0.001 over all of K, more over the certified part
