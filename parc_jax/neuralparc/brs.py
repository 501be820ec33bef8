"""Backward reachable sets: all (p0, k) of a cell whose predicted final state lies in the shrunken
goal.
"""

import numpy as np

from parc_jax.common import struct
from parc_jax.common.lp.status import LPStatus
from parc_jax.common.lp.witness import gamma
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.vertices import chebyshev_center
from parc_jax.neuralparc.cells import Cell
from parc_jax.neuralparc.decide import decide
from parc_jax.neuralparc.lp_batch import solve_batch


@struct.dataclass
class ReachSet:
    """Omega of one cell, or of r stacked ones with a leading axis.

    A: (h, n_p + n_k), b: (h,) rows over (p0, k). lo, hi: (n_p + n_k,) a box known to contain it.
    status: () LPStatus: FEASIBLE with `inner` (n_p + n_k,) a point well inside, INFEASIBLE if
        proved empty, or UNKNOWN.
    """

    A: np.ndarray
    b: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    status: np.ndarray
    inner: np.ndarray


def brs_rows(cell: Cell, goal: HPolytope, start: HPolytope | None, n_p: int) -> HPolytope:
    """Omega_r = {(p0, k): k in cell, p0 in start, (p0 + c_f(k), q(k)) in goal}. [NP, Sec. IV-C]

    cell: one, or r stacked. goal: shrunken goal over (p, q), b (g,), or (r, g) by cell. Offsets
    are rounded down: every point that satisfies the rows exactly reaches the goal by the exact map.
    """
    C, d = cell.final(goal.n)
    lead = C.shape[:-2]
    n_k = C.shape[-1]
    size = (np.abs(C) @ cell.largest_k[..., None])[..., 0] + np.abs(d)
    size = size @ np.abs(goal.A).T + np.abs(goal.b)
    goal_b = goal.b - d @ goal.A.T - gamma(2 * goal.n + n_k + 4) * size
    goal_p = np.broadcast_to(goal.A[:, :n_p], (*lead, len(goal.A), n_p))
    A = [
        np.concatenate([goal_p, goal.A @ C], axis=-1),
        np.concatenate([np.zeros((*cell.A.shape[:-1], n_p)), cell.A], axis=-1),
    ]
    b = [goal_b, cell.b]
    if start is not None:
        start_A = np.pad(start.A, ((0, 0), (0, n_k)))
        A.append(np.broadcast_to(start_A, (*lead, *start_A.shape)))
        b.append(np.broadcast_to(start.b, (*lead, len(start.b))))
    return HPolytope(np.concatenate(A, axis=-2), np.concatenate(b, axis=-1))


def brs_bounds(cell: Cell, goal_box: Box, n_p: int) -> tuple[np.ndarray, np.ndarray]:
    """Box (lo, hi) over (p0, k) around Omega: p0 = p_f - c_f(k) with p_f in the goal's box and k in
    the cell's bin.
    """
    C, d = cell.final(goal_box.n)
    low, high = offset_bounds(C[..., :n_p, :], d[..., :n_p], cell)
    goal_size = np.maximum(np.abs(goal_box.lo), np.abs(goal_box.hi))[:n_p]
    slack = gamma(4) * (goal_size + np.abs(low) + np.abs(high))
    lo = goal_box.lo[:n_p] - high - slack
    hi = goal_box.hi[:n_p] - low + slack
    return np.concatenate([lo, cell.lo], axis=-1), np.concatenate([hi, cell.hi], axis=-1)


def offset_bounds(C, d, cell: Cell) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of C k + d over the box of the cell, rounded outward. C (..., m, n_k), d (..., m)."""
    middle = (C @ (0.5 * (cell.lo + cell.hi))[..., None])[..., 0] + d
    radius = (np.abs(C) @ (0.5 * (cell.hi - cell.lo))[..., None])[..., 0]
    size = (np.abs(C) @ cell.largest_k[..., None])[..., 0] + np.abs(d)
    slack = gamma(2 * C.shape[-1] + 6) * size
    return middle - radius - slack, middle + radius + slack


def reach_set(
    cell: Cell, goal: HPolytope, goal_box: Box, start: HPolytope | None, n_p: int
) -> ReachSet:
    """Omega of one cell with its verdict, by one LP on the host. goal: shrunken, of the cell's
    bin.
    """
    rows = brs_rows(cell, goal, start, n_p)
    ball = chebyshev_center(rows)
    return ReachSet(
        rows.A, rows.b, *brs_bounds(cell, goal_box, n_p), np.int64(ball.status), ball.center
    )


def reach_sets(
    cells: Cell, goals: HPolytope, goal_box: Box, start: HPolytope | None, n_p: int
) -> ReachSet:
    """Omega of r stacked cells: by vertices where they decide, by one batched LP for the rest.

    goals: b of shape (n_bins, g), as `shrink` gives it for all bins.
    """
    rows = brs_rows(cells, HPolytope(goals.A, goals.b[cells.bin]), start, n_p)
    lo, hi = brs_bounds(cells, goal_box, n_p)
    status, inner = decide(rows, cells, goals, goal_box, start, n_p)
    left = np.flatnonzero(status == int(LPStatus.UNKNOWN))
    if len(left):
        status[left], inner[left] = _by_lp(rows.A[left], rows.b[left], lo[left], hi[left])
    return ReachSet(rows.A, rows.b, lo, hi, status, inner)


def _by_lp(A, b, lo, hi) -> tuple[np.ndarray, np.ndarray]:
    """Status (r,) and deepest point (r, n) of r polytopes A (r, h, n), b (r, h) inside boxes (r,
    n).
    """
    r, n = lo.shape
    # max radius over A x + |a| radius <= b: the deepest point, or a proof that even radius 0 has
    # none.
    with_radius = np.concatenate([A, np.linalg.norm(A, axis=2, keepdims=True)], axis=2)
    cost = np.zeros((r, n + 1))
    cost[:, n] = -1.0
    lower = np.c_[lo, np.zeros(r)]
    upper = np.c_[hi, (hi - lo).max(axis=1)]
    found = solve_batch(cost, with_radius, b, lower, upper)
    optimal = found.status == int(LPStatus.OPTIMAL)
    return np.where(optimal, int(LPStatus.FEASIBLE), found.status), found.x[:, :n]
