"""Rows that can go without changing the set."""

import numpy as np

from parc_jax.lp.solve import solve
from parc_jax.lp.status import LPStatus
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.tolerances import TOLERANCES


def irredundant_rows(p: HPolytope) -> np.ndarray:
    """Indices of rows that define the same set, in order: one LP per row, each against the rows kept so far.

    A row is dropped only with a proof that the others keep a.x <= b + redundant_row (|a| + |b|): the set can only grow,
    and by no more than that. Undecided rows stay, and so do all that empty a set.
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
        if has_point and -found.lower <= p.b[row] + TOLERANCES.redundant_row * (length + abs(p.b[row])):
            kept = others
    return np.array(sorted(kept), dtype=int)


def without_redundant_rows(p: HPolytope) -> HPolytope:
    """The same set (see `irredundant_rows`) with fewer rows."""
    rows = irredundant_rows(p)
    return HPolytope(p.A[rows], p.b[rows])


def _without_repeats(p: HPolytope) -> list[int]:
    """Of rows that are exact positive multiples by a power of two, or equal, the tightest; trivial rows 0 <= b go."""
    best: dict[bytes, int] = {}
    for i, (row, offset) in enumerate(zip(p.A, p.b, strict=True)):
        size = float(np.abs(row).max())
        if size == 0:
            if offset < 0:
                best[row.tobytes() + b"contradiction"] = i
            continue
        scale = 2.0 ** -np.frexp(size)[1]
        name = (row * scale + 0.0).tobytes()
        other = best.get(name)
        if other is None:
            best[name] = i
            continue
        other_scale = 2.0 ** -np.frexp(float(np.abs(p.A[other]).max()))[1]
        if offset * scale < p.b[other] * other_scale:
            best[name] = i
    return sorted(best.values())
