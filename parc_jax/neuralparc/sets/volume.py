"""Volumes and triangulations of polytopes given by their vertices."""

import math

import numpy as np

from parc_jax.common.sets.qhull import delaunay


def simplex_volumes(simplices: np.ndarray) -> np.ndarray:
    """Volumes of simplices (..., n + 1, n): (...)."""
    n = simplices.shape[-1]
    return np.abs(np.linalg.det(simplices[..., 1:, :] - simplices[..., :1, :])) / math.factorial(n)


def triangulate(points: np.ndarray) -> np.ndarray:
    """Simplices (s, n + 1, n) with disjoint interiors that fill the hull of points (v, n); s = 0
    for a flat hull.
    """
    n = points.shape[1]
    if n == 1:
        ends = np.array([[points.min()], [points.max()]]) if len(points) else np.zeros((2, 1))
        return ends[None] if ends[1, 0] > ends[0, 0] else np.zeros((0, 2, 1))
    if len(points) <= n:
        return np.zeros((0, n + 1, n))
    centre = points.mean(axis=0)
    scale = np.ptp(points, axis=0)
    if not (scale > 0).all():
        return np.zeros((0, n + 1, n))
    corners = delaunay((points - centre) / scale)  # thin sets triangulate like round ones
    if corners is None:
        return np.zeros((0, n + 1, n))
    simplices = points[corners]
    return simplices[simplex_volumes(simplices) > 0]


def volume(points: np.ndarray) -> float:
    """Volume of the hull of points (v, n); 0 for a flat or empty one."""
    return float(simplex_volumes(triangulate(points)).sum())
