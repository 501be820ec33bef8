"""A drone with a box: rigid, upright at rest, tilted by what it accelerates, pushed by the wind."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims
from sims.drone.system import CORNERS, GRAVITY, POINTS, SIZE

KEYS = drawn_keys(2, 4)


@pytest.fixture(scope="module")
def runs():
    drone = sims.load("drone")
    ks = jnp.asarray(np.random.default_rng(0).uniform(drone.domain.lo, drone.domain.hi, (4, 3)))
    p, q = jax.jit(jax.vmap(drone.rollout))(KEYS, ks)
    assert p.shape == (4, 101, 9, 3) and q.shape == (4, 0)
    return np.asarray(ks), np.asarray(p)


def test_starts_upright_at_the_origin(runs):
    _, p = runs
    assert (p[:, 0, 0] == 0).all()
    signs = {"front": 1, "rear": -1, "left": 1, "right": -1, "top": 1, "bottom": -1}
    arms = [[signs[word] for word in name.split()] for name in CORNERS]
    np.testing.assert_allclose(p[:, 0, 1:], np.array([arms] * 4) * np.array(SIZE) / 2, atol=1e-15)


def test_the_box_is_rigid(runs):
    _, p = runs
    for a, b in itertools.combinations(range(len(POINTS)), 2):
        apart = np.linalg.norm(p[:, :, a] - p[:, :, b], axis=-1)
        np.testing.assert_allclose(apart, apart[:, :1] * np.ones((1, 101)), rtol=1e-9)
    np.testing.assert_allclose(p[:, :, 1:].mean(axis=2), p[:, :, 0], atol=1e-12)


def test_it_tilts_forward_to_speed_up_and_back_to_slow_down(runs):
    _, p = runs
    top, bottom = CORNERS.index("front left top") + 1, CORNERS.index("front left bottom") + 1
    up = (p[:, :, top] - p[:, :, bottom]) / SIZE[2]
    assert (up[:, 30, 0] > 0.02).all() and (up[:, 75, 0] < -0.02).all()
    assert (up[:, :, 2] > np.cos(np.arctan(10.0 / GRAVITY))).all()


def test_it_arrives_but_for_the_wind(runs):
    ks, p = runs
    off = np.abs(p[:, -1, 0] - ks)
    assert 1e-3 < off.max() < 0.15
    calm = sims.load("drone", wind=0.0)
    still = np.asarray(jax.jit(jax.vmap(calm.rollout))(KEYS, jnp.asarray(ks)).p)
    assert np.abs(still[:, -1, 0] - ks).max() < np.abs(p[:, -1, 0] - ks).max()


@pytest.mark.slow
def test_a_moved_start_moves_all_points(runs):
    import parc_jax as pj

    gap = pj.translation_gap(sims.load("drone"), KEYS[0], np.array([[3.0, -2.0, 50.0]]))
    assert gap.p.max() < 1e-12


def test_the_scene_is_in_space():
    problem = sims.drone.problem()
    assert problem.goal.n == 27 and [o.n for o in problem.obstacles] == [3] * 4
    window = np.array([[-1.5, 0.0, 0.0], [-1.5, 0.7, 0.0], [-1.5, 0.0, -0.5], [-1.5, -0.5, 0.39]])
    inside = np.array([o.contains(window) for o in problem.obstacles]).any(axis=0)
    assert inside.tolist() == [False, True, True, False]
