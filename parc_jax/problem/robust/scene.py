"""The scene under uncertainty: obstacles grow, the goal and the set of starts shrink. [T21]

Everything is computed in exact rationals and rounded once, to the safe side; for many polygons at
once in floats, whose rounding is paid for.
"""

from fractions import Fraction

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_down, round_up
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.sets.polygons import OFF, alike, corners_of_many
from parc_jax.common.sets.rational import exact_support, rational_vertices
from parc_jax.learning.network.predict import Layout
from parc_jax.problem.problem import Problem
from parc_jax.problem.uncertainty import Uncertainty

UP = 1 + 2.0**-50  # pays for a sum of two products


def robust_scene(
    problem: Problem, uncertainty: Uncertainty, layout: Layout, whole: bool = False
) -> Problem:
    """The plain problem that allows for uncertainty of start, goal and obstacles, but for the
    motion of the points before the end, for which the tube has to be wider. Raises InputError.

    whole: for that too; obstacles grow by the box of the start.
    """
    n_p, n_q = layout.n_p, problem.goal.n - layout.n_c
    start = uncertainty.shifts(n_p)
    seen_goal = uncertainty.of_goal(n_p, n_q)
    seen = uncertainty.of_obstacles(len(problem.obstacles))
    goal = _shrunken_goal(problem.goal, layout, start, seen_goal)
    starts = None if problem.start is None else _shrunken_start(problem.start, start)
    obstacles = list(problem.obstacles)
    if whole and start.any():
        obstacles = _around_box(obstacles, start)
    for j, by in enumerate(seen):
        if by is not None:
            obstacles[j] = _sum(obstacles[j], by, f"obstacle {j}")
    return problem.replace(goal=goal, obstacles=tuple(obstacles), start=starts, uncertainty=None)


def _shrunken_goal(
    goal: HPolytope, layout: Layout, start: np.ndarray, seen: np.ndarray
) -> HPolytope:
    """The goal where it is met from every start, however it was seen. All points move with the
    start, and with the goal, alike: of a row only the sum over the points counts.
    """
    if not (start.any() or seen.any()):
        return goal
    n_p, n_c = layout.n_p, layout.n_c
    widths = [Fraction(x) for x in np.concatenate([start + 0.0, np.zeros(goal.n - n_c)])]
    widths = [a + Fraction(b) for a, b in zip(widths, seen, strict=True)]
    rows = []
    for row in goal.A:
        sums = [sum(map(Fraction, filter(None, row[axis:n_c:n_p]))) for axis in range(n_p)]
        rows.append([*sums, *map(Fraction, row[n_c:])])
    shrunken = _less_a_box(goal, rows, widths)
    _require_room(shrunken, goal)
    return shrunken


def _require_room(shrunken: HPolytope, goal: HPolytope) -> None:
    """Raises InputError where two rows of the goal that face each other leave nothing."""
    rows = {tuple(row): i for i, row in enumerate(goal.A.tolist())}
    for i, row in enumerate(goal.A):
        j = rows.get(tuple((-row).tolist()))
        if j is not None and shrunken.b[i] + shrunken.b[j] < 0:
            wide, taken = goal.b[i] + goal.b[j], (goal.b - shrunken.b)[[i, j]].sum()
            raise InputError(
                f"uncertainty: expected less uncertainty of start and goal than the goal is wide; "
                f"row {i} of the goal leaves {wide:.3g}, and the uncertainty takes {taken:.3g} of "
                "it."
            )


def _shrunken_start(start: HPolytope, widths: np.ndarray) -> HPolytope:
    """Starts around which the whole box of doubt is allowed."""
    if not widths.any():
        return start
    rows = [[Fraction(x) for x in row] for row in start.A]
    return _less_a_box(start, rows, [Fraction(x) for x in widths])


def _less_a_box(given: HPolytope, rows, widths: list[Fraction]) -> HPolytope:
    """The set with every offset smaller by the support of a box of these half widths along its row
    (of `rows`, exact), rounded down.
    """
    bounds = []
    for row, bound in zip(rows, given.b, strict=True):
        support = sum((abs(a) * w for a, w in zip(row, widths, strict=True) if a), Fraction(0))
        bounds.append(round_down(Fraction(bound) - support))
    return given.replace(b=np.array(bounds))


def _around_box(obstacles: list[HPolytope], half: np.ndarray) -> list[HPolytope]:
    """All places of each obstacle that moves within half widths (n_p,) [m]: rows of both, as of
    `_sum`; where the corners of many are known at once, a few roundings larger.
    """
    known = corners_of_many(obstacles)
    out = [
        _sum(obstacle, from_box(box(-half, half)), f"obstacle {j}") if own is None else obstacle
        for j, (obstacle, own) in enumerate(zip(obstacles, known, strict=True))
    ]
    axes = np.concatenate([np.eye(2), -np.eye(2)])
    planar = [j for j, own in enumerate(known) if own is not None]
    for some, A, b in alike([obstacles[j] for j in planar]):
        corners = np.stack([known[planar[i]] for i in some])
        farther = np.nextafter(b + (np.abs(A) * half).sum(axis=2) * UP, np.inf)
        ends = np.concatenate([corners.max(axis=1), -corners.min(axis=1)], axis=1)
        off = 2 * OFF * np.abs(corners).max(axis=(1, 2))[:, None]
        beside = np.nextafter(ends + (np.tile(half, 2) + off) * UP, np.inf)
        there = (A[:, :, None] == axes).all(axis=3).any(axis=1)
        for i, rows, own, new, more in zip(some, A, farther, beside, ~there, strict=True):
            out[planar[i]] = HPolytope(
                np.concatenate([rows, axes[more]]), np.concatenate([own, new[more]])
            )
    return out


def _sum(obstacle: HPolytope, by: HPolytope, name: str) -> HPolytope:
    """All places of an obstacle: in the plane the sum itself, in space a little more than it (rows
    of both, without those that cross two edges). Offsets are rounded up.
    """
    corners = [rational_vertices(s, name) for s in (obstacle, by)]
    if not all(corners):
        raise InputError(
            f"{name}: expected sets with points in them, also of uncertainty; one is empty."
        )
    A = np.concatenate([obstacle.A, by.A])
    _, first = np.unique(A, axis=0, return_index=True)
    A = A[np.sort(first)]  # without normals that have come before
    offsets = [round_up(sum(exact_support(points, w) for points in corners)) for w in A]
    return hpolytope(A, np.array(offsets))
