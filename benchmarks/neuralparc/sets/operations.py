"""Minkowski sums, by which obstacles grow, rounded up; Pontryagin differences with boxes, by which
goals shrink, rounded down; and hulls cut by a box, never too small.
"""

import numpy as np
from jaxtyping import Float

from benchmarks.neuralparc.sets.affine import Set, stacked
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import gamma, round_up
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import convex_hull
from parc_jax.common.sets.rational import exact_support, rational_vertices


def minkowski_sum(p: Set, q: Set) -> Set:
    """The sum of any two sets, exact. Two boxes give a box (rounded outward), else an AH-polytope
    of stacked bases.
    """
    both = stacked(p, q)[2]
    if isinstance(p, Box) and isinstance(q, Box):
        return Box(np.nextafter(p.lo + q.lo, -np.inf), np.nextafter(p.hi + q.hi, np.inf))
    return both.replace(G=both.G[: p.n] + both.G[p.n :], c=both.c[: p.n] + both.c[p.n :])


def grow(p: HPolytope, radius: Float[np.ndarray, "... n"]) -> HPolytope:
    """P plus the box [-radius, radius] along the rows of P: contains the sum, and equals it if P
    has the box's normals.

    p: h rows in R^n. radius: (..., n) >= 0. Returns b of shape (..., h). In the plane,
    `with_axis_rows` adds the four axis normals, so that the result is the sum itself.
    """
    gain = radius @ np.abs(p.A).T
    slack = gamma(p.n + 2) * (np.abs(p.b) + gain)
    return p.replace(b=np.nextafter(p.b + gain + slack, np.inf))


def with_axis_rows(p: HPolytope) -> HPolytope:
    """The same bounded polygon with the four axis normals as (touching) rows added, rounded up."""
    axes = np.concatenate([np.eye(2), -np.eye(2)])
    corners = rational_vertices(p)
    if not corners:
        raise InputError("with_axis_rows: expected a set with points in it; it is empty.")
    offsets = np.array([round_up(exact_support(corners, w)) for w in axes])
    return HPolytope(np.concatenate([p.A, axes]), np.r_[p.b, offsets])


def shrink(p: HPolytope, radius: Float[np.ndarray, "... n"]) -> HPolytope:
    """P minus the box [-radius, radius], closed form. [NP, Sec. III-B]

    p: h rows in R^n. radius: (..., n) >= 0. Returns b of shape (..., h): one shrunken polytope per
        leading index.
    """
    # |A| radius, not A radius: each row loses the box corner that hurts it most.
    loss = radius @ np.abs(p.A).T
    slack = gamma(p.n + 2) * (np.abs(p.b) + loss)
    return p.replace(b=np.nextafter(p.b - loss - slack, -np.inf))


_UNIT = 2.0**-53


def clip_to_box(points: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Points whose hull is hull(points) cut by lo <= x <= hi, up to rounding: (v, n) -> (w, n); (0,
    n) if they miss.

    Rounded outward along the edges: where an edge is nearly parallel to a wall, the point of
    intersection is uncertain, and the far end of what is possible is taken.
    """
    for axis in range(points.shape[1]):
        for value, side in ((hi[axis], 1.0), (lo[axis], -1.0)):
            points = _cut(points, axis, value, side)
    return points


def extreme_points(points: np.ndarray) -> np.ndarray:
    """Those of the points that span their hull, by Qhull; all of them if the hull is flat."""
    if points.shape[1] == 1:
        return np.unique(points, axis=0)[[0, -1]] if len(points) else points
    points = np.unique(points, axis=0)
    if len(points) <= points.shape[1] + 1:
        return points
    hull = convex_hull(points)
    return points if hull is None else points[hull.vertices]


def _cut(points: np.ndarray, axis: int, value: float, side: float) -> np.ndarray:
    """Hull of points cut by side * x[axis] <= side * value: what lies inside, and where
    inside-outside pairs cross.
    """
    x = side * points[:, axis]
    inside = points[x <= side * value]
    outside = points[x > side * value]
    if not (len(inside) and len(outside)):
        return inside
    start = inside[:, None]
    end = outside[None]
    span = side * (end[..., axis] - start[..., axis])
    # Every pair crosses inside the hull, so pairs that are no edges do no harm.
    share = side * (value - start[..., axis]) / span
    uncertain = 4 * _UNIT * (abs(value) + np.abs(start[..., axis]) + np.abs(end[..., axis])) / span
    crossing = start + np.minimum(share + uncertain, 1.0)[..., None] * (end - start)
    return extreme_points(np.concatenate([inside, crossing.reshape(-1, points.shape[1])]))
