"""Dual bounds in rational arithmetic, for polytopes that may be unbounded.

Without bounds on x the multipliers must satisfy c + A'mu = 0 exactly, which floats never do. The
solver's multipliers are nudged onto that subspace in rationals; if they stay nonnegative, -mu.b is
a bound with nothing left to check.

Witnesses: the few inequalities of every LP verdict, in float64 with rounding accounted for.

A solver's output is a hint. A point is checked against the rows; multipliers are turned into a
bound that is valid for any of them (Neumaier and Shcherbina's self-correcting bound, [T12]):
there is no equality to miss. All functions take leading batch axes.
"""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

_UNIT = 2.0**-53
_TINY = np.finfo(np.float64).tiny


def gamma(n: int) -> float:
    """Relative error bound of a float64 sum of n products in any order, itself rounded up."""
    return 1.01 * n * _UNIT / (1 - n * _UNIT)


def violation(x, A, b, lo=None, hi=None):
    """Most by which x (..., n) misses A x <= b or a bound [row units]: (...), NaN for a NaN x."""
    with np.errstate(invalid="ignore", over="ignore"):
        worst = (np.einsum("...hn,...n->...h", A, x) - b).max(axis=-1, initial=0.0)
        if lo is not None:
            worst = np.maximum(worst, (lo - x).max(axis=-1, initial=0.0))
        if hi is not None:
            worst = np.maximum(worst, (x - hi).max(axis=-1, initial=0.0))
    return np.where(np.isfinite(x).all(axis=-1), worst, np.nan)


def dual_bound(c, A, b, multipliers, lo, hi):
    """Proved lower bound of min c.x over {A x <= b, lo <= x <= hi}. [T12b]

    c: (..., n). A: (..., h, n). b, multipliers: (..., h); negative and NaN multipliers count as 0.
    lo, hi: (..., n), infinite where unknown. Returns (...), rounded down; -inf where the
        multipliers prove nothing.

    For any mu >= 0 and rho = c + A'mu:  c.x = rho.x - mu.A x >= sum_j min(rho_j lo_j, rho_j hi_j) -
    mu.b.
    """
    mu = np.where(multipliers > 0, multipliers, 0.0)
    h, n = A.shape[-2:]
    with np.errstate(invalid="ignore", over="ignore"):
        rho = c + np.einsum("...hn,...h->...n", A, mu)
        slack = gamma(h + 2) * (np.abs(c) + np.einsum("...hn,...h->...n", np.abs(A), mu))
        # products that underflow; an unused coordinate is free
        slack = slack + h * _TINY * (A != 0).any(axis=-2)
        below = rho - slack
        above = rho + slack
        least = np.minimum(
            np.minimum(_times(below, lo), _times(below, hi)),
            np.minimum(_times(above, lo), _times(above, hi)),
        )
        offset = np.einsum("...h,...h->...", mu, b)
        size = np.einsum("...h,...h->...", mu, np.abs(b)) + np.abs(least).sum(axis=-1)
        bound = least.sum(axis=-1) - offset - gamma(h + n + 4) * size - (h + n) * _TINY
    return np.where(np.isfinite(bound), bound, -np.inf)


def row_bounds(A, b, lo=None, hi=None):
    """Bounds (lo, hi), each (..., n), that rows with a single nonzero entry imply, rounded outward;
    infinite where none do. Bounds passed in are intersected with them.
    """
    single = (A != 0).sum(axis=-1, keepdims=True) == 1
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        limit = b[..., None] / A
        up = np.nextafter(limit, np.inf)
        down = np.nextafter(limit, -np.inf)
    above = np.where(single & (A > 0), up, np.inf).min(axis=-2, initial=np.inf)
    below = np.where(single & (A < 0), down, -np.inf).max(axis=-2, initial=-np.inf)
    below = below if lo is None else np.maximum(below, lo)
    above = above if hi is None else np.minimum(above, hi)
    return below, above


def _times(a, b):
    """Product in which 0 * inf is 0: a zero coefficient pays nothing for an unknown bound."""
    return np.where(a == 0, 0.0, a * b)


# multipliers below this share of the largest are taken as zero; affects quality, never validity
_SUPPORT = 1e-9
# a row is independent if it clears this share of its length; affects quality, never validity
_PIVOT = Fraction(1, 10**9)


def exact_dual_bound(c, A, b, multipliers) -> Fraction | None:
    """Proved lower bound of min c.x over {A x <= b}; None for multipliers beyond repair. [T12b]

    c: (n,). A: (h, n). b, multipliers: (h,), floats, read as the rationals they are. For c = 0 a
    positive bound proves the set empty.
    """
    if (mu := _repaired(c, A, multipliers)) is None:
        return None
    return -sum((value * Fraction(float(b[row])) for row, value in mu.items()), Fraction(0))


def round_down(value: Fraction) -> float:
    """Largest float64 that is not above the rational (finite values)."""
    nearest = float(value)
    return nearest if Fraction(nearest) <= value else float(np.nextafter(nearest, -np.inf))


def round_up(value: Fraction) -> float:
    """Smallest float64 that is not below the rational (finite values)."""
    return -round_down(-value)


def _repaired(c, A, multipliers) -> dict[int, Fraction] | None:
    """Row -> multiplier >= 0 near the given ones with c + A'mu = 0 exactly; None for none."""
    multipliers = np.where(np.isfinite(multipliers) & (multipliers > 0), multipliers, 0.0)
    enough = _SUPPORT * multipliers.max()
    used = [int(i) for i in np.argsort(-multipliers) if multipliers[i] > enough]
    rows = {i: [Fraction(float(a)) for a in A[i]] for i in used}
    mu = {i: Fraction(float(multipliers[i])) for i in used}
    residual = [
        Fraction(float(c_j)) + sum((mu[i] * rows[i][j] for i in used), Fraction(0))
        for j, c_j in enumerate(c)
    ]
    # Large multipliers absorb the correction: rows enter by decreasing size until they span it.
    basis = Basis(A.shape[1])
    least = {i: _PIVOT * max(abs(a) for a in rows[i]) for i in used}
    correcting = [i for i in used if not basis.full and basis.add(rows[i], least[i])]
    if (correction := basis.coordinates(residual)) is None:
        return None
    for i, value in zip(correcting, correction, strict=True):
        mu[i] -= value
    return mu if all(value >= 0 for value in mu.values()) else None


class Basis:
    """Independent vectors v of Q^n, added one by one, as a matrix M: each M v is a unit vector."""

    def __init__(self, n: int):
        self._matrix = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
        self._row_of: list[int] = []  # of each vector of the basis: the 1 of its unit vector

    def __len__(self) -> int:
        return len(self._row_of)

    @property
    def full(self) -> bool:
        """Do the vectors span all of Q^n?"""
        return len(self) == len(self._matrix)

    def add(self, vector: Sequence[Fraction], least: Fraction = Fraction(0)) -> bool:
        """Add a vector unless it depends on the others; returns whether it was added.

        least: a vector also stays out when its independent part is no longer than this.
        """
        column = _product(self._matrix, vector)
        free = [row for row in range(len(column)) if row not in self._row_of]
        if not free:
            return False
        pivot = max(free, key=lambda row: abs(column[row]))
        if abs(column[pivot]) <= least:
            return False
        self._row_of.append(pivot)
        pivot_row = [entry / column[pivot] for entry in self._matrix[pivot]]
        self._matrix[pivot] = pivot_row
        for row, factor in enumerate(column):
            if row != pivot and factor != 0:
                pairs = zip(self._matrix[row], pivot_row, strict=True)
                self._matrix[row] = [entry - factor * other for entry, other in pairs]
        return True

    def coordinates(self, vector: Sequence[Fraction]) -> list[Fraction] | None:
        """Coefficients c with sum c_i v_i = vector, in order of adding; None outside the span."""
        column = _product(self._matrix, vector)
        if any(column[row] != 0 for row in range(len(column)) if row not in self._row_of):
            return None
        return [column[row] for row in self._row_of]

    def meet(self, bounds: Sequence[Fraction]) -> list[Fraction]:
        """The x with v_i . x = bounds_i for all vectors, in order of adding; of a full basis."""
        return _product(zip(*[self._matrix[row] for row in self._row_of], strict=True), bounds)


def _product(matrix, vector) -> list[Fraction]:
    return [sum((m * v for m, v in zip(row, vector, strict=True)), Fraction(0)) for row in matrix]
