"""What is drawn of a manoeuvre, as triangles in the world: where the body goes, what stands there.
Pictures only: corners are rounded, and what lies far away is cut off.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from parc_jax.app.plot.shapes import hull, linked, part_outline, placed
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.polygons import corners_of_many
from parc_jax.common.sets.qhull import convex_hull
from parc_jax.common.sets.vertices import vertices
from parc_jax.problem.body import Disc, Part
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.pose import Pose

VIEW = 20.0  # [m] around a manoeuvre that is drawn


def in_world(points: np.ndarray, pose: Pose | None) -> np.ndarray:
    """Points (..., n_p) told from a pose with a heading, as (..., 3) in the world."""
    if pose is not None and pose.heading is not None:
        points = placed(points, pose.place, pose.heading)
    return np.concatenate([points, np.zeros((*points.shape[:-1], 3 - points.shape[-1]))], axis=-1)


def headings(places: np.ndarray, pose: Pose | None) -> np.ndarray:
    """(T + 1,) [rad] by which the points (T + 1, m, n_p) of a body have turned, from the pose's;
    one point alone has no heading of its own, and is drawn with that of the start.
    """
    begin = 0.0 if pose is None or pose.heading is None else pose.heading
    if places.shape[1] < 2 or places.shape[2] != 2:
        return np.full(len(places), begin)
    own = places - places.mean(axis=1, keepdims=True)
    x, y = own[0, :, 0], own[0, :, 1]
    across = (x * own[..., 1] - y * own[..., 0]).sum(axis=1)
    along = (x * own[..., 0] + y * own[..., 1]).sum(axis=1)
    return begin + np.arctan2(across, along)


def obstacle_triangles(obstacles: Sequence[HPolytope], about: np.ndarray) -> np.ndarray:
    """(t, 3, n_p) of the obstacles, near places (..., n_p)."""
    flat = about.reshape(-1, about.shape[-1])
    lo, hi = flat.min(axis=0) - VIEW, flat.max(axis=0) + VIEW
    eye = np.eye(len(lo))
    cut = [
        HPolytope(np.concatenate([o.A, eye, -eye]), np.concatenate([o.b, hi, -lo]))
        for o in obstacles
    ]
    known = corners_of_many(cut)
    drawn = [
        triangles(vertices(poly) if corners is None else corners)
        for poly, corners in zip(cut, known, strict=True)
    ]
    return np.concatenate([np.zeros((0, 3, len(lo))), *drawn])


def goal_triangles(problem: Problem, n_p: int) -> np.ndarray:
    """(t, 3, n_p) where the first reference point is to end; none where that is not bounded."""
    try:
        part, at = linked(problem.goal, range(n_p))
        return triangles(vertices(part)[:, at])
    except InputError:
        return np.zeros((0, 3, n_p))


def body_triangles(parts: Sequence[Part], places: np.ndarray) -> np.ndarray:
    """(t, 3, n_p) of the parts of a body while its reference points are at places (m, n_p)."""
    return _reached(parts, places[:, None])


def tube_triangles(parts: Sequence[Part], places: np.ndarray, tube: np.ndarray) -> np.ndarray:
    """(t, 3, n_p): all that the body may reach of a path (T + 1, m, n_p) with the half widths
    (T, m, n_p) of its tube, interval by interval; none of an interval without a claim.
    """
    signs = _signs(places.shape[2])[:, None, None]
    found = [np.zeros((0, 3, places.shape[2]))]
    for t, half in enumerate(tube):
        if np.isfinite(half).all():
            corners = places[t : t + 2] + signs * half  # (corner, knot, m, n_p)
            own = np.moveaxis(corners, 2, 0).reshape(places.shape[1], -1, places.shape[2])
            found.append(_reached(parts, own))
    return np.concatenate(found)


def _reached(parts: Sequence[Part], places: np.ndarray) -> np.ndarray:
    """(t, 3, n_p) of a body each of whose points is anywhere in the hull of places (m, v, n_p)."""
    grown = [_grown(part, np.concatenate(places[list(part.points)])) for part in parts]
    return np.concatenate([triangles(points) for points in grown])


def _grown(part: Part, places: np.ndarray) -> np.ndarray:
    """Points (v, n_p) whose hull is a part of the body with its reference points at places; a ball
    in space is drawn as the cube around it.
    """
    n_p = places.shape[1]
    if n_p == 2:
        return part_outline(part, places)
    ball = isinstance(part.shape, Disc)
    around = part.shape.radius * _signs(n_p) if ball else part.shape.vertices
    return (places[:, None] + around).reshape(-1, n_p)


def _signs(n_p: int) -> np.ndarray:
    """(2^n_p, n_p) corners of the cube of half width 1."""
    return np.array(list(itertools.product((-1.0, 1.0), repeat=n_p)))


def triangles(points: np.ndarray) -> np.ndarray:
    """(t, 3, n_p) of the convex hull of points (v, n_p): the area in the plane, the surface in
    space. A flat one has none.
    """
    n_p = points.shape[1]
    if len(points) <= n_p:
        return np.zeros((0, 3, n_p))
    if n_p == 2:
        around = hull(points)
        fan = [around[[0, i, i + 1]] for i in range(1, len(around) - 1)]
        return np.array(fan).reshape(-1, 3, 2)
    found = convex_hull(points)
    return np.zeros((0, 3, n_p)) if found is None else points[found.simplices]
