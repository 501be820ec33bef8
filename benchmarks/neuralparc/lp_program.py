"""A linear program as plain arrays, and a verdict on it with its witnesses."""

import enum
from dataclasses import dataclass

import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError


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
        """One sentence for the user: the proof, and what to try next."""
        return (
            "A point satisfies the rows; a dual witness shows that no point is better by more than "
            "1e-7 of its value.",
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
    multipliers: (h,) of the rows, >= 0: the dual hint; NaN where there is none.
    lower: proved lower bound of the minimum, -inf where none was proved (+inf: proved empty).
    upper: c.x at the point, +inf where there is no point.
    words: of the solver, for people.
    """

    status: LPStatus
    x: np.ndarray
    multipliers: np.ndarray
    lower: float
    upper: float
    words: str


@dataclass(frozen=True)
class LinearProgram:
    """min c.x over {A x <= b, E x = f, lo <= x <= hi}. `linear_program` builds and validates it.

    c: (n,). A: (h, n). b: (h,). E: (e, n). f: (e,). lo, hi: (n,), infinite where there is no bound.
    """

    c: np.ndarray
    A: np.ndarray
    b: np.ndarray
    E: np.ndarray
    f: np.ndarray
    lo: np.ndarray
    hi: np.ndarray

    @property
    def n(self) -> int:
        """Number of variables."""
        return self.c.shape[0]

    def stacked(self) -> tuple[np.ndarray, np.ndarray]:
        """Equalities as pairs of rows: [A; E; -E], [b; f; -f]. Bounds are not included."""
        return np.concatenate([self.A, self.E, -self.E]), np.concatenate([self.b, self.f, -self.f])

    def bound_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """The finite bounds as rows: x_j <= hi_j first, then -x_j <= -lo_j."""
        above = np.isfinite(self.hi)
        below = np.isfinite(self.lo)
        eye = np.eye(self.n)
        rows = np.concatenate([eye[above], -eye[below]])
        return rows, np.concatenate([self.hi[above], -self.lo[below]])


def linear_program(c, A, b, E=None, f=None, lo=None, hi=None) -> LinearProgram:
    """Validated program; missing parts are absent. Raises InputError."""
    A = as_float64("LP rows A", A, (None, None))
    n = A.shape[1]
    b = as_float64("LP offsets b", b, (A.shape[0],))
    c = as_float64("LP objective c", c, (n,))
    if (E is None) != (f is None):
        raise InputError(
            "LP: expected equalities as a pair E (e, n), f (e,); got only one of them."
        )
    E = np.zeros((0, n)) if E is None else as_float64("LP equalities E", E, (None, n))
    f = np.zeros(0) if f is None else as_float64("LP equality offsets f", f, (E.shape[0],))
    lo = _bound("lo", lo, -np.inf, n)
    hi = _bound("hi", hi, np.inf, n)
    return LinearProgram(c, A, b, E, f, lo, hi)


def _bound(name: str, value, missing: float, n: int) -> np.ndarray:
    if value is None:
        return np.full(n, missing)
    value = np.asarray(value, dtype=np.float64)
    if value.shape != (n,) or np.isnan(value).any() or (value == -missing).any():
        raise InputError(
            f"LP bound {name}: expected shape ({n},), finite or {missing}; got {value}."
        )
    return value
