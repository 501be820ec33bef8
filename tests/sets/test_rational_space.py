"""Vertices of polytopes in space, exact: against every triple of rows, and where there are none."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.common.sets.rational import exact_support, rational_vertices


def solved(rows):
    """The point of three planes in rationals by elimination; None where it is not one."""
    rows = [[Fraction(x) for x in row] for row in rows]
    for i in range(3):
        pivot = next((j for j in range(i, 3) if rows[j][i] != 0), None)
        if pivot is None:
            return None
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(3):
            if j != i:
                rows[j] = [x - rows[j][i] * y for x, y in zip(rows[j], rows[i], strict=True)]
    return tuple(row[3] for row in rows)


def every_triple(poly):
    """Vertices by trying all triples of rows in rationals."""
    rows = np.concatenate([poly.A, poly.b[:, None]], axis=1).tolist()
    points = {solved(triple) for triple in itertools.combinations(rows, 3)} - {None}
    exact = [[Fraction(x) for x in row] for row in rows]
    fits = lambda p: all(a * p[0] + b * p[1] + c * p[2] <= e for a, b, c, e in exact)  # noqa: E731
    return sorted(filter(fits, points))


def random_polytope(rng, rows):
    """A box with some sides cut off, in any units, some rows twice."""
    A = rng.normal(size=(rows, 3))
    A[rows // 2 :] = rng.integers(-2, 3, (rows - rows // 2, 3)) + np.array([3, 0, 0])
    A = np.concatenate([np.eye(3), -np.eye(3), A])
    b = np.abs(A) @ np.full(3, 0.6) + 0.2 * rng.uniform(size=len(A))
    scale = 10.0 ** rng.uniform(-3, 3, len(A))
    A, b = A * scale[:, None], b * scale
    return hpolytope(np.concatenate([A, 2 * A[:2]]), np.concatenate([b, 2 * b[:2]]))


@pytest.mark.soundness
@pytest.mark.parametrize("seed", range(6))
def test_no_vertex_is_missing_and_none_is_too_many(seed):
    poly = random_polytope(np.random.default_rng(seed), 5)
    found = rational_vertices(poly)
    assert len(found) >= 8 and found == every_triple(poly)


@pytest.mark.soundness
@pytest.mark.parametrize("opening", [1e-3, 1e-7, 1e-12])
def test_thin_sets_keep_their_vertices(opening):
    """Rows that nearly depend on each other, where floats are not sure of anything."""
    wedge = hpolytope(
        [[-opening, 1, 0], [-opening, -1, 0], [1, 0, 0], [0, 0.3, 1], [opening, 0, -1]],
        [opening, opening, 2, 1, 0.1],
    )
    assert rational_vertices(wedge) == every_triple(wedge)
    assert len(rational_vertices(wedge)) == 6


def test_flat_sets_have_their_vertices():
    wall = from_box(box([1, -3, 0], [1, 2, 1]))
    assert rational_vertices(wall) == [(1, y, z) for y in (-3, 2) for z in (0, 1)]
    assert rational_vertices(from_box(box([1, 2, 3], [1, 2, 3]))) == [(1, 2, 3)]
    rod = from_box(box([0, 0, 0], [0, 0, 0.1]))
    assert rational_vertices(rod) == [(0, 0, 0), (0, 0, Fraction(0.1))]
    assert exact_support(rational_vertices(rod), np.array([1.0, 1.0, -2.0])) == 0


PLANES = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


@pytest.mark.parametrize(
    ("rows", "b"),
    [
        ([0], [3.0]),  # a half-space
        ([0, 1], [1.0, 1.0]),  # a slab
        ([0, 1, 2, 3], [1.0, 1, 1, 1]),  # a shaft
        ([0, 2, 4], [1.0, 1, 1]),  # an octant
        ([0, 1, 2, 3, 4], [1.0, 1, 1, 1, 1]),
    ],
)
def test_a_direction_left_open_is_refused_in_one_sentence(rows, b):
    with pytest.raises(InputError, match="obstacle 7: expected a bounded set") as caught:
        rational_vertices(hpolytope(PLANES[rows], b), "obstacle 7")
    assert "far side" in str(caught.value)


@pytest.mark.parametrize(
    ("rows", "b"),
    [
        ([0, 1], [1.0, -2.0]),
        ([0, 1, 2, 3], [1.0, 1, 1, -2]),
        ([0, 1, 2, 4], [1.0, -2, 1, 1]),
        ([0, 1, 2, 3, 4, 5], [1.0, 1, 1, 1, 1, -2]),
    ],
)
def test_rows_that_contradict_each_other_leave_no_vertex(rows, b):
    assert rational_vertices(hpolytope(PLANES[rows], b)) == []


def test_four_dimensions_are_refused():
    with pytest.raises(InputError, match="4 dimensions"):
        rational_vertices(from_box(box([0] * 4, [1] * 4)))
