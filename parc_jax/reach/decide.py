"""Is a backward reachable set empty? Decided for most pieces by their vertices alone, without a linear program.

An end coordinate is affine in k, so its range over a piece is the range over the vertices, exactly. If a range misses
what the goal (and the start set, if there is one) asks for, the reach set is empty. If not, a few parameters are tried:
the middle of the piece, and points between it and the vertices where an end coordinate is least and greatest, with the
start that ends in the middle of what is allowed. One that satisfies every row by more than rounding proves that the set
has points. The rest is for LPs.
"""

import numpy as np

from parc_jax.lp.status import LPStatus
from parc_jax.lp.witness import gamma, row_bounds
from parc_jax.reach.pieces import Piece
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.tolerances import TOLERANCES

_SHARES = np.array([0.1, 0.3, 0.5, 0.7, 0.9])  # of the common range of an end coordinate: where parameters are tried


def decide(rows: HPolytope, pieces: Piece, goals: HPolytope, goal_box: Box, start: HPolytope | None, n_p: int):
    """Verdicts on the reach sets {(p0, k) : rows} of r stacked pieces, without LPs.

    rows: A (r, h, n_p + n_k), b (r, h), from `brs_rows`. goals: b (n_bins, g). goal_box: around the goal.
    Returns status (r,), UNKNOWN where an LP has to decide, and inner (r, n_p + n_k), a point inside or NaN.
    """
    lo, hi = row_bounds(goals.A[None], goals.b)
    lo, hi = np.maximum(lo, goal_box.lo)[pieces.bin], np.minimum(hi, goal_box.hi)[pieces.bin]
    least, most, slack, at = _end_ranges(pieces, goals.n)
    first, last = (-np.inf, np.inf) if start is None else row_bounds(start.A, start.b)
    # The end is p0 + c_f, so c_f has to come between goal minus start; q has to come into the goal itself.
    low = np.concatenate([lo[:, :n_p] - last, lo[:, n_p:]], axis=1)
    high = np.concatenate([hi[:, :n_p] - first, hi[:, n_p:]], axis=1)
    low, high = low - gamma(4) * np.abs(low), high + gamma(4) * np.abs(high)
    empty = (np.maximum(least - slack - high, low - most - slack) > TOLERANCES.lp_margin).any(axis=1)
    empty |= (lo - hi > TOLERANCES.lp_margin).any(axis=1)

    k = _parameters(pieces, at[..., n_p:], least[:, n_p:], most[:, n_p:], lo[:, n_p:], hi[:, n_p:])
    C, d = pieces.final(goals.n)
    offset = k @ C[:, :n_p].swapaxes(1, 2) + d[:, None, :n_p]
    p0 = 0.5 * (np.maximum(lo[:, None, :n_p] - offset, first) + np.minimum(hi[:, None, :n_p] - offset, last))
    x = np.concatenate([p0, k], axis=2)
    depth = _depth(rows, x)
    best = depth.argmax(axis=1)[:, None]
    fine = np.take_along_axis(depth, best, axis=1)[:, 0] > TOLERANCES.lp_feasible
    inner = np.where(fine[:, None], np.take_along_axis(x, best[..., None], axis=1)[:, 0], np.nan)
    status = np.where(empty, int(LPStatus.INFEASIBLE), int(LPStatus.UNKNOWN))
    return np.where(fine, int(LPStatus.FEASIBLE), status), inner


def _end_ranges(pieces: Piece, n_goal: int):
    """Least and greatest end coordinates over the vertices (r, n_goal), a slack (r, n_goal) that makes these ranges
    hold for the exact piece, and the values at the vertices (r, v, n_goal)."""
    C, d = pieces.final(n_goal)
    at = pieces.vertices @ C.swapaxes(1, 2) + d[:, None]
    size = (np.abs(C) @ pieces.reach[..., None])[..., 0] + np.abs(d)
    slack = (np.abs(C) @ pieces.slip[..., None])[..., 0] * 2 + gamma(2 * C.shape[-1] + 6) * size
    return at.min(axis=1), at.max(axis=1), slack, at


def _parameters(pieces: Piece, at, least, most, lo, hi):
    """Parameters (r, s, n_k) to try. at: (r, v, n_q) end coordinates q at the vertices; their range and the goal's."""
    middle = pieces.vertices.mean(axis=1)
    tried = [middle[:, None]]
    C, d = pieces.C[:, pieces.C.shape[1] - at.shape[2] :], pieces.d[:, pieces.d.shape[1] - at.shape[2] :]
    here = (C @ middle[..., None])[..., 0] + d
    for j in range(at.shape[2]):
        low, high = np.maximum(lo[:, j], least[:, j])[:, None], np.minimum(hi[:, j], most[:, j])[:, None]
        wanted = low + _SHARES * (high - low)  # (r, s)
        up = wanted > here[:, j, None]
        ends = np.where(up, at[..., j].argmax(axis=1)[:, None], at[..., j].argmin(axis=1)[:, None])
        gap = np.where(up, most[:, j, None], least[:, j, None]) - here[:, j, None]
        share = np.clip((wanted - here[:, j, None]) / np.where(gap == 0, 1.0, gap), 0.0, 1.0)[..., None]
        corner = np.take_along_axis(pieces.vertices, ends[..., None], axis=1)
        tried.append((1 - share) * middle[:, None] + share * corner)
    return np.concatenate(tried, axis=1)


def _depth(rows: HPolytope, x):
    """How far points x (r, s, n) lie inside the rows, less its rounding: (r, s) [row lengths], negative outside."""
    A, b = rows.A.swapaxes(1, 2), rows.b[:, None]
    length = np.linalg.norm(rows.A, axis=2)[:, None]
    room = b - x @ A - gamma(x.shape[2] + 2) * (np.abs(x) @ np.abs(A) + np.abs(b))
    return (room / np.where(length > 0, length, 1.0)).min(axis=2)
