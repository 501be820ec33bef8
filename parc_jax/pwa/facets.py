"""Which rows of a region are facets: rays and proved LP bounds first, rational arithmetic for what they leave open."""

from fractions import Fraction

import numpy as np

from parc_jax.lp.solve import solve
from parc_jax.lp.status import LPStatus
from parc_jax.pwa.exact_lp import meets_strictly
from parc_jax.pwa.halfspaces import Halfspaces, same_direction

CLEAR = 1e-7  # [unit rows, unit coordinates] a float verdict must clear zero by this, far above the rounding of rows
RAYS = 64  # directions shot from the centre of a region


def find_facets(rows: Halfspaces, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Indices of the rows that carry facets, one per facet. lo, hi: (n,) a box that contains the region.

    The region must have interior. No verdict rests on a solver's word: a facet is shown by a point on it that is
    strictly inside all other rows, a row is dropped for a proved bound, and everything else is decided exactly.
    """
    waiting = _distinct(rows)
    unit = rows.unit[waiting]
    center, depth = _center(unit, lo, hi)
    facet = np.zeros(len(waiting), bool)
    if depth > CLEAR:
        facet = _hit_by_rays(unit, center)
    lo, hi = _bounds(unit, lo, hi)
    reach = unit[:, :-1] @ (0.5 * (lo + hi)) + np.abs(unit[:, :-1]) @ (0.5 * (hi - lo)) + unit[:, -1]
    for i in np.flatnonzero(~facet & (reach > -CLEAR)):
        verdict = _by_lp(unit, i, lo, hi)
        if verdict is LPStatus.UNKNOWN:
            others = [rows.exact[k] for j, k in enumerate(waiting) if j != i]
            verdict = meets_strictly(rows.exact[waiting[i]], others, [Fraction(v) for v in lo.tolist()])
        facet[i] = verdict in (True, LPStatus.FEASIBLE)
    return waiting[facet]


def _distinct(rows: Halfspaces) -> np.ndarray:
    """One row of each set of exact multiples."""
    kept, gone = [], np.zeros(len(rows.label), bool)
    for i in range(len(gone)):
        if not gone[i]:
            kept.append(i)
            gone |= same_direction(rows, i)
    return np.array(kept)


def _center(unit, lo, hi) -> tuple[np.ndarray, float]:
    """A point far from all rows, and its measured distance from them; NaN and 0 without one."""
    n = len(lo)
    cost = np.append(np.zeros(n), -1.0)
    found = solve(cost, np.column_stack([unit[:, :n], np.ones(len(unit))]), -unit[:, n], lo=[*lo, -1.0], hi=[*hi, 10.0])
    depth = -(unit[:, :n] @ found.x[:n] + unit[:, n]).max()
    return found.x[:n], float(depth) if np.isfinite(depth) else 0.0


def _hit_by_rays(unit, center) -> np.ndarray:
    """Rows that a ray from the centre meets first, with all other rows clear of the meeting point: (m,) bool."""
    n = len(center)
    directions = np.concatenate([unit[:, :n], np.random.default_rng(0).normal(size=(RAYS, n))])
    speed, room = directions @ unit[:, :n].T, -(unit[:, :n] @ center + unit[:, n])
    with np.errstate(divide="ignore"):
        time = np.where(speed > 0, room / np.where(speed > 0, speed, 1.0), np.inf)
    first, when = time.argmin(axis=1), time.min(axis=1)
    bounded = np.isfinite(when)
    slack = room - np.where(bounded, when, 0.0)[:, None] * speed
    slack[np.arange(len(first)), first] = np.inf
    facet = np.zeros(len(unit), bool)
    facet[first[bounded & (slack.min(axis=1) > CLEAR)]] = True
    return facet


def _bounds(unit, lo, hi) -> tuple[np.ndarray, np.ndarray]:
    """Proved bounds of the region: two LPs per axis; the given ones where no proof came."""
    n, (low, high) = len(lo), (lo.copy(), hi.copy())
    for axis in range(n):
        direction = np.eye(n)[axis]
        low[axis] = max(lo[axis], solve(direction, unit[:, :n], -unit[:, n], lo=lo, hi=hi).lower - CLEAR)
        high[axis] = min(hi[axis], -solve(-direction, unit[:, :n], -unit[:, n], lo=lo, hi=hi).lower + CLEAR)
    return low, high


def _by_lp(unit, i: int, lo, hi) -> LPStatus:
    """FEASIBLE: row i is a facet; INFEASIBLE: it is not; UNKNOWN. Maximises the room t of a point on row i."""
    n = len(lo)
    others = np.delete(unit, i, axis=0)
    found = solve(
        np.append(np.zeros(n), -1.0),
        np.column_stack([others[:, :n], np.ones(len(others))]),
        -others[:, n],
        E=np.append(unit[i, :n], 0.0)[None],
        f=-unit[i, n:],
        lo=[*lo, -4.0],
        hi=[*hi, 1.0],
    )
    if found.lower > CLEAR:  # t < 0 for every point on row i
        return LPStatus.INFEASIBLE
    if found.status in (LPStatus.OPTIMAL, LPStatus.FEASIBLE) and -found.upper > CLEAR:
        return LPStatus.FEASIBLE
    return LPStatus.UNKNOWN
