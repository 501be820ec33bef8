"""Pairs of obstacles and parts: who is kept apart from what, in which intervals."""

from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.error_set import ErrorBox, at, template
from parc_jax.learning.network.predict import Layout
from parc_jax.problem.body import Part, Polygon, body_of, hull
from parc_jax.problem.problem import goal_of_points, reach_avoid
from parc_jax.safe_set.separation.pairs import obstacles_of

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
    return obstacles_of(problem, POINTS, LAYOUT)


def test_pairs_go_obstacle_by_obstacle(pairs):
    assert pairs.points.tolist() == [[0, 1], [2, 2], [0, 1], [2, 2]]
    assert pairs.radius.tolist() == [0.25, 0.0, 0.25, 0.0]
    assert pairs.active.tolist() == [[True] * 5] * 2 + [[False, True, True, True, False]] * 2
    assert {tuple(v) for v in pairs.vertices[0]} == {(2, -1), (3, -1), (3, 1), (2, 1)}
    assert float(pairs.size) == np.abs(pairs.vertices).max() + 0.25


def test_a_polygon_is_added_to_the_obstacle_inside_out(pairs):
    w = np.random.default_rng(0).normal(size=(20, 2))
    with x64():
        found = np.asarray(jax.jit(jax.vmap(pairs.only(1).support))(w))
    own = (-CORNERS.vertices @ w.T).max(axis=0)
    box_support = np.maximum(w @ [2, 0], w @ [3, 0]) + np.abs(w[:, 1])
    inside = np.abs(w[:, 0]) * 0.5 + w[:, 0] * 2.5 + np.abs(w[:, 1])
    np.testing.assert_allclose(found, inside + own, atol=1e-12)
    assert (found <= box_support + np.abs(w[:, 0]) + own).all()


@pytest.mark.parametrize("faces", [pytest.param(False, marks=pytest.mark.slow), True])
def test_boxes_tell_no_more_than_the_gap(pairs, faces):
    rng = np.random.default_rng(2)
    close = 0
    with x64():
        both = jax.jit(lambda path, errors: (pairs.away(path, errors), pairs.gaps(path, errors)[0]))
        for _ in range(200):
            # slowly turning and moving about, now near and now far
            path = rng.normal(size=6) * 3 + np.cumsum(rng.normal(size=(6, 6)) * 0.4, axis=0)
            errors = ErrorBox(rng.uniform(0, 0.3, (5, 3, 2)))
            if faces:
                along = np.broadcast_to(rng.normal(size=(3, 2)), (5, 3, 3, 2))
                centre = rng.normal(size=(5, 3, 3)) * 0.1
                errors = template(along, centre, rng.uniform(0.05, 0.2, (5, 3, 3)))
            away, gap = both(path, errors)
            least = np.where(pairs.active, gap, np.inf).min(axis=1)
            assert (away <= least + 1e-12).all()
            close += int((away > 0.5 * np.abs(least)).sum())
    assert close > 100  # where they tell anything they tell much


@pytest.mark.night
def test_the_gap_of_one_interval_is_that_of_all(pairs):
    rng = np.random.default_rng(1)
    path = rng.normal(size=(6, 6)) * 3
    errors = ErrorBox(rng.uniform(0, 0.1, (5, 3, 2)))
    with x64():
        gap, w = pairs.gaps(jnp.asarray(path), errors)
    for o in range(4):
        for t in range(5):
            one, own = pairs.gap(o, path[t], path[t + 1], at(errors, t))
            assert abs(one - gap[o, t]) < 1e-12
            np.testing.assert_allclose(own, w[o, t], atol=1e-9)
    assert np.asarray(gap > 0).any()


def test_unknown_points_and_late_spans_are_refused(problem):
    with pytest.raises(InputError, match=r"nose, tail; got 'hitch'|nose, tail\); got 'hitch'"):
        obstacles_of(problem, POINTS[:2], Layout(5, 2, 2))
    with pytest.raises(InputError, match="span of obstacle 1: expected last < 3 intervals; got 3"):
        obstacles_of(problem, POINTS, LAYOUT._replace(n_steps=3))


@pytest.mark.parametrize("n_p", [2, 3])
def test_sums_are_exact_until_the_last_rounding(n_p):
    """0.1 + 0.2 is not 0.3, but the nearest number to the sum of what the floats hold."""
    shape = Polygon(np.array([[0.1] * n_p, [-0.7] * n_p, [0.1] * n_p]))
    goal = goal_of_points(POINTS, box([-9.0] * n_p, [9.0] * n_p))
    obstacle = box([0.2] * n_p, [1.1] * n_p)
    problem = reach_avoid(goal, [obstacle], body_of([Part(("hitch",), shape)]))
    vertices = obstacles_of(problem, POINTS, Layout(5, n_p, 3)).vertices[0]
    exact = {float(Fraction(a) - Fraction(b)) for a in (0.2, 1.1) for b in (0.1, -0.7)}
    assert {float(x) for v in vertices for x in v} == exact
    assert len(np.unique(vertices, axis=0)) == {2: 6, 3: 16}[n_p]


def test_in_space_the_gap_is_that_of_what_is_seen_from_the_side():
    """A plate over a box, both level: what happens is seen along any level axis."""
    plate = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    names = ("a", "b", "c", "d")
    goal = goal_of_points(names, box([-9.0] * 3, [9.0] * 3))
    obstacle = box([-1.0, -1, -1], [0.5, 0.5, 0.5])
    problem = reach_avoid(goal, [obstacle], hull(*names, radius=0.25))
    pairs = obstacles_of(problem, names, Layout(1, 3, 4))
    over = plate + np.array([0.0, 0.0, 1.0])
    beside = plate + np.array([0.9, 0.2, 0.1])
    allowed = ErrorBox(np.full((4, 3), 0.05))
    gap, w = pairs.gap(0, over.ravel(), over.ravel(), allowed)
    assert gap == pytest.approx(1.0 - 0.5 - 0.25 - 0.05, abs=1e-12)
    np.testing.assert_allclose(w, [0, 0, 1], atol=1e-12)
    gap, w = pairs.gap(0, beside.ravel(), (beside + np.array([0.2, 0.0, 0.0])).ravel(), allowed)
    assert gap == pytest.approx(0.9 - 0.5 - 0.25 - 0.05, abs=1e-12)
    np.testing.assert_allclose(w, [1, 0, 0], atol=1e-12)
