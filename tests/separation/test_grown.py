"""Obstacles grown by body and tube: the corner table has the support of the sum, for every e at
once.
"""

import numpy as np
import pytest
from dense_oracle import polygon_corners
from toy_models import random_polygon

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.network.predict import Layout
from parc_jax.problem.body import Polygon
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.separation.pairs import BUCKETS, bucket, obstacles_of

GOAL = box([0, 0, 0], [1, 1, 1])


def grown_obstacles(problem, n_steps):
    """Of one point in the plane, in closed form."""
    return obstacles_of(problem, ("p",), Layout(n_steps, 2), closed=True)


def bodies(rng):
    return [
        0.0,
        0.7,
        Polygon([[0.3, 0.1]]),
        Polygon(rng.normal(size=(5, 2))),
        Polygon([[0, 0], [1, 0], [2, 0]]),
    ]


def support_gap(problem, table, rng, j=0):
    """Largest difference between the table's support and that of obstacle + (-body) + box(e) over
    random w, e.
    """
    base = polygon_corners(problem.obstacles[j].A, problem.obstacles[j].b)
    minus = -getattr(problem.body, "vertices", np.zeros((1, 2)))
    angle = np.concatenate([rng.uniform(0, 2 * np.pi, 60), np.arange(8) * np.pi / 4])
    w = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    worst = 0.0
    for e in (
        np.zeros(2),
        np.array([0.4, 0.0]),
        np.array([0.0, 0.2]),
        rng.uniform(0, 2, 2),
        rng.uniform(0, 1e-6, 2),
    ):
        expected = (base @ w.T).max(axis=0) + (minus @ w.T).max(axis=0) + np.abs(w) @ e
        got = ((table.vertices[j] + table.signs[j] * e) @ w.T).max(axis=0)
        worst = max(worst, np.abs(got - expected).max())
    return worst


@pytest.mark.parametrize("seed", range(12))
def test_support_of_the_sum_for_every_error_box(seed):
    rng = np.random.default_rng(seed)
    obstacles = [
        random_polygon(rng, rng.normal(size=2), 1.0, rows=int(rng.integers(0, 7))),
        box([1, 1], [1, 3]),
    ]
    for body in bodies(rng):
        problem = reach_avoid(GOAL, obstacles, body)
        table = grown_obstacles(problem, 3)
        assert table.radius[0] == (body if isinstance(body, float) else 0.0)
        assert max(support_gap(problem, table, rng, j) for j in (0, 1)) < 1e-11


@pytest.mark.parametrize("seed", range(6))
def test_corners_run_counter_clockwise_for_every_error_box(seed):
    rng = np.random.default_rng(seed)
    table = grown_obstacles(
        reach_avoid(GOAL, [random_polygon(rng, [0, 0], 1.0)], bodies(rng)[3]), 3
    )
    for e in (np.zeros(2), rng.uniform(0, 1, 2), np.array([0.3, 0.0])):
        c = table.vertices[0] + table.signs[0] * e
        a, b = np.roll(c, -1, axis=0) - c, np.roll(c, -2, axis=0) - np.roll(c, -1, axis=0)
        assert (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > -1e-12).all()


def test_padding_is_never_active_and_repeats_corners():
    problem = reach_avoid(
        GOAL, [box([0, 0], [1, 1])] * 5, 0.1, spans=[None, (0, 0), (2, 3), (3, 3), None]
    )
    table = grown_obstacles(problem, 4)
    assert table.active.shape == (6, 4) and table.vertices.shape[1] in BUCKETS
    expected = [[1, 1, 1, 1], [1, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1], [1, 1, 1, 1], [0, 0, 0, 0]]
    assert table.active.astype(int).tolist() == expected


def test_a_scene_without_obstacles_is_a_scene():
    assert not grown_obstacles(reach_avoid(GOAL, [], 0.1), 4).active.any()


def test_steps_beyond_the_horizon_are_refused():
    problem = reach_avoid(GOAL, [box([0, 0], [1, 1])], 0.1, spans=[(0, 4)])
    with pytest.raises(InputError, match="obstacle 0: expected last < 4"):
        grown_obstacles(problem, 4)


def test_buckets_hold_what_they_are_asked_for():
    assert all(bucket(n) >= n for n in range(BUCKETS[-1] + 1)) and bucket(0) == 1
    sizes = {bucket(n) for n in range(BUCKETS[-1] + 1, 5000)}
    assert sizes == {256, 512, 1024, 2048, 4096, 8192}
