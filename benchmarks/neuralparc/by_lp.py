"""The published decisions by LPs: one per reach set Omega, one per avoid set for emptiness, one per
avoid set and sample.

Avoid sets are AH-polytopes: the starts from which the swept prediction can meet an obstacle. For
interval t, grown obstacle O and cell R the theorem takes J_s = {(p0, k): k in R, p0 + c_s(k) in O}
at both knots, projects both to the workspace and takes the convex hull. To project the hull gives
the same set; without the projection it is the smaller joint set, which keeps k. [NP, Thm. 1] [T13]
"""

import numpy as np

from benchmarks.neuralparc.brs import ReachSet, brs_bounds, brs_rows, offset_bounds
from benchmarks.neuralparc.cells import Cell
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.scene import PaperScene, Tally
from benchmarks.neuralparc.sets.affine import (
    AHPolytope,
    convex_hull,
    find_point,
    intersection,
    membership,
    projection,
)
from parc_jax.common.lp.exact import gamma, row_bounds
from parc_jax.common.sets.extent import chebyshev_center
from parc_jax.common.sets.hpolytope import HPolytope


def knot_set(cell: Cell, obstacle: HPolytope, s: int) -> AHPolytope:
    """J_s: all (p0, k) of the cell inside the grown obstacle at knot s; offsets are rounded up.

    p0 is not restricted to the start set before the hull is taken, as published code does: a path
    that meets the obstacle between two knots would be lost [A6].
    """
    n_p, n_k = obstacle.n, cell.A.shape[1]
    C, d = cell.knot(s, n_p)
    size = np.abs(obstacle.A) @ (np.abs(C) @ cell.largest_k + np.abs(d)) + np.abs(obstacle.b)
    offset = obstacle.b - obstacle.A @ d + gamma(2 * n_p + n_k + 4) * size
    inside = np.concatenate([obstacle.A, obstacle.A @ C], axis=1)
    A = np.concatenate([inside, np.pad(cell.A, ((0, 0), (n_p, 0)))])
    n = n_p + n_k
    bounds = _bounds(cell, obstacle, C, d)
    return AHPolytope(np.eye(n), np.zeros(n), A, np.r_[offset, cell.b], *bounds)


def _bounds(cell: Cell, obstacle: HPolytope, C, d) -> tuple[np.ndarray, np.ndarray]:
    """Box around J_s from the obstacle's box (it has axis normals) and the cell's bin."""
    lo, hi = row_bounds(obstacle.A, obstacle.b)
    low, high = offset_bounds(C, d, cell)
    bounded = np.isfinite(lo) & np.isfinite(hi)
    size = np.where(bounded, np.maximum(np.abs(lo), np.abs(hi)), 0.0)
    slack = gamma(4) * (size + np.abs(low) + np.abs(high))
    return np.r_[lo - high - slack, cell.lo], np.r_[hi - low + slack, cell.hi]


def joint_avoid_set(cell: Cell, obstacle: HPolytope, t: int) -> AHPolytope:
    """Lambda_J of interval t over (p0, k): contains every colliding (p0, k), lies within Lambda_P x
    cell. [T13]
    """
    return convex_hull(knot_set(cell, obstacle, t), knot_set(cell, obstacle, t + 1))


def avoid_set(cell: Cell, obstacle: HPolytope, t: int) -> AHPolytope:
    """Lambda_P of interval t: every p0 from which some k of the cell may collide, and more. A set
    in the workspace.

    obstacle: grown by body and by the error of interval t.
    """
    return projection(joint_avoid_set(cell, obstacle, t), np.arange(obstacle.n))


def within_reach(avoid: AHPolytope, reach: ReachSet) -> AHPolytope:
    """Lambda_P cut by the workspace shadow of Omega: empty means that no start of Omega can collide
    here.
    """
    n_p = avoid.n
    n = reach.A.shape[1]
    shadow = AHPolytope(np.eye(n_p, n), np.zeros(n_p), reach.A, reach.b, reach.lo, reach.hi)
    return intersection(avoid, shadow)


def reach_by_lp(cell: Cell, scene: PaperScene) -> ReachSet:
    """Omega of one cell, with its verdict."""
    goal = HPolytope(scene.goals.A, scene.goals.b[cell.bin])
    rows = brs_rows(cell, goal, scene.start, scene.n_p)
    ball, bounds = chebyshev_center(rows), brs_bounds(cell, scene.goal_box, scene.n_p)
    empty = LPStatus.INFEASIBLE if ball.radius == -np.inf else LPStatus.UNKNOWN
    status = LPStatus.FEASIBLE if ball.radius >= 0 else empty
    return ReachSet(rows.A, rows.b, *bounds, np.int64(status), ball.center)


def avoid_by_lp(cell: Cell, reach: ReachSet, scene: PaperScene, tally: Tally) -> list[AHPolytope]:
    """Avoid sets of one cell, all intervals and obstacles, less those proved disjoint from the
    shadow of its Omega.
    """
    intervals = np.argwhere(scene.grown.active.T).tolist()
    every = (avoid_set(cell, scene.grown.at(int(cell.bin), t, j), t) for t, j in intervals)
    return [a for a in every if not _proved(find_point(within_reach(a, reach)).status, tally)]


def safe_by_lp(p0: np.ndarray, avoid_sets: list[AHPolytope], tally: Tally) -> np.ndarray:
    """Which starts p0 (s, n_p) are proved outside every avoid set: (s,) bool."""
    safe = [all(_proved(membership(avoid, x).status, tally) for avoid in avoid_sets) for x in p0]
    return np.array(safe, bool)


def _proved(status: LPStatus, tally: Tally) -> bool:
    """Only a proof says empty or outside: an undecided LP says neither [A5]."""
    tally.unknown += status is LPStatus.UNKNOWN
    return status is LPStatus.INFEASIBLE
