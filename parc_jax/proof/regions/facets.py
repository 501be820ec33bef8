"""Which rows of a region are facets: rays and proved LP bounds first, rational arithmetic for what
they leave open.

The last word is whether some point on one hyperplane lies strictly inside all others, decided in
rationals by least-index criss-cross pivoting: no starting point, no tolerance, always ends.
"""

from fractions import Fraction

import numpy as np
from jaxtyping import Float

from parc_jax.common.lp.solve import solve
from parc_jax.common.lp.status import LPStatus
from parc_jax.proof.regions.halfspaces import Halfspaces, same_direction

# [unit rows, unit coordinates] a float verdict must clear zero by this, far above the rounding of
# rows
CLEAR = 1e-7
RAYS = 64  # directions shot from the centre of a region


def find_facets(rows: Halfspaces, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Indices of the rows that carry facets, one per facet. lo, hi: (n,) a box that contains the
    region.

    The region must have interior. No verdict rests on a solver's word: a facet is shown by a point
    on it that is strictly inside all other rows, a row is dropped for a proved bound, and
    everything else is decided exactly.
    """
    waiting = _distinct(rows)
    unit = rows.unit[waiting]
    center, depth = _center(unit, lo, hi)
    facet = np.zeros(len(waiting), bool)
    if depth > CLEAR:
        facet = _hit_by_rays(unit, center)
    lo, hi = _bounds(unit, lo, hi)
    at_center = unit[:, :-1] @ (0.5 * (lo + hi)) + unit[:, -1]
    at_most = at_center + np.abs(unit[:, :-1]) @ (0.5 * (hi - lo))
    for i in np.flatnonzero(~facet & (at_most > -CLEAR)).tolist():
        verdict = _by_lp(unit, i, lo, hi)
        if verdict is LPStatus.UNKNOWN:
            others = [rows.exact[k] for j, k in enumerate(waiting) if j != i]
            verdict = meets_strictly(
                rows.exact[waiting[i]], others, [Fraction(v) for v in lo.tolist()]
            )
        facet[i] = verdict in (True, LPStatus.FEASIBLE)
    return waiting[facet]


def _distinct(rows: Halfspaces) -> np.ndarray:
    """One row of each set of exact multiples."""
    kept = []
    gone = np.zeros(len(rows.label), bool)
    for i in range(len(gone)):
        if not gone[i]:
            kept.append(i)
            gone |= same_direction(rows, i)
    return np.array(kept)


def _center(
    unit: Float[np.ndarray, "rows columns"],
    lo: Float[np.ndarray, " n"],
    hi: Float[np.ndarray, " n"],
) -> tuple[np.ndarray, float]:
    """A point far from all rows, and its measured distance from them; NaN and 0 without one."""
    n = len(lo)
    cost = np.append(np.zeros(n), -1.0)
    found = solve(
        cost,
        np.column_stack([unit[:, :n], np.ones(len(unit))]),
        -unit[:, n],
        lo=[*lo, -1.0],
        hi=[*hi, 10.0],
    )
    depth = -(unit[:, :n] @ found.x[:n] + unit[:, n]).max()
    return found.x[:n], float(depth) if np.isfinite(depth) else 0.0


def _hit_by_rays(
    unit: Float[np.ndarray, "rows columns"], center: Float[np.ndarray, " n"]
) -> np.ndarray:
    """Rows that a ray from the centre meets first, with all other rows clear of the meeting point:
    (m,) bool.
    """
    n = len(center)
    directions = np.concatenate([unit[:, :n], np.random.default_rng(0).normal(size=(RAYS, n))])
    speed = directions @ unit[:, :n].T
    depth = -(unit[:, :n] @ center + unit[:, n])
    with np.errstate(divide="ignore"):
        time = np.where(speed > 0, depth / np.where(speed > 0, speed, 1.0), np.inf)
    first = time.argmin(axis=1)
    when = time.min(axis=1)
    bounded = np.isfinite(when)
    slack = depth - np.where(bounded, when, 0.0)[:, None] * speed
    slack[np.arange(len(first)), first] = np.inf
    facet = np.zeros(len(unit), bool)
    facet[first[bounded & (slack.min(axis=1) > CLEAR)]] = True
    return facet


def _bounds(
    unit: Float[np.ndarray, "rows columns"],
    lo: Float[np.ndarray, " n"],
    hi: Float[np.ndarray, " n"],
) -> tuple[np.ndarray, np.ndarray]:
    """Proved bounds of the region: two LPs per axis; the given ones where no proof came."""
    A = unit[:, :-1]
    b = -unit[:, -1]
    low = lo.copy()
    high = hi.copy()
    for axis, direction in enumerate(np.eye(len(lo))):
        least = solve(direction, A, b, lo=lo, hi=hi).lower - CLEAR
        most = -solve(-direction, A, b, lo=lo, hi=hi).lower + CLEAR
        low[axis] = max(lo[axis], least)
        high[axis] = min(hi[axis], most)
    return low, high


def _by_lp(
    unit: Float[np.ndarray, "rows columns"],
    i: int,
    lo: Float[np.ndarray, " n"],
    hi: Float[np.ndarray, " n"],
) -> LPStatus:
    """FEASIBLE: row i is a facet; INFEASIBLE: it is not; UNKNOWN. Maximises the distance t of a
    point on row i from all other rows.
    """
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


def meets_strictly(row: np.ndarray, others: list[np.ndarray], lo: list[Fraction]) -> bool:
    """Whether some x >= lo has row(x) = 0 and other(x) < 0 for all others; rows (a, c) stand for
    a.x + c.

    row: n + 1 rationals. others: list of such. lo: (n,) rationals, a bound that costs no solution.
    """
    # Variables u = x - lo >= 0 and s = 1 - t >= 0; maximise t over other(x) + t <= 0, row(x) = 0.
    n = len(lo)
    constraints = [[*other[:n], -1, -_at(other, lo) - 1] for other in others]
    for sign in (1, -1):
        constraints.append([*(sign * v for v in row[:n]), 0, -sign * _at(row, lo)])
    table = [[Fraction(v) for v in constraint] for constraint in constraints]
    best = _maximise([Fraction(0)] * n + [Fraction(-1)], table)
    return best is not None and 1 + best > 0


def _at(row: np.ndarray, x: list[Fraction]):
    return sum((Fraction(a) * v for a, v in zip(row, x, strict=False)), Fraction(row[-1]))


def _maximise(cost: list[Fraction], table: list[list[Fraction]]) -> Fraction | None:
    """Maximum of cost.v over {v >= 0, A v <= b}, table rows (A, b); None if infeasible. Bounded by
    construction.
    """
    n = len(cost)
    # dictionary: basic = b - A nonbasic, value = z + cost.nonbasic; nonbasic variables have the
    # first numbers
    objective = [*cost, Fraction(0)]
    outside = list(range(n))
    inside = list(range(n, n + len(table)))
    while True:
        wrong = [(v, None, i) for i, v in enumerate(inside) if table[i][n] < 0]
        wrong += [(v, j, None) for j, v in enumerate(outside) if objective[j] > 0]
        if not wrong:
            return objective[n]
        _, column, line = min(wrong, key=lambda item: item[0])
        if column is None:
            candidates = [(v, j) for j, v in enumerate(outside) if table[line][j] < 0]
            if not candidates:
                return None
            column = min(candidates)[1]
        else:
            line = min((v, i) for i, v in enumerate(inside) if table[i][column] > 0)[1]
        _pivot(objective, table, line, column, n)
        outside[column], inside[line] = inside[line], outside[column]


def _pivot(
    objective: list[Fraction], table: list[list[Fraction]], line: int, column: int, n: int
) -> None:
    """Exchange a basic and a nonbasic variable."""
    pivot = table[line][column]
    row = [v / pivot for v in table[line]]
    row[column] = 1 / pivot
    for i, other in enumerate(table):
        if i != line and other[column]:
            factor = other[column]
            table[i] = [v - factor * r for v, r in zip(other, row, strict=True)]
            table[i][column] = -factor / pivot
    factor = objective[column]
    if factor:
        for j in range(n):
            objective[j] -= factor * row[j]
        objective[column] = -factor / pivot
        objective[n] += factor * row[n]
    table[line] = row
