"""A polytope around vertices: rows of their convex hull, which hold every vertex exactly."""

from fractions import Fraction

import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_up
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope
from parc_jax.common.sets.qhull import convex_hull
from parc_jax.common.sets.rational import Point, convex_polygon, exact_support

SHARP = 1e-6  # [rad, about] a corner that is sharper may open where its normals are rounded


def polytope_around(vertices, name: str = "vertices") -> HPolytope:
    """The convex hull of vertices (v, n), or a little more: never less, so an obstacle only grows.

    In the plane vertices may lie on a line, or all in one place. Raises InputError, which begins
    with `name`, for fewer than two dimensions, or a flat hull in space.

    Algorithm: normals in the plane from the exact hull, in space from Qhull, rounded; offsets are
    the supports of all vertices along these very normals, in exact rationals, rounded up.
    """
    points = as_float64(name, vertices, (None, None))
    if not len(points) or points.shape[1] < 2:
        raise InputError(f"{name}: expected points of the workspace, one a row; got {vertices!r}.")
    exact = [tuple(Fraction(x) for x in point) for point in points.tolist()]
    normals = _in_plane(exact) if points.shape[1] == 2 else _in_space(points, name)
    return hpolytope(normals, np.array([round_up(exact_support(exact, w)) for w in normals]))


def _in_plane(exact: list[Point]) -> np.ndarray:
    """Across the edges; where they are one, or nearly, along them too, which closes the ends."""
    corners = convex_polygon(exact)
    pairs = zip(corners, corners[1:] + corners[:1], strict=True)
    edges = [(u - x, v - y) for (x, y), (u, v) in pairs]
    if len(corners) == 1:
        edges = [(Fraction(1), Fraction(0)), (Fraction(-1), Fraction(0))]
    along = np.array([(a / _size(a, b), b / _size(a, b)) for a, b in edges], float) + 0.0
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) + 0.0
    after = np.roll(along, -1, axis=0)
    turn = (np.roll(normals, -1, axis=0) * along).sum(axis=1)
    sharp = (np.abs(turn) < SHARP) & ((along * after).sum(axis=1) < 0)
    return np.unique(np.concatenate([normals, along[sharp], -along[sharp]]), axis=0)


def _size(a: Fraction, b: Fraction) -> Fraction:
    return max(abs(a), abs(b))


def _in_space(points: np.ndarray, name: str) -> np.ndarray:
    hull = convex_hull(points)
    if hull is None:
        raise InputError(
            f"{name}: expected a hull with volume; these vertices are flat, or too nearly so. Give "
            "it some thickness."
        )
    return np.unique(hull.equations[:, :-1] + 0.0, axis=0)
