"""Separating directions: multipliers that are proofs, spread over the circle, in any units of the
rows.
"""

from fractions import Fraction

import numpy as np
import pytest
from toy_models import random_polygon

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.common.sets.rational import convex_polygon
from parc_jax.problem.body import Part, Polygon, body_of, hull
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.separation import directions
from parc_jax.safe_set.separation.directions import N_DIRECTIONS, Multiplier, direction_table
from parc_jax.safe_set.separation.pairs import corners

GOAL = box([0, 0, 0], [1, 1, 1])


def exact_direction(obstacle, m: Multiplier):
    """(w, lambda . b) of a multiplier in rationals."""
    rows = [
        (Fraction(obstacle.A[i, 0]), Fraction(obstacle.A[i, 1]), Fraction(obstacle.b[i]))
        for i in m.rows
    ]
    return tuple(sum(v * row[c] for v, row in zip(m.values, rows, strict=True)) for c in range(3))


def problems(seed):
    rng = np.random.default_rng(seed)
    obstacles = [
        random_polygon(
            rng, 3 * rng.normal(size=2), rng.uniform(0.1, 2), rows=int(rng.integers(0, 8))
        ),
        box([1, -2], [1, 2]),
        box([1, -2], [1, -2]),
        hpolytope([[-1e-4, 1], [-1e-4, -1], [1, 0]], [1e-4, 1e-4, 2]),
    ]
    return reach_avoid(GOAL, obstacles, (0.0, 0.3, Polygon(rng.normal(size=(4, 2))))[seed % 3])


@pytest.mark.parametrize("seed", range(9))
def test_every_multiplier_is_a_proof_and_the_support_is_exact(seed):
    problem = problems(seed)
    table = direction_table(problem, 2)
    for j, obstacle in enumerate(problem.obstacles):
        points = [c.point for c in corners(obstacle)]
        assert len(table.multipliers[j]) == N_DIRECTIONS[2]
        for d, m in enumerate(table.multipliers[j]):
            assert m.values and all(v > 0 for v in m.values) and all(type(i) is int for i in m.rows)
            x, y, bound = exact_direction(obstacle, m)
            assert (x, y) != (0, 0)
            assert (
                max(x * p[0] + y * p[1] for p in points) == bound
            )  # both rows meet in a corner: nothing is lost
            size = abs(x) + abs(y)
            w, support = table.w[j, d], table.support[j, d]
            assert abs(Fraction(w[0]) - x) + abs(Fraction(w[1]) - y) <= Fraction(1, 2**52) * size
            body = bound + body_support(problem.body, float(x), float(y))
            assert abs(support - float(body)) <= 1e-14 * (abs(support) + float(size) * 10)


def body_support(body, x, y):
    if isinstance(body, Polygon):
        return Fraction(max(-x * v[0] - y * v[1] for v in body.vertices.tolist()))
    return Fraction(body.radius * float(np.hypot(x, y)))


@pytest.mark.parametrize("seed", range(6))
def test_directions_are_spread_over_the_circle_and_facets_come_first(seed):
    rng = np.random.default_rng(seed)
    polygon = random_polygon(rng, [0, 0], 1.0, rows=5)  # rows differ in length by up to 100
    table = direction_table(reach_avoid(GOAL, [polygon], 0.0), 2)
    angle = np.sort(np.arctan2(table.w[0, :, 1], table.w[0, :, 0]))
    assert np.diff(angle, append=angle[0] + 2 * np.pi).max() < np.radians(3 * 360 / N_DIRECTIONS[2])
    facets = {m.rows[0] for m in table.multipliers[0][: table.n_facets] if len(m.rows) == 1}
    seen = [i for corner in corners(polygon) for i in corner.rows]
    assert facets >= {i for i in seen if seen.count(i) == 2}  # a side has two ends


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e-3, 1e6, 1e12])
def test_any_direction_has_a_multiplier_close_to_it_in_any_units(unit):
    rng = np.random.default_rng(3)
    A = np.array([[1.0, 1], [-1, 1], [-1, -1], [1, -1]]) * np.array([unit, 1, 1, 1])[:, None]
    b = np.array([0.5, 0.4, 0.3, 0.6]) * np.array([unit, 1, 1, 1])
    problem = reach_avoid(GOAL, [hpolytope(A, b)], 0.1)
    table = direction_table(problem, 2)
    points = [c.point for c in corners(problem.obstacles[0])]
    for angle in rng.uniform(-np.pi, np.pi, 200):
        w = np.array([np.cos(angle), np.sin(angle)])
        m = table.nearest_of_many(0, w[None])[0]
        x, y, bound = exact_direction(problem.obstacles[0], m)
        assert max(x * p[0] + y * p[1] for p in points) == bound
        got, _ = table.direction(0, m)
        turned = got[0] * w[1] - got[1] * w[0]
        assert got @ w > 0 and abs(turned) < 1e-7 * np.hypot(*got)


def test_sums_are_rounded_once_whatever_is_summed(rng):
    """Short values and long ones: always the nearest float of the exact sum."""
    for trial in range(300):
        bits = 26 if trial % 3 else 40
        n = int(rng.integers(1, 4))
        values = tuple(Fraction(int(rng.integers(1, 2**bits)), 2**bits) for _ in range(n))
        column = rng.normal(size=n) * 10.0 ** rng.integers(-8, 9, n)
        if trial % 7 == 0:
            column[-1] = -float(values[0] * Fraction(column[0]) / values[-1])  # mostly cancels
        if trial % 50 == 0:
            column[0] = 1e-300 if trial % 100 else 1e300
        exact = float(sum(v * Fraction(x) for v, x in zip(values, column, strict=True)))
        assert directions._rounded_sum(values, column.tolist()) == exact


def test_an_obstacle_with_more_facets_than_directions_still_has_proofs():
    angle = np.arange(60) * 2 * np.pi / 60
    problem = reach_avoid(
        GOAL, [hpolytope(np.stack([np.cos(angle), np.sin(angle)], axis=1), np.ones(60))], 0.0
    )
    table = direction_table(problem, 2)
    assert len(table.multipliers[0]) == N_DIRECTIONS[2] and np.isfinite(table.w).all()
    points = convex_polygon([c.point for c in corners(problem.obstacles[0])])
    (nearest,) = table.nearest_of_many(0, np.array([[0.8, 0.6]]))
    x, y, bound = exact_direction(problem.obstacles[0], nearest)
    assert max(x * p[0] + y * p[1] for p in points) == bound


SPACE = box([0, 0, 0, 0], [1, 1, 1, 1])


def bodies_in_space():
    """Obstacles in space: a box, a pyramid with many sides, a wall, a rod, a point, and a slanted
    one with rows of different lengths, one of them twice.
    """
    angle = np.arange(7) * 2 * np.pi / 7
    sides = np.stack([np.cos(angle), np.sin(angle), np.full(7, 0.5)], axis=1)
    rng = np.random.default_rng(0)
    A = np.concatenate([np.eye(3), -np.eye(3), rng.normal(size=(4, 3))])
    units = 10.0 ** rng.uniform(-3, 3, 10)
    slanted = hpolytope(
        np.concatenate([A * units[:, None], 2 * A[:1]]), np.append(units * 0.7, 1.4)
    )
    return [
        box([1, -2, 0], [2, 2, 1]),
        hpolytope(np.concatenate([sides, [[0, 0, -1]]]), np.append(np.full(7, 0.5), 0)),
        box([1, -2, 0], [1, 2, 3]),
        box([1, 2, 0], [1, 2, 3]),
        box([1, 2, 3], [1, 2, 3]),
        slanted,
    ]


def in_space(body=0.1):
    return reach_avoid(SPACE, bodies_in_space(), body)


def exactly(obstacle, m: Multiplier):
    """(w, lambda . b) of a multiplier in rationals."""
    rows = [[*map(Fraction, obstacle.A[i]), Fraction(obstacle.b[i])] for i in m.rows]
    columns = zip(*rows, strict=True)
    *w, bound = (sum(v * x for v, x in zip(m.values, c, strict=True)) for c in columns)
    return w, bound


def support_of(obstacle, w):
    return max(sum(a * x for a, x in zip(w, c.point, strict=True)) for c in corners(obstacle))


@pytest.mark.soundness
@pytest.mark.parametrize("body", [0.0, 0.3, Polygon(np.eye(3) * 0.2)])
def test_in_space_every_multiplier_is_a_proof_and_the_support_is_exact(body):
    problem = in_space(body)
    table = direction_table(problem, 3)
    for j, obstacle in enumerate(problem.obstacles):
        assert len(table.multipliers[j]) == N_DIRECTIONS[3]
        for d, m in enumerate(table.multipliers[j]):
            assert 1 <= len(m.rows) <= 3 and all(v > 0 for v in m.values)
            w, bound = exactly(obstacle, m)
            assert any(w) and support_of(obstacle, w) == bound
            rough = np.array([float(x) for x in w])
            np.testing.assert_allclose(table.w[j, d], rough, rtol=1e-15)
            shape = problem.body
            extra = (
                (-shape.vertices @ rough).max()
                if isinstance(shape, Polygon)
                else shape.radius * np.linalg.norm(rough)
            )
            assert table.support[j, d] == pytest.approx(float(bound) + extra, rel=1e-13)


def test_every_part_of_a_body_has_its_own_support():
    body = body_of([hull(0, 1, radius=0.3), Part((1,), Polygon(np.array([[0.0, 0], [0.5, 0]])))])
    obstacles = [box([1, 1], [2, 2]), box([-3, 0], [-2, 2])]
    table = direction_table(reach_avoid(GOAL, obstacles, body), 2)
    assert len(table.multipliers) == 4 and table.support.shape[0] >= 4
    facets = [m.rows for m in table.multipliers[0]]
    east, west = facets.index((0,)), facets.index((2,))
    assert table.support[:4, east] == pytest.approx([2.3, 2.0, -1.7, -2.0])
    assert table.support[:4, west] == pytest.approx([-0.7, -0.5, 3.3, 3.5])


def test_without_obstacles_the_table_still_has_the_dimension_of_the_workspace():
    for n_p in (2, 3):
        table = direction_table(reach_avoid(SPACE, [], 0.1), n_p)
        assert table.w.shape == (1, N_DIRECTIONS[n_p], n_p) and not table.multipliers
