"""A drone with a box: rigid, upright at rest, tilted by what it accelerates, pushed by the wind."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims
from sims.drone.system import CORNERS, POINTS, SIZE

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


@pytest.mark.slow
def test_a_moved_start_moves_all_points(runs):
    import parc_jax as pj

    gap = pj.learning.translation_gap(sims.load("drone"), KEYS[0], np.array([[3.0, -2.0, 50.0]]))
    assert gap.p.max() < 1e-12
