"""Vertices, volumes, exact planar polytopes and redundant rows: known answers and degenerate
sets.
"""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from random_polytopes import round_polytope

from benchmarks.neuralparc.sets.operations import clip_to_box
from benchmarks.neuralparc.sets.sampling import volume
from benchmarks.neuralparc.sets.vertices import vertices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.common.sets.rational import area, exact_support, rational_vertices


def rows_of(points):
    return sorted(map(tuple, np.round(points, 9) + 0.0))


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6])
def test_cube_has_its_corners_and_volume(n):
    corners = vertices(from_box(box(-np.ones(n), 2 * np.ones(n))))
    assert rows_of(corners) == sorted(product([-1.0, 2.0], repeat=n))
    assert abs(volume(corners) - 3.0**n) < 1e-10 * 3.0**n


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


def test_rational_sets_that_touch_by_one_bit():
    one, over = 1.0, np.nextafter(1.0, 2)
    axes = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    assert rational_vertices(HPolytope(axes, np.array([one, -one, 1.0, 0.0]))) == [(1, 0), (1, 1)]
    assert rational_vertices(HPolytope(axes, np.array([one, -over, 1.0, 0.0]))) == []
    thin = rational_vertices(HPolytope(axes, np.array([over, -one, 1.0, 0.0])))
    assert area(thin) == Fraction(1, 2**52)


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
