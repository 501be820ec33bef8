"""The black box and the scene of the study, and how well the shipped policy steers it."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims.asv as asv
from parc_jax.learning.system import BlackBoxSystem
from parc_jax.problem.body import Disc, Polygon
from sims.asv.evaluate import evaluate

# rows 0 and 1: same key, same k; row 2: another key, same k
KEYS = drawn_keys(4, 5)[[0, 0, 1, 2, 3, 4]]
KS = np.random.default_rng(2).uniform([4, -1, -np.pi / 6], [7, 1, np.pi / 6], (6, 3))[
    [0, 0, 0, 1, 2, 3]
]


@functools.cache
def rollouts(plant="ode", **options):
    return jax.tree.map(
        np.asarray, jax.jit(jax.vmap(asv.system(plant, **options).rollout))(KEYS, jnp.asarray(KS))
    )


@pytest.mark.slow
def test_black_box_of_the_study():
    system = asv.system(plant="ode")
    assert isinstance(system, BlackBoxSystem)
    assert (system.name, system.n_p, system.n_q) == ("asv", 2, 0)
    assert (system.time.n_record, system.time.n_steps, system.time.stride) == (500, 100, 5)
    np.testing.assert_allclose(system.domain.lo, [4, -1, -np.pi / 6])
    np.testing.assert_allclose(system.domain.hi, [7, 1, np.pi / 6])
    p, q = rollouts()
    assert p.shape == (6, 501, 2)
    assert q.shape == (6, 0)
    assert p.dtype == np.float64
    assert not p[:, 0].any()
    assert np.abs(p[:, -1] - KS[:, :2]).max() < 1.0  # every one is at its own goal
    assert np.abs(np.diff(p, axis=1)).max() < 0.02 * 2.0  # slower than 2 m/s: no sample is missing


@pytest.mark.smoke
@pytest.mark.night
def test_default_plant_is_mjx_and_equals_the_twin():
    assert asv.system().plant == "mjx"
    np.testing.assert_allclose(
        rollouts("mjx").p, rollouts("ode").p, atol=1e-8
    )  # rounding, through 50 decisions


def test_scene():
    scene = asv.problem()
    lo, hi = np.array([4, -1.5]), np.array([7, 1.5])
    inside = [scene.goal.A @ p <= scene.goal.b + 1e-12 for p in (lo, hi)]
    assert np.all(inside)
    assert not np.all(scene.goal.A @ np.array([3.99, 0]) <= scene.goal.b)
    assert len(scene.obstacles) == 2
    for sign, obstacle in zip((1, -1), scene.obstacles, strict=True):
        hit = np.array([2.5, sign * 1.31])
        assert np.all(obstacle.A @ hit <= obstacle.b)
        assert not np.all(obstacle.A @ (hit * np.array([1, -1])) <= obstacle.b)
    assert isinstance(scene.body, Disc)
    assert abs(scene.body.radius - 0.802) < 2e-4
    assert scene.body.radius >= np.hypot(0.65, 0.47)  # the circle holds the hull's corners
    vertices = asv.problem(body="decagon").body.vertices
    mid = 0.5 * (vertices + np.roll(vertices, 1, axis=0))
    np.testing.assert_allclose(np.hypot(*mid.T), scene.body.radius)
    assert isinstance(asv.problem(body="decagon").body, Polygon)


@pytest.mark.night
def test_shipped_policy_arrives_and_hovers():
    policy, key = asv.load_policy(), jax.random.key(5)
    nominal = evaluate(policy, "none", key, n=400, seconds=20.0)
    assert nominal["arrived_share"] == 1.0
    assert nominal["arrival_median_s"] <= 7.0
    study = evaluate(policy, "study", key, n=400, seconds=20.0)
    assert study["arrived_share"] == 1.0
    assert study["spread_end_m"] <= 0.1
