"""Does the hull of some points, grown by a radius, touch a convex obstacle? By separating axes: in
the plane for any two polygons, in space for boxes.
"""

import itertools
from typing import NamedTuple

import numpy as np

from benchmarks.suite.bad import Refused

EDGES_OF_BOX = ((0, 4), (0, 2), (0, 1))  # three edges of eight corners in `itertools.product` order
CHUNK = 1 << 16  # poses at a time


class Obstacle(NamedTuple):
    """A convex obstacle: its vertices (v, d) [m], unit normals (a, d) of its faces, and the box
    (2, d) around it.
    """

    vertices: np.ndarray
    normals: np.ndarray
    around: np.ndarray


def block(bounds: np.ndarray) -> Obstacle:
    """The box between bounds (2, d) [m]."""
    corners = np.array(list(itertools.product(*bounds.T)))
    return Obstacle(corners, np.eye(bounds.shape[1]), bounds)


def hull(vertices: np.ndarray) -> Obstacle:
    """The hull of vertices (v, 2) [m] in the plane. Raises Refused."""
    if vertices.ndim != 2 or vertices.shape[1] != 2 or len(vertices) < 3:
        raise Refused(f"obstacle: expected three vertices (x, y) or more; got {vertices.shape}.")
    normals = _across(_pairs(vertices))
    return Obstacle(vertices, normals, np.stack([vertices.min(axis=0), vertices.max(axis=0)]))


def touched(p: np.ndarray, obstacle: Obstacle, radius: float) -> np.ndarray:
    """Which of the runs p (n, t, points, d) [m] touch the obstacle at any record?"""
    n, t = p.shape[:2]
    poses = p.reshape(n * t, *p.shape[2:])
    middle = poses.mean(axis=1)
    reach = np.sqrt(((poses - middle[:, None]) ** 2).sum(axis=-1).max(axis=1)) + radius
    away = np.maximum(obstacle.around[0] - middle, middle - obstacle.around[1])
    near = np.flatnonzero((np.maximum(away, 0.0) ** 2).sum(axis=-1) <= reach**2)
    found = np.zeros(n, bool)
    for first in range(0, len(near), CHUNK):
        some = near[first : first + CHUNK]
        found[some[gap(poses[some], obstacle, radius) <= radius] // t] = True
    return found


def gap(poses: np.ndarray, obstacle: Obstacle, radius: float = 0.0) -> np.ndarray:
    """(n,) [m] from the hulls of poses (n, points, d) to an obstacle; not positive where they
    touch. With radius 0 it may be less than the distance of what is apart. Raises Refused in space
    for anything but boxes without a radius.
    """
    n, points, d = poses.shape
    axes = [np.broadcast_to(obstacle.normals, (n, *obstacle.normals.shape))]
    if d == 2:
        axes.append(_across(_pairs(poses)))
        if radius > 0:
            apart = poses[:, :, None] - obstacle.vertices
            axes.append(_unit(apart.reshape(n, -1, 2)))
    else:
        if points != 8 or radius > 0 or len(obstacle.normals) != 3:
            raise Refused("contact: expected boxes of eight corners without a radius in space.")
        edges = np.stack([poses[:, j] - poses[:, i] for i, j in EDGES_OF_BOX], axis=1)
        crossed = np.cross(edges[:, :, None], obstacle.normals)
        axes += [_unit(edges), _unit(crossed.reshape(n, -1, 3))]
    w = np.concatenate(axes, axis=1)
    ours, theirs = w @ poses.swapaxes(1, 2), w @ obstacle.vertices.T
    beyond = theirs.min(axis=-1) - ours.max(axis=-1)
    before = ours.min(axis=-1) - theirs.max(axis=-1)
    return np.maximum(beyond, before).max(axis=1)


def _pairs(points: np.ndarray) -> np.ndarray:
    """Differences (..., pairs, d) of all pairs of points (..., n, d)."""
    i, j = np.triu_indices(points.shape[-2], 1)
    return points[..., j, :] - points[..., i, :]


def _across(v: np.ndarray) -> np.ndarray:
    """Unit vectors at right angles to v (..., 2)."""
    return _unit(np.stack([-v[..., 1], v[..., 0]], axis=-1))


def _unit(v: np.ndarray) -> np.ndarray:
    """v (..., d) of length 1; zero, which separates nothing, where there is no direction."""
    length = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    return v / np.where(length > 1e-12, length, np.inf)
