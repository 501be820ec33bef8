"""Replays of a body of several parts, against a body sampled point by point at every record."""

import jax
import numpy as np
import pytest
from turning_bar import Bar, straight_bar

import parc_jax as pj
from parc_jax.app.study.replay import replay
from parc_jax.safe_set.verdict.scene import scene_of

BLOCK = ([-0.45, 0.3], [-0.25, 0.6])
RADIUS = 0.05
KEY = jax.random.PRNGKey(5)


def distance_of(bar: np.ndarray, lo, hi) -> np.ndarray:
    """(...) [m] least distance of the segment bar (..., 2, 2) from a box, by a thousand points."""
    share = np.linspace(0, 1, 1001)[:, None]
    points = bar[..., None, 0, :] * (1 - share) + bar[..., None, 1, :] * share
    off = np.maximum(0, np.maximum(lo - points, points - hi))
    return np.linalg.norm(off, axis=-1).min(axis=-1)


@pytest.mark.night
def test_a_capsule_touches_where_its_samples_do():
    model = straight_bar()
    goal = pj.problem.goal_of_points(
        Bar.points, {"tail": pj.box([-0.3, -0.3], [0.3, 0.3])}, pj.box([-1], [1])
    )
    problem = pj.reach_avoid(goal, [pj.box(*BLOCK)], pj.problem.hull("tail", "nose", radius=RADIUS))
    rng = np.random.default_rng(0)
    k = rng.uniform(Bar.domain.lo, Bar.domain.hi, (60, 2))
    p0 = np.stack([-k[:, 0], np.zeros(60)], axis=1) + rng.uniform([-0.3, -0.8], [0.3, 0.8], (60, 2))
    seen = replay(Bar(), scene_of(problem, model), np.concatenate([p0, k], axis=1), KEY)
    assert seen.path.shape == (60, 9, 4)
    np.testing.assert_array_equal(seen.path[:, 0, :2], p0)
    bar = seen.path.reshape(60, 9, 2, 2)
    np.testing.assert_array_equal(seen.reached, (np.abs(bar[:, -1, 0]) <= 0.3).all(axis=1))
    at_records = distance_of(bar, *map(np.array, BLOCK)).min(axis=1) - RADIUS
    assert (seen.clearance <= at_records + 1e-9).all()  # nothing at a record is missed
    assert seen.touched[at_records <= 0].all() and 5 < seen.touched.sum() < 55
    # finely sampled in time, as the hull of two records is
    share = np.linspace(0, 1, 101)[:, None, None]
    between = bar[:, :-1, None] * (1 - share) + bar[:, 1:, None] * share
    finely = distance_of(between.reshape(60, -1, 2, 2), *map(np.array, BLOCK)).min(axis=1) - RADIUS
    apart = seen.clearance > 0
    np.testing.assert_allclose(seen.clearance[apart], finely[apart], atol=5e-3)
