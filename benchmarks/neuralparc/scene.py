"""A problem lowered for the published method: shrunken goals, and grown obstacles O + (-B) + box(e)
as polytopes with fixed normals, per bin and interval.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from benchmarks.neuralparc.sets.operations import shrink
from parc_jax.common import struct
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import gamma, round_up
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.extent import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.rational import Point, convex_polygon, exact_support, rational_vertices
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.bound.tube import Tube
from parc_jax.problem.body import Body, Disc
from parc_jax.problem.problem import Problem

BODY_SIDES = 10  # of the polygon around a disc body, as published


@struct.dataclass
class GrownPolytopes:
    """All grown obstacles of a planar scene: o obstacles, T intervals, h rows, m corners. Padded
    rows read 0 <= 1.

    A: (o, h, 2) unit normals, shared by all intervals and bins. b: (n_bins, T, o, h) offsets,
        rounded up.
    corners: (o, m, 2) of obstacle + (-body), repeated to fill. error: (n_bins, T, 2) half widths of
        the error box.
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


def grown_polytopes(problem: Problem, tube: Tube) -> GrownPolytopes:
    """Grow every obstacle by the body and by the error of every interval and bin. Raises InputError
    off the plane.
    """
    if tube.n_p != 2:
        raise InputError(f"grown obstacles: expected the plane; got {tube.n_p} dimensions.")
    n_steps, body = tube.n_steps, _body(problem)
    grown = [_grow(obstacle, *body) for obstacle in problem.obstacles]
    o = len(grown)
    height = max((len(one.normals) for one in grown), default=1)
    width = max((len(one.corners) for one in grown), default=1)
    A = np.zeros((o, height, 2))
    base = np.ones((o, height))
    corners = np.zeros((o, width, 2))
    active = np.zeros((o, n_steps), bool)
    for j, (one, span) in enumerate(zip(grown, problem.all_spans, strict=True)):
        A[j, : len(one.normals)] = one.normals
        base[j, : len(one.normals)] = one.offsets
        corners[j] = one.corners + [one.corners[-1]] * (width - len(one.corners))
        first, last = span or (0, n_steps - 1)
        active[j, first : last + 1] = True
    gain = np.einsum("btp,ohp->btoh", tube.interval, np.abs(A))
    b = np.nextafter(base + gain + gamma(6) * (np.abs(base) + gain), np.inf)
    return GrownPolytopes(A, b, corners, tube.interval, active)


class _Grown(NamedTuple):
    """One obstacle + (-body): unit normals (h, 2), offsets (h,) rounded up, corners (m, 2)."""

    normals: np.ndarray
    offsets: list[float]
    corners: list[list[float]]


def _grow(obstacle: HPolytope, body_normals: np.ndarray, body_corners: list[Point]) -> _Grown:
    points = rational_vertices(obstacle)
    if not points:
        raise InputError(
            "grown obstacles: expected obstacles with points in them; one is empty. Remove it."
        )
    normals = _unit(np.concatenate([obstacle.A, body_normals, np.eye(2), -np.eye(2)]))
    offsets = [round_up(exact_support(points, w) + exact_support(body_corners, w)) for w in normals]
    sums = convex_polygon([(x + u, y + v) for x, y in points for u, v in body_corners])
    return _Grown(normals, offsets, [[float(x), float(y)] for x, y in sums])


def _body(problem: Problem) -> tuple[np.ndarray, list[Point]]:
    """Normals and exact corners of -body; of a disc those of a polygon around it, which makes the
    sets slightly larger, never smaller.
    """
    if isinstance(problem.body, Disc):
        angle = 2 * np.pi * np.arange(BODY_SIDES) / BODY_SIDES
        normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        radius = np.nextafter(problem.body.radius * (1 + gamma(8)), np.inf)
        around = HPolytope(normals, np.full(BODY_SIDES, radius))
        return normals, rational_vertices(around)
    corners = convex_polygon(
        [(-Fraction(float(x)), -Fraction(float(y))) for x, y in problem.body.vertices]
    )
    points = np.array([[float(x), float(y)] for x, y in corners])
    edges = np.roll(points, -1, axis=0) - points
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    return normals[edges.any(axis=1)], corners


def _unit(w: np.ndarray) -> np.ndarray:
    """Rows of length one (to rounding), in order, without repeats."""
    w = w[w.any(axis=1)]
    w = w / np.linalg.norm(w, axis=1, keepdims=True)
    distinct = [i for i in range(len(w)) if not (np.abs(w[:i] - w[i]) < 1e-14).all(axis=1).any()]
    return w[distinct]


@dataclass
class Tally:
    """Counts of a search: regions visited, and LPs that stayed undecided."""

    regions: int = 0
    unknown: int = 0


class PaperScene(NamedTuple):
    """A problem for the search.

    goals: shrunken goals over (p, q), b of shape (n_bins, g). goal_box: around the goal.
    grown: obstacles. start: P0 or None. n_k: number of parameters.
    """

    goals: HPolytope
    goal_box: Box
    grown: GrownPolytopes
    start: HPolytope | None
    n_k: int

    @property
    def n_p(self) -> int:
        """Workspace dimension."""
        return self.grown.corners.shape[-1]


def paper_scene(problem: Problem, tube: Tube) -> PaperScene:
    """Shrink the goal and grow the obstacles, for every bin and interval. Raises InputError."""
    boxes = isinstance(tube.errors, ErrorBox)
    if tube.n_points > 1 or tube.n_p != 2 or not boxes or isinstance(problem.body, Body):
        raise InputError(
            "published method: expected one point in the plane with a disc or a polygon that does "
            f"not turn, and a tube of boxes; got {tube.n_points} points in {tube.n_p} dimensions "
            f"with {problem.body!r}. Use the method Exact()."
        )
    n_goal = tube.n_p + tube.n_q
    if problem.goal.n != n_goal:
        raise InputError(
            f"goal: expected {n_goal} dimensions (p, q), as the tube has; got {problem.goal.n}."
        )
    goal_box = bounding_box(problem.goal)
    if not (np.isfinite(goal_box.lo).all() and np.isfinite(goal_box.hi).all()):
        raise InputError(
            "goal: expected a bounded set; its rows leave a direction open. Add the missing rows."
        )
    interval, final = tube.finite_widths
    goals = shrink(problem.goal, final)
    grown = grown_polytopes(problem, tube.replace(interval=interval, final=final))
    return PaperScene(goals, goal_box, grown, problem.start, len(tube.edges))
