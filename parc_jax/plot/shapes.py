"""Outlines of planar sets, ready to draw."""

import numpy as np

from parc_jax.sets.hpolytope import HPolytope
from parc_jax.sets.qhull import convex_hull
from parc_jax.sets.vertices import vertices
from parc_jax.verdict.scene import Scene

ARC = 48  # points on the circle of a disc body


def hull(points: np.ndarray) -> np.ndarray:
    """Convex hull (v, 2) of points (n, 2), counter-clockwise; the points themselves where they
    enclose no area.
    """
    points = np.asarray(points, float)
    found = convex_hull(points)
    return points if found is None else points[found.vertices]


def shadow(poly: HPolytope, axes: tuple[int, int] = (0, 1)) -> np.ndarray:
    """Outline (v, 2) of the projection of a bounded polytope onto two of its coordinates."""
    return hull(vertices(poly)[:, list(axes)])


def grown(scene: Scene, obstacle: int, error=(0.0, 0.0)) -> np.ndarray:
    """Outline (v, 2) of an obstacle grown by the body and by box(error), error (2,) [m]."""
    corners = scene.obstacles.corner[obstacle] + scene.obstacles.sign[obstacle] * np.asarray(error)
    return hull((corners[:, None] + disc(float(scene.obstacles.radius))[None]).reshape(-1, 2))


def disc(radius: float) -> np.ndarray:
    """Outline (ARC, 2) of a disc about the origin, drawn just outside it."""
    angle = np.arange(ARC) * 2 * np.pi / ARC
    return radius / np.cos(np.pi / ARC) * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def body_outline(body) -> np.ndarray:
    """Outline (v, 2) of a Disc or Polygon about its reference point."""
    return hull(body.vertices) if hasattr(body, "vertices") else disc(body.radius)


def placed(outline: np.ndarray, at: np.ndarray, heading: float = 0.0) -> np.ndarray:
    """An outline (v, 2) turned by `heading` [rad] and moved to `at` (2,)."""
    c, s = np.cos(heading), np.sin(heading)
    return outline @ np.array([[c, s], [-s, c]]) + at


def tubes(path: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Hexagons (..., T, 6, 2) swept by error boxes (..., T, 2) along the segments of a path (..., T
    + 1, 2).
    """
    a, b = path[..., :-1, :], path[..., 1:, :]
    sign = np.where(b >= a, 1.0, -1.0)
    behind, ahead = -sign * error, sign * error
    right = np.stack([ahead[..., 0], behind[..., 1]], axis=-1)
    left = np.stack([behind[..., 0], ahead[..., 1]], axis=-1)
    return np.stack([a + behind, a + right, b + right, b + ahead, b + left, a + left], axis=-2)


def span(*points: np.ndarray, room: float = 0.04) -> tuple[np.ndarray, np.ndarray]:
    """Corners of a box around point sets (n, 2), with some room."""
    flat = np.concatenate([np.asarray(p).reshape(-1, 2) for p in points])
    flat = flat[np.isfinite(flat).all(axis=1)]
    lo, hi = flat.min(axis=0), flat.max(axis=0)
    pad = room * max((hi - lo).max(), 1e-9)
    return lo - pad, hi + pad
