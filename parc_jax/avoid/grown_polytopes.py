"""Grown obstacles O + (-B) + box(e) as explicit polytopes with fixed normals, as the published method needs them.

A disc body becomes the circumscribed polygon, so the sets are slightly larger than those of `grown`, never smaller.
"""

from fractions import Fraction

import numpy as np
from flax import struct

from parc_jax.error.tube import Tube
from parc_jax.errors import InputError
from parc_jax.lp.exact import round_up
from parc_jax.lp.witness import gamma
from parc_jax.problem import Disc, ReachAvoid
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.sets.rational import Point, convex_polygon, exact_support, rational_vertices

BODY_SIDES = 10  # of the polygon around a disc body, as published


@struct.dataclass
class GrownPolytopes:
    """All grown obstacles of a planar scene: o obstacles, T intervals, h rows, m corners. Padded rows read 0 <= 1.

    A: (o, h, 2) unit normals, shared by all intervals and bins. b: (n_bins, T, o, h) offsets, rounded up.
    corners: (o, m, 2) of obstacle + (-body), repeated to fill. error: (n_bins, T, 2) half widths of the error box.
    active: (o, T) bool.
    """

    A: np.ndarray
    b: np.ndarray
    corners: np.ndarray
    error: np.ndarray
    active: np.ndarray

    def at(self, bin_number: int, t: int, obstacle: int) -> HPolytope:
        """One grown obstacle, without padding."""
        rows = self.A[obstacle].any(axis=1)
        return HPolytope(self.A[obstacle][rows], self.b[bin_number, t, obstacle][rows])


def grown_polytopes(problem: ReachAvoid, tube: Tube) -> GrownPolytopes:
    """Grow every obstacle by the body and by the error of every interval and bin. Raises InputError off the plane."""
    n_steps, n_p = tube.interval.shape[1:]
    if n_p != 2:
        raise InputError(f"grown obstacles: expected a planar workspace; got {n_p} dimensions.")
    body_normals, body_corners = _body(problem)
    normals, reach, corners = [], [], []
    for obstacle in problem.obstacles:
        points = rational_vertices(obstacle)
        if not points:
            raise InputError("grown obstacles: expected obstacles with points in them; one is empty. Remove it.")
        w = _unit(np.concatenate([obstacle.A, body_normals, np.eye(2), -np.eye(2)]))
        normals.append(w)
        reach.append([round_up(exact_support(points, v) + exact_support(body_corners, v)) for v in w])
        sums = convex_polygon([(x + u, y + v) for x, y in points for u, v in body_corners])
        corners.append([[float(x), float(y)] for x, y in sums])
    height, width = max(map(len, normals), default=1), max(map(len, corners), default=1)
    count = len(problem.obstacles)
    A, base, corner = np.zeros((count, height, 2)), np.ones((count, height)), np.zeros((count, width, 2))
    active = np.zeros((count, n_steps), bool)
    for j in range(count):
        A[j, : len(normals[j])], base[j, : len(normals[j])] = normals[j], reach[j]
        corner[j] = corners[j] + [corners[j][-1]] * (width - len(corners[j]))
        first, last = problem.steps[j] if problem.steps and problem.steps[j] is not None else (0, n_steps - 1)
        active[j, first : last + 1] = True
    gain = np.einsum("btp,ohp->btoh", tube.interval, np.abs(A))
    b = np.nextafter(base + gain + gamma(6) * (np.abs(base) + gain), np.inf)
    return GrownPolytopes(A, b, corner, tube.interval, active)


def _body(problem: ReachAvoid) -> tuple[np.ndarray, list[Point]]:
    """Normals and exact corners of -body, or of a polygon around it."""
    if isinstance(problem.body, Disc):
        angle = 2 * np.pi * np.arange(BODY_SIDES) / BODY_SIDES
        normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        around = HPolytope(normals, np.nextafter(problem.body.radius * (1 + gamma(8)), np.inf) * np.ones(BODY_SIDES))
        return normals, rational_vertices(around)
    corners = convex_polygon([(-Fraction(float(x)), -Fraction(float(y))) for x, y in problem.body.vertices])
    points = np.array([[float(x), float(y)] for x, y in corners])
    edges = np.roll(points, -1, axis=0) - points
    return np.stack([edges[:, 1], -edges[:, 0]], axis=1)[edges.any(axis=1)], corners


def _unit(w: np.ndarray) -> np.ndarray:
    """Rows of length one (to rounding), in order, without repeats."""
    w = w[w.any(axis=1)]
    w = w / np.linalg.norm(w, axis=1, keepdims=True)
    distinct = [i for i in range(len(w)) if not (np.abs(w[:i] - w[i]) < 1e-14).all(axis=1).any()]
    return w[distinct]
