"""The published decisions with LPs: one per Omega, one per avoid set for emptiness, one per avoid
set and sample.

Backward avoid sets as AH-polytopes: the starts from which the swept prediction can meet an
obstacle.

For interval t, obstacle O~ and cell R the published theorem takes J_s = {(p0, k): k in R, p0 +
c_s(k) in O~} at both knots, projects both to the workspace and takes the convex hull. Projecting
the hull gives the same set, and not projecting it at all gives the smaller joint set, which keeps
k. [NP, Thm. 1] [T13]
"""

import enum

import numpy as np

from parc_jax.common.lp.exact import gamma, row_bounds
from parc_jax.common.lp.program import LPStatus
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.neuralparc.answer import Tally
from parc_jax.neuralparc.brs import ReachSet, offset_bounds, reach_set
from parc_jax.neuralparc.cells import Cell
from parc_jax.neuralparc.scene import PaperScene
from parc_jax.neuralparc.sets.affine import AHPolytope, convex_hull, intersection, projection
from parc_jax.neuralparc.sets.membership import find_point, membership


def knot_set(cell: Cell, obstacle: HPolytope, s: int, start: HPolytope | None = None) -> AHPolytope:
    """J_s: all (p0, k) of the cell that are inside the grown obstacle at knot s. Offsets are
    rounded up.

    The theorem needs p0 unrestricted: the path from p0 meets the obstacle at p0 + something, and
    the starts that are inside it at the knots may lie outside P0. `start` restricts them all the
    same, for parity with published code only.
    """
    n_p = obstacle.n
    n_k = cell.A.shape[1]
    C, d = cell.knot(s, n_p)
    size = np.abs(obstacle.A) @ (np.abs(C) @ cell.largest_k + np.abs(d)) + np.abs(obstacle.b)
    offset = obstacle.b - obstacle.A @ d + gamma(2 * n_p + n_k + 4) * size
    A = [
        np.concatenate([obstacle.A, obstacle.A @ C], axis=1),
        np.pad(cell.A, ((0, 0), (n_p, 0))),
    ]
    b = [offset, cell.b]
    if start is not None:
        A.append(np.pad(start.A, ((0, 0), (0, n_k))))
        b.append(start.b)
    lo, hi = _bounds(cell, obstacle, C, d)
    n = n_p + n_k
    return AHPolytope(np.eye(n), np.zeros(n), np.concatenate(A), np.concatenate(b), lo, hi)


def avoid_set(
    cell: Cell, obstacle: HPolytope, t: int, start: HPolytope | None = None
) -> AHPolytope:
    """Lambda_P of interval t: every p0 from which some k of the cell may collide, and more. A set
    in the workspace.

    obstacle: grown by body and by the error of interval t.
    """
    return projection(joint_avoid_set(cell, obstacle, t, start), np.arange(obstacle.n))


def joint_avoid_set(
    cell: Cell, obstacle: HPolytope, t: int, start: HPolytope | None = None
) -> AHPolytope:
    """Lambda_J of interval t over (p0, k): contains every colliding (p0, k), lies within Lambda_P x
    cell. [T13]
    """
    return convex_hull(knot_set(cell, obstacle, t, start), knot_set(cell, obstacle, t + 1, start))


def within_reach(avoid: AHPolytope, reach: ReachSet) -> AHPolytope:
    """Lambda_P cut by the workspace shadow of Omega: empty means that no start of Omega can collide
    here.
    """
    n_p = avoid.n
    n = reach.A.shape[1]
    shadow = AHPolytope(np.eye(n_p, n), np.zeros(n_p), reach.A, reach.b, reach.lo, reach.hi)
    return intersection(avoid, shadow)


def _bounds(cell: Cell, obstacle: HPolytope, C, d) -> tuple[np.ndarray, np.ndarray]:
    """Box around J_s from the obstacle's box (it has axis normals) and the cell's bin."""
    lo, hi = row_bounds(obstacle.A, obstacle.b)
    low, high = offset_bounds(C, d, cell)
    bounded = np.isfinite(lo) & np.isfinite(hi)
    size = np.where(bounded, np.maximum(np.abs(lo), np.abs(hi)), 0.0)
    slack = gamma(4) * (size + np.abs(low) + np.abs(high))
    return np.r_[lo - high - slack, cell.lo], np.r_[hi - low + slack, cell.hi]


class Fault(enum.Enum):
    """Faults of published code that a caller may ask for, for parity. Each makes the answer
    "assumed".
    """

    TROUBLE_IS_SAFE = "an undecided LP counts as empty or not contained [A5]"
    START_BEFORE_HULL = "starts outside P0 are cut off before the hull is taken [A6]"


def reach_by_lp(cell: Cell, scene: PaperScene) -> ReachSet:
    """Omega of one cell."""
    goal = HPolytope(scene.goals.A, scene.goals.b[cell.bin])
    return reach_set(cell, goal, scene.goal_box, scene.start, scene.n_p)


def avoid_by_lp(
    cell: Cell, reach: ReachSet, scene: PaperScene, faults: frozenset[Fault], tally: Tally
) -> list[AHPolytope]:
    """Avoid sets of one cell, all intervals and obstacles, less those proved disjoint from the
    shadow of its Omega.
    """
    start = scene.start if Fault.START_BEFORE_HULL in faults else None
    kept = []
    for t, j in np.argwhere(scene.grown.active.T).tolist():
        avoid = avoid_set(cell, scene.grown.at(int(cell.bin), t, j), t, start)
        tally.avoid_sets += 1
        if _proved(find_point(within_reach(avoid, reach)).status, faults, tally):
            tally.avoid_empty += 1
        else:
            kept.append(avoid)
    return kept


def safe_by_lp(
    p0: np.ndarray, avoid_sets: list[AHPolytope], faults: frozenset[Fault], tally: Tally
) -> np.ndarray:
    """Which starts p0 (s, n_p) are proved outside every avoid set: (s,) bool."""
    safe = np.ones(len(p0), bool)
    for i, x in enumerate(p0):
        safe[i] = all(_proved(membership(avoid, x).status, faults, tally) for avoid in avoid_sets)
    return safe


def _proved(status: LPStatus, faults: frozenset[Fault], tally: Tally) -> bool:
    """Only a proof says empty or outside, unless the fault [A5] was asked for."""
    undecided = status is LPStatus.UNKNOWN
    tally.unknown += undecided
    assumed = undecided and Fault.TROUBLE_IS_SAFE in faults
    return status is LPStatus.INFEASIBLE or assumed
