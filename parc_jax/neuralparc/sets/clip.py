"""Cutting a polytope given by its vertices with axis-aligned walls, never too small."""

import numpy as np

from parc_jax.common.sets.qhull import convex_hull

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
