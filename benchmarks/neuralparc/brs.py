"""Backward reachable sets Omega: all (p0, k) of a cell whose predicted final state lies in the
shrunken goal. Whether one is empty is decided for most cells by their vertices alone.

An end coordinate is affine in k, so its range over a cell is the range over the vertices, exactly.
If a range misses the goal (less the start set, if there is one), the reach set is empty. If not, a
few parameters are tried: the middle of the cell, and points between it and the vertices where an
end coordinate is least and greatest, with the start that ends in the middle of the allowed range.
One that satisfies every row by more than rounding proves that the set has points. The rest is for
LPs.
"""

from typing import NamedTuple

import numpy as np

from benchmarks.neuralparc.cells import Cell
from benchmarks.neuralparc.lp_batch import solve_batch
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.lp_solve import LP_MARGIN
from parc_jax.common import struct
from parc_jax.common.lp.exact import gamma, row_bounds
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.tolerances import TOLERANCES

# of the common range of an end coordinate: where parameters are tried
_SHARES = np.array([0.1, 0.3, 0.5, 0.7, 0.9])


class Bounds(NamedTuple):
    """lo, hi (r, n): a box per cell."""

    lo: np.ndarray
    hi: np.ndarray


class EndRanges(NamedTuple):
    """End coordinates (p relative to the start, q) over r cells.

    least, most: (r, n_goal) over the vertices. slack: (r, n_goal) makes the range hold for the
    exact cell. at_vertices: (r, v, n_goal).
    """

    least: np.ndarray
    most: np.ndarray
    slack: np.ndarray
    at_vertices: np.ndarray


def decide(
    rows: HPolytope,
    cells: Cell,
    goals: HPolytope,
    goal_box: Box,
    start: HPolytope | None,
    n_p: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Verdicts on the reach sets {(p0, k) : rows} of r stacked cells, without LPs.

    rows: A (r, h, n_p + n_k), b (r, h), from `brs_rows`. goals: b (n_bins, g). goal_box: around the
    goal. Returns status (r,), UNKNOWN where an LP has to decide, and inner (r, n_p + n_k), a point
    inside or NaN.
    """
    # a box around the shrunken goal of every cell
    lo, hi = row_bounds(goals.A[None], goals.b)
    goal = Bounds(np.maximum(lo, goal_box.lo)[cells.bin], np.minimum(hi, goal_box.hi)[cells.bin])
    starts = Bounds(-np.inf, np.inf) if start is None else Bounds(*row_bounds(start.A, start.b))
    ends = _end_ranges(cells, goals.n)
    empty = _misses(ends, goal, starts, n_p)
    inner, fine = _inner_points(rows, cells, ends, goal, starts, n_p)
    status = np.where(empty, int(LPStatus.INFEASIBLE), int(LPStatus.UNKNOWN))
    return np.where(fine, int(LPStatus.FEASIBLE), status), inner


def _end_ranges(cells: Cell, n_goal: int) -> EndRanges:
    """Ranges of the end coordinates over the vertices of the cells."""
    C, d = cells.final(n_goal)
    at_vertices = cells.vertices @ C.swapaxes(1, 2) + d[:, None]
    size = (np.abs(C) @ cells.largest_k[..., None])[..., 0] + np.abs(d)
    moved = (np.abs(C) @ cells.slip[..., None])[..., 0] * 2
    slack = moved + gamma(2 * C.shape[-1] + 6) * size
    return EndRanges(at_vertices.min(axis=1), at_vertices.max(axis=1), slack, at_vertices)


def _misses(ends: EndRanges, goal: Bounds, starts: Bounds, n_p: int) -> np.ndarray:
    """(r,) bool: the cells with an end coordinate whose range misses the goal."""
    # The end is p0 + c_f, so c_f has to come between goal minus start; q has to come into the goal
    # itself.
    low = np.concatenate([goal.lo[:, :n_p] - starts.hi, goal.lo[:, n_p:]], axis=1)
    high = np.concatenate([goal.hi[:, :n_p] - starts.lo, goal.hi[:, n_p:]], axis=1)
    low = low - gamma(4) * np.abs(low)
    high = high + gamma(4) * np.abs(high)
    gap = np.maximum(ends.least - ends.slack - high, low - ends.most - ends.slack)
    outside = (gap > LP_MARGIN).any(axis=1)
    no_goal = (goal.lo - goal.hi > LP_MARGIN).any(axis=1)
    return outside | no_goal


def _inner_points(
    rows: HPolytope, cells: Cell, ends: EndRanges, goal: Bounds, starts: Bounds, n_p: int
) -> tuple[np.ndarray, np.ndarray]:
    """Best tried point (r, n_p + n_k), NaN where none is inside, and whether one is (r,)."""
    k = _parameters(cells, ends, goal, n_p)
    C, d = cells.final(goal.lo.shape[1])
    offset = k @ C[:, :n_p].swapaxes(1, 2) + d[:, None, :n_p]
    first = np.maximum(goal.lo[:, None, :n_p] - offset, starts.lo)
    last = np.minimum(goal.hi[:, None, :n_p] - offset, starts.hi)
    x = np.concatenate([0.5 * (first + last), k], axis=2)
    depth = _depth(rows, x)
    best = depth.argmax(axis=1)[:, None]
    fine = np.take_along_axis(depth, best, axis=1)[:, 0] > TOLERANCES.lp_feasible
    deepest = np.take_along_axis(x, best[..., None], axis=1)[:, 0]
    return np.where(fine[:, None], deepest, np.nan), fine


def _parameters(cells: Cell, ends: EndRanges, goal: Bounds, n_p: int) -> np.ndarray:
    """Parameters (r, s, n_k) to try: the middle, and towards the extremes of each coordinate q."""
    middle = cells.vertices.mean(axis=1)
    tried = [middle[:, None]]
    C, d = cells.final(goal.lo.shape[1])
    at_middle = (C[:, n_p:] @ middle[..., None])[..., 0] + d[:, n_p:]
    for j in range(n_p, C.shape[1]):
        here = at_middle[:, j - n_p, None]
        low = np.maximum(goal.lo[:, j], ends.least[:, j])[:, None]
        high = np.minimum(goal.hi[:, j], ends.most[:, j])[:, None]
        wanted = low + _SHARES * (high - low)  # (r, s)
        up = wanted > here
        at = ends.at_vertices[..., j]
        vertex = np.where(up, at.argmax(axis=1)[:, None], at.argmin(axis=1)[:, None])
        gap = np.where(up, ends.most[:, j, None], ends.least[:, j, None]) - here
        share = np.clip((wanted - here) / np.where(gap == 0, 1.0, gap), 0.0, 1.0)[..., None]
        corner = np.take_along_axis(cells.vertices, vertex[..., None], axis=1)
        tried.append((1 - share) * middle[:, None] + share * corner)
    return np.concatenate(tried, axis=1)


def _depth(rows: HPolytope, x: np.ndarray) -> np.ndarray:
    """How far points x (r, s, n) lie inside the rows, less its rounding: (r, s) [row lengths],
    negative outside.
    """
    A = rows.A.swapaxes(1, 2)
    b = rows.b[:, None]
    length = np.linalg.norm(rows.A, axis=2)[:, None]
    slack = gamma(x.shape[2] + 2) * (np.abs(x) @ np.abs(A) + np.abs(b))
    inside = b - x @ A - slack
    return (inside / np.where(length > 0, length, 1.0)).min(axis=2)


@struct.dataclass
class ReachSet:
    """Omega of one cell, or of r stacked ones with a leading axis.

    A: (h, n_p + n_k), b: (h,) rows over (p0, k). lo, hi: (n_p + n_k,) a box that contains it.
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
    lead, n_k = C.shape[:-2], C.shape[-1]
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
    """Status (r,) and deepest point (r, n) of r polytopes A (r, h, n), b (r, h) inside boxes."""
    r, n = lo.shape
    # max radius over A x + |a| radius <= b: the deepest point, or a proof that radius 0 has none
    with_radius = np.concatenate([A, np.linalg.norm(A, axis=2, keepdims=True)], axis=2)
    cost = np.zeros((r, n + 1))
    cost[:, n] = -1.0
    lower = np.c_[lo, np.zeros(r)]
    upper = np.c_[hi, (hi - lo).max(axis=1)]
    found = solve_batch(cost, with_radius, b, lower, upper)
    optimal = found.status == int(LPStatus.OPTIMAL)
    return np.where(optimal, int(LPStatus.FEASIBLE), found.status), found.x[:, :n]
