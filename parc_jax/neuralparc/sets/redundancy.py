"""Rows that can go without changing the set."""

import numpy as np

from parc_jax.common.lp.solve import solve
from parc_jax.common.lp.status import LPStatus
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.tolerances import TOLERANCES


def irredundant_rows(p: HPolytope) -> np.ndarray:
    """Indices of rows that define the same set, in order: one LP per row, each against the rows
    kept so far.

    A row is dropped only with a proof that the others keep a.x <= b + redundant_row (|a| + |b|):
    the set can only grow, and by no more than that. Undecided rows stay, and so do all that empty a
    set.
    """
    kept = list(_without_repeats(p))
    for row in list(kept):
        others = [i for i in kept if i != row]
        if not others:
            break
        # The row itself, moved out by one length, keeps the LP bounded.
        length = float(np.linalg.norm(p.A[row]))
        A = np.concatenate([p.A[others], p.A[[row]]])
        found = solve(-p.A[row], A, np.r_[p.b[others], p.b[row] + length])
        # With no point at all, the moved row itself may be what empties the set: keep it.
        has_point = found.status in (LPStatus.OPTIMAL, LPStatus.FEASIBLE)
        slack = TOLERANCES.redundant_row * (length + abs(p.b[row]))
        if has_point and -found.lower <= p.b[row] + slack:
            kept = others
    return np.array(sorted(kept), dtype=int)


def without_redundant_rows(p: HPolytope) -> HPolytope:
    """The same set (see `irredundant_rows`) with fewer rows."""
    rows = irredundant_rows(p)
    return HPolytope(p.A[rows], p.b[rows])


def _without_repeats(p: HPolytope) -> list[int]:
    """Of rows that are exact positive multiples by a power of two, or equal, the tightest; trivial
    rows 0 <= b go.
    """
    best: dict[bytes, int] = {}
    for i, (row, offset) in enumerate(zip(p.A, p.b, strict=True)):
        if not row.any():
            if offset < 0:
                best[row.tobytes() + b"contradiction"] = i
            continue
        scale = _power_of_two(row)
        name = (row * scale + 0.0).tobytes()
        other = best.get(name)
        if other is None or offset * scale < p.b[other] * _power_of_two(p.A[other]):
            best[name] = i
    return sorted(best.values())


def _power_of_two(row: np.ndarray) -> float:
    """Factor that brings the largest entry of a row into [1/2, 1), without rounding."""
    return 2.0 ** -np.frexp(float(np.abs(row).max()))[1]
