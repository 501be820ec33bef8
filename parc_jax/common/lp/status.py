"""What an LP verdict says, and what it rests on."""

import enum
from dataclasses import dataclass

import numpy as np


class LPStatus(enum.IntEnum):
    """Verdict on min c.x over a polytope; each but UNKNOWN rests on a witness that we checked.

    Only INFEASIBLE may be read as "empty" or "not contained". UNKNOWN is never safe, nor empty.
    """

    OPTIMAL = 0
    FEASIBLE = 1
    INFEASIBLE = 2
    UNBOUNDED = 3
    UNKNOWN = 4

    @property
    def advice(self) -> str:
        """One sentence for the user: what is proved, and what to try next."""
        return (
            "A point satisfies the rows; a dual witness shows that no point is better by more than "
            "lp_gap.",
            "A point satisfies the rows to lp_feasible; nothing is claimed about how good it is. "
            "For a proved optimum give bounds (lo, hi) or rescale the rows to unit length.",
            "A dual witness proves that no point satisfies the rows.",
            "A point and a direction show that the objective falls without limit. Add the bounds "
            "you know.",
            "The solver stopped early, or its answer failed our check. Treat the set as possibly "
            "non-empty. Rescale the rows to unit length, or give bounds (lo, hi) that the set is "
            "known to satisfy.",
        )[self]


@dataclass(frozen=True)
class LPResult:
    """Answer to min c.x over {A x <= b, E x = f, lo <= x <= hi}: n variables, h rows, e equalities.

    status: LPStatus.
    x: (n,) a point that satisfies the rows to lp_feasible; NaN where there is none.
    multipliers: (h,) of the rows, >= 0, and equality_multipliers: (e,): the dual hint; NaN where
        there is none.
    lower: proved lower bound of the minimum, -inf where none was proved (+inf: proved empty).
    upper: c.x at the point, +inf where there is no point.
    words: what the solver said, for people.
    """

    status: LPStatus
    x: np.ndarray
    multipliers: np.ndarray
    equality_multipliers: np.ndarray
    lower: float
    upper: float
    words: str
