"""Vertices, volumes, exact planar polytopes and redundant rows: known answers and degenerate
sets.
"""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from effort import calls_of
from random_polytopes import points_around, round_polytope

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.common.sets.rational import area, convex_polygon, exact_support, rational_vertices
from parc_jax.common.sets.vertices import vertices
from parc_jax.neuralparc.sets.clip import clip_to_box, extreme_points
from parc_jax.neuralparc.sets.redundancy import irredundant_rows, without_redundant_rows
from parc_jax.neuralparc.sets.volume import simplex_volumes, triangulate, volume


def rows_of(points):
    return sorted(map(tuple, np.round(points, 9) + 0.0))


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6])
def test_cube_has_its_corners_and_volume(n):
    corners = vertices(from_box(box(-np.ones(n), 2 * np.ones(n))))
    assert rows_of(corners) == sorted(product([-1.0, 2.0], repeat=n))
    assert abs(volume(corners) - 3.0**n) < 1e-10 * 3.0**n


@pytest.mark.parametrize("n", [2, 3, 4])
def test_simplex_and_cross_polytope(n):
    simplex = HPolytope(np.concatenate([-np.eye(n), np.ones((1, n))]), np.r_[np.zeros(n), 1.0])
    assert rows_of(vertices(simplex)) == rows_of(np.concatenate([np.zeros((1, n)), np.eye(n)]))
    assert abs(volume(vertices(simplex)) - 1 / np.prod(np.arange(1, n + 1))) < 1e-12
    signs = np.array(list(product([-1.0, 1.0], repeat=n)))
    cross = vertices(HPolytope(signs, np.ones(len(signs))))  # many facets meet in each vertex
    assert rows_of(cross) == rows_of(np.concatenate([np.eye(n), -np.eye(n)]))


def test_flat_and_empty_sets_have_their_vertices():
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    square = HPolytope(axes, np.array([1.0, 1.0, 0.5, 1.0, 1.0, -0.5]))
    assert rows_of(vertices(square)) == sorted(product([-1.0, 1.0], [-1.0, 1.0], [0.5]))
    segment = HPolytope(axes, np.array([1.0, 2.0, 0.5, 0.0, -2.0, -0.5]))
    assert rows_of(vertices(segment)) == [(0.0, 2.0, 0.5), (1.0, 2.0, 0.5)]
    point = HPolytope(axes, np.array([1.0, 2.0, 0.5, -1.0, -2.0, -0.5]))
    assert rows_of(vertices(point)) == [(1.0, 2.0, 0.5)]
    assert vertices(HPolytope(axes, np.array([1.0, 1, 1, -1.001, 1, 1]))).shape == (0, 3)
    assert volume(vertices(square)) == volume(vertices(segment)) == volume(vertices(point)) == 0.0
    diagonal = HPolytope(
        np.array([[1.0, -1.0], [-1.0, 1.0], [1.0, 0.0], [-1.0, 0.0]]), np.array([0.0, 0, 1, 1])
    )
    assert rows_of(vertices(diagonal)) == [(-1.0, -1.0), (1.0, 1.0)]


@pytest.mark.parametrize(
    "rows",
    [
        ([[1.0, 0], [0, 1.0]], [1.0, 1.0]),
        ([[1.0, 0], [-1.0, 0]], [1.0, 1.0]),
        ([[1.0, 0], [-1.0, 0]], [1.0, -1.0]),
        ([[1.0, 0], [-1.0, 0], [0, 1.0]], [1.0, 1.0, 1.0]),
        ([[1.0]], [1.0]),
    ],
)
def test_unbounded_sets_are_refused(rows):
    p = HPolytope(*map(np.array, rows))
    with pytest.raises(InputError, match="leave a direction open"):
        vertices(p)
    if p.n == 2:
        with pytest.raises(InputError, match="leave a direction open"):
            rational_vertices(p)


def test_too_many_dimensions_are_refused():
    with pytest.raises(InputError, match="at most 6"):
        vertices(from_box(box(-np.ones(7), np.ones(7))))


def test_float_vertices_equal_rational_ones(rng):
    for _ in range(10):
        p = round_polytope(rng, 2, 6)
        exact = np.array([[float(x), float(y)] for x, y in rational_vertices(p)])
        assert rows_of(vertices(p)) == rows_of(exact)
        assert abs(volume(vertices(p)) - float(area(rational_vertices(p)))) < 1e-12


def test_rational_vertices_are_exact_and_ordered():
    third = HPolytope(
        np.array([[3.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]), np.array([1.0, 0.0, 1.0, 0.0])
    )
    assert rational_vertices(third) == [(0, 0), (Fraction(1, 3), 0), (Fraction(1, 3), 1), (0, 1)]
    assert area(rational_vertices(third)) == Fraction(1, 3)
    assert exact_support(rational_vertices(third), np.array([3.0, 1.0])) == 2


def test_rational_vertices_ask_for_few_common_divisors(rng):
    """The points of all pairs of fifteen rows are tried against the rows: 3,000 calls, where
    sums of fractions take 30,000.
    """
    p = round_polytope(rng, 2, 11)
    assert len(p.b) == 15
    assert calls_of(lambda: rational_vertices(p)) < 10_000


def test_rational_sets_that_touch_by_one_bit():
    one, over = 1.0, np.nextafter(1.0, 2)
    axes = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    assert rational_vertices(HPolytope(axes, np.array([one, -one, 1.0, 0.0]))) == [(1, 0), (1, 1)]
    assert rational_vertices(HPolytope(axes, np.array([one, -over, 1.0, 0.0]))) == []
    thin = rational_vertices(HPolytope(axes, np.array([over, -one, 1.0, 0.0])))
    assert area(thin) == Fraction(1, 2**52)


def test_hull_drops_collinear_points():
    points = [(Fraction(x), Fraction(y)) for x in range(3) for y in range(3)]
    assert convex_polygon(points) == [(0, 0), (2, 0), (2, 2), (0, 2)]


def test_triangulation_fills_a_random_polytope(rng):
    p = round_polytope(rng, 3, 8)
    simplices = triangulate(vertices(p))
    assert p.replace(b=p.b + 1e-9).contains(simplices.reshape(-1, 3)).all()
    lo, hi = vertices(p).min(axis=0), vertices(p).max(axis=0)
    share = p.contains(rng.uniform(lo, hi, (200_000, 3))).mean() * np.prod(hi - lo)
    assert abs(simplex_volumes(simplices).sum() / share - 1) < 0.02
    thin = vertices(p) * np.array([1.0, 1.0, 1e-9])
    assert abs(volume(thin) / volume(vertices(p)) - 1e-9) < 1e-15


def test_redundant_rows_go_and_the_set_stays(rng):
    p = round_polytope(rng, 3, 5)
    offsets = np.r_[p.b, p.b + 0.1, 2 * p.b[:2], p.b[:3] + p.b[3:6] + 0.01]
    loose = HPolytope(np.concatenate([p.A, p.A, 2 * p.A[:2], p.A[:3] + p.A[3:6]]), offsets)
    rows = irredundant_rows(loose)
    assert (rows < len(p.b)).all() and len(rows) <= len(p.b)
    x = points_around(rng, p, 2000)
    np.testing.assert_array_equal(without_redundant_rows(loose).contains(x), p.contains(x))
    again = irredundant_rows(without_redundant_rows(loose))
    assert again.tolist() == list(range(len(rows)))  # each row that stays matters


def test_rows_that_empty_a_set_stay():
    p = HPolytope(np.array([[1.0], [-1.0], [1.0]]), np.array([1.0, -5.0, 7.0]))
    assert len(vertices(without_redundant_rows(p))) == 0


@pytest.mark.parametrize("n", [1, 2, 3])
def test_clipping_vertices_is_cutting_the_set(rng, n):
    for _ in range(5):
        p = round_polytope(rng, n, 5)
        centre, radius = vertices(p).mean(axis=0), rng.uniform(0.1, 1.5, n)
        lo, hi = centre - radius, centre + 0.5 * radius
        cut = HPolytope(np.concatenate([p.A, np.eye(n), -np.eye(n)]), np.r_[p.b, hi, -lo])
        found, w = clip_to_box(vertices(p), lo, hi), rng.normal(size=(20, n))
        np.testing.assert_allclose(
            (found @ w.T).max(axis=0), (vertices(cut) @ w.T).max(axis=0), atol=1e-9
        )
        assert abs(volume(found) - volume(vertices(cut))) < 1e-9
    assert len(clip_to_box(vertices(p), hi + 9, hi + 10)) == 0


@pytest.mark.soundness
def test_clipping_is_never_too_small_for_edges_parallel_to_a_wall():
    """An edge tilted by one unit in the last place: where it crosses is not knowable, so all of it
    stays.
    """
    low, high = 1.0, np.nextafter(1.0, 2)
    triangle = np.array([[0.0, low], [8.0, high], [0.0, 0.0]])
    cut = clip_to_box(triangle, np.array([-1.0, -1.0]), np.array([9.0, low + 0.3 * (high - low)]))
    assert cut[:, 0].max() == 8.0
    sharp = clip_to_box(triangle, np.array([-1.0, -1.0]), np.array([4.0, 9.0]))
    assert 4.0 <= sharp[:, 0].max() < 4.0 + 1e-14


def test_extreme_points_of_flat_sets_are_kept():
    segment = np.array([[0.0, 0.0], [1.0, 1.0], [0.5, 0.5], [0.25, 0.25]])
    assert {(0.0, 0.0), (1.0, 1.0)} <= set(map(tuple, extreme_points(segment)))
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    assert len(extreme_points(square)) == 4
