"""Corners and hulls of planar polytopes, exact."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from toy_models import random_polygon

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.common.sets.rational import convex_polygon
from parc_jax.safe_set.separation.pairs import corners


def exact_rows(poly):
    return [
        ((Fraction(a[0]), Fraction(a[1])), Fraction(b)) for a, b in zip(poly.A, poly.b, strict=True)
    ]


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@pytest.mark.parametrize("seed", range(40))
def test_corners_satisfy_every_row_exactly_and_name_those_that_meet(seed):
    rng = np.random.default_rng(seed)
    poly = random_polygon(
        rng, 5 * rng.normal(size=2), rng.uniform(0.01, 3), rows=int(rng.integers(0, 9))
    )
    found = corners(poly)
    for corner in found:
        slack = [b - a[0] * corner.point[0] - a[1] * corner.point[1] for a, b in exact_rows(poly)]
        assert min(slack) == 0
        assert sorted(corner.rows) == [i for i, s in enumerate(slack) if s == 0]
    points = [c.point for c in found]
    if len(points) > 2:  # counter-clockwise and strictly convex
        assert all(turn(points[i - 2], points[i - 1], points[i]) > 0 for i in range(len(points)))


@pytest.mark.parametrize("seed", range(20))
def test_no_corner_is_missing(seed):
    rng = np.random.default_rng(seed)
    poly = random_polygon(rng, [1.0, -2.0], 1.0, rows=6)
    points = np.array([[float(x) for x in c.point] for c in corners(poly)])
    way = rng.normal(size=(200, 2))
    from scipy.optimize import linprog

    for w in way[:25]:
        best = -linprog(-w, poly.A, poly.b, bounds=(None, None)).fun
        assert np.isclose((points @ w).max(), best, atol=1e-9)


def test_numbers_are_the_rationals_that_the_floats_hold():
    """As everywhere: 0.1 is not 1/10."""
    found = corners(from_box(box([0.1, 0.2], [0.3, 31.3])))
    held = [Fraction(v) for v in (0.1, 0.2, 0.3, 31.3)]
    assert held[0] != Fraction(1, 10)
    assert {c.point for c in found} == {(x, y) for x in held[::2] for y in held[1::2]}


@pytest.mark.parametrize("opening", [1e-3, 1e-6, 1e-9])
def test_the_tip_of_a_thin_wedge_is_where_the_rows_put_it(opening):
    # Rounding to decimals would move this tip by about 1e-16 / opening.
    wedge = hpolytope(
        [[-opening, 1], [-opening, -1], [1, 0]], [1.3 * opening + 0.1, 1.3 * opening - 0.1, 2.0]
    )
    (a, c), (b, d) = exact_rows(wedge)[:2]
    tip = ((c + d) / (a[0] + b[0]), (c - d) / 2)
    assert tip in {corner.point for corner in corners(wedge)}


def test_degenerate_sets_have_their_corners():
    wall = corners(from_box(box([1, -3], [1, 2])))
    assert {c.point for c in wall} == {(1, -3), (1, 2)}
    assert {c.point for c in corners(from_box(box([1, 2], [1, 2])))} == {(1, 2)}
    twice = from_box(box([0, 0], [1, 1]))
    twice = hpolytope(
        np.concatenate([twice.A, 3 * twice.A]), np.concatenate([twice.b, 3 * twice.b])
    )
    assert len(corners(twice)) == 4 and all(len(c.rows) == 4 for c in corners(twice))


@pytest.mark.parametrize(
    ("A", "b", "words"),
    [
        ([[1, 0], [-1, 0], [0, 1]], [3, -2, 3], "bounded"),
        ([[1, 0], [-1, 0]], [1, 1], "bounded"),
        ([[1, 0], [-1, 0], [0, 1], [0, -1]], [1, -2, 1, 1], "contradict"),
        ([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], [1, 1, 1, 1], "bounded"),
        ([[1, 0, 0], [-1, 0, 0]], [1, -2], "contradict"),
        ([[1, 0, 0, 0], [-1, 0, 0, 0]], [1, 1], "4 dimensions"),
    ],
)
def test_sets_without_corners_are_refused_in_one_sentence(A, b, words):
    with pytest.raises(InputError, match=words) as caught:
        corners(hpolytope(A, b), "obstacle 7")
    assert str(caught.value).startswith("obstacle 7: expected")


def test_corners_in_space_name_the_rows_that_meet():
    """A pyramid over a square, one of its rows twice; and a wall, where both of its sides meet."""
    A = [[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1], [0, 0, -1], [0, 0, -3]]
    found = {c.point: c.rows for c in corners(hpolytope(A, [1, 1, 1, 1, 0, 0]))}
    assert found[0, 0, 1] == (0, 1, 2, 3)
    assert found[1, 1, 0] == (0, 2, 4, 5) and len(found) == 5
    wall = corners(from_box(box([1, 0, 0], [1, 2, 3])))
    assert len(wall) == 4 and all({0, 3} <= set(c.rows) for c in wall)


@pytest.mark.parametrize("seed", range(10))
def test_hull_is_the_convex_hull(seed):
    rng = np.random.default_rng(seed)
    points = rng.integers(-5, 6, (30, 2))
    got = convex_polygon([(Fraction(int(x)), Fraction(int(y))) for x, y in points])
    expected = {tuple(p) for p in points[ConvexHull(points).vertices]}
    assert {(int(x), int(y)) for x, y in got} <= expected | {tuple(p) for p in points}
    assert all(
        turn(got[i - 2], got[i - 1], got[i]) > 0 for i in range(len(got))
    )  # strict: no collinear point kept
    for p in points:
        assert all(turn(got[i - 1], got[i], p) >= 0 for i in range(len(got)))


def test_hull_of_few_or_collinear_points():
    one, two, three = [(Fraction(i), Fraction(2 * i)) for i in range(3)]
    assert convex_polygon([one]) == [one] and convex_polygon([one, one]) == [one]
    assert sorted(convex_polygon([three, one, two, two])) == [one, three]
