"""Pairs of obstacles and parts: who is kept apart from what, in which intervals."""

import jax.numpy as jnp
import numpy as np
import pytest

from parc_jax.arrays import x64
from parc_jax.body import Part, Polygon, body_of, hull
from parc_jax.claim.error_set import ErrorBox, at
from parc_jax.errors import InputError
from parc_jax.network.predict import Layout
from parc_jax.obstacles.pairs import pairs_of
from parc_jax.problem import goal_of_points, reach_avoid
from parc_jax.sets.box import box

POINTS = ("nose", "tail", "hitch")
LAYOUT = Layout(5, 2, 3)
FIRST, SECOND = box([2.0, -1.0], [3.0, 1.0]), box([-4.0, 2.0], [-3.0, 3.0])
CORNERS = Polygon(np.array([[0.1, 0.0], [0.0, 0.3], [-0.1, -0.1]]))
BODY = body_of([hull("nose", "tail", radius=0.25), Part(("hitch",), CORNERS)])
GOAL = goal_of_points(POINTS, box([-9.0, -9.0], [9.0, 9.0]))


@pytest.fixture
def problem():
    return reach_avoid(GOAL, [FIRST, SECOND], BODY, spans=[None, (1, 3)])


@pytest.fixture
def pairs(problem):
    return pairs_of(problem, POINTS, LAYOUT)


def test_pairs_go_obstacle_by_obstacle(pairs):
    assert pairs.points.tolist() == [[0, 1], [2, 2], [0, 1], [2, 2]]
    assert pairs.radius.tolist() == [0.25, 0.0, 0.25, 0.0]
    assert pairs.active.tolist() == [[True] * 5] * 2 + [[False, True, True, True, False]] * 2
    assert {tuple(v) for v in pairs.vertices[0]} == {(2, -1), (3, -1), (3, 1), (2, 1)}
    assert float(pairs.size) == np.abs(pairs.vertices).max() + 0.25


def test_a_polygon_is_added_to_the_obstacle_inside_out(pairs):
    w = np.random.default_rng(0).normal(size=(4, 20, 2))
    with x64():
        found = np.asarray(pairs.support(jnp.asarray(w)))
    own = (-CORNERS.vertices @ w[1].T).max(axis=0)
    box_support = np.maximum(w[1] @ [2, 0], w[1] @ [3, 0]) + np.abs(w[1, :, 1])
    inside = np.abs(w[1, :, 0]) * 0.5 + w[1, :, 0] * 2.5 + np.abs(w[1, :, 1])
    np.testing.assert_allclose(found[1], inside + own, atol=1e-12)
    assert (found[1] <= box_support + np.abs(w[1, :, 0]) + own).all()


def test_the_gap_of_one_interval_is_that_of_all(pairs):
    rng = np.random.default_rng(1)
    path = rng.normal(size=(6, 6)) * 3
    errors = ErrorBox(rng.uniform(0, 0.1, (5, 3, 2)))
    with x64():
        gap, w = pairs.gaps(jnp.asarray(path), errors)
    touching = np.asarray(pairs.touching(jnp.asarray(path[:-1]), errors))
    for o in range(4):
        for t in range(5):
            one, own = pairs.gap(o, path[t], path[t + 1], at(errors, t))
            assert abs(one - gap[o, t]) < 1e-12
            np.testing.assert_allclose(own, w[o, t], atol=1e-9)
            assert not (touching[o, t] and gap[o, t] > 1e-6)
    assert np.asarray(gap > 0).any()


def test_unknown_points_and_late_spans_are_refused(problem):
    with pytest.raises(InputError, match=r"nose, tail; got 'hitch'|nose, tail\); got 'hitch'"):
        pairs_of(problem, POINTS[:2], Layout(5, 2, 2))
    with pytest.raises(InputError, match="span of obstacle 1: expected last < 3 intervals; got 3"):
        pairs_of(problem, POINTS, LAYOUT._replace(n_steps=3))
