"""Qhull, in one place: each call gives what Qhull found, or None where it gives up.

Qhull works in floats. Nothing that must be exact rests on it.
"""

import numpy as np


def halfspace_intersection(A: np.ndarray, b: np.ndarray, inside: np.ndarray):
    """scipy's HalfspaceIntersection of {A x <= b}, A (h, n), around a point strictly inside (n,).

    None where the rows do not close around the point, or the set is too thin.
    """
    return _found("HalfspaceIntersection", np.column_stack([A, -b]), inside)


def convex_hull(points: np.ndarray, options: str | None = None):
    """scipy's ConvexHull of points (v, n); None for a flat hull."""
    return _found("ConvexHull", points, qhull_options=options)


def delaunay(points: np.ndarray, options: str | None = None) -> np.ndarray | None:
    """Simplices (s, n + 1) of the Delaunay triangulation of points (v, n); None for a flat hull."""
    found = _found("Delaunay", points, qhull_options=options)
    return None if found is None else found.simplices


def _found(kind: str, *data: np.ndarray, **options: str | None):
    from scipy import spatial

    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            return getattr(spatial, kind)(*data, **options)
    except (spatial.QhullError, ValueError):
        return None


def scaled_around(A: np.ndarray, b: np.ndarray, inside: np.ndarray):
    """Rows of {A x <= b} in coordinates y = (x - inside) / scale, in which thin sets look round.

    Returns A' (h, n), b' (h,) and scale (n,); None when `inside` is not strictly inside.
    """
    slack = b - A @ inside
    if not (slack > 0).all():
        return None
    size = np.abs(A)
    steps = np.where(size > 0, slack[:, None] / np.where(size > 0, size, 1.0), np.inf)
    scale = steps.min(axis=0)
    return A * scale, slack, scale
