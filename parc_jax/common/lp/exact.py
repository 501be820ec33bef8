"""Dual bounds in rational arithmetic, for polytopes without known bounds.

Without bounds on x the multipliers must satisfy c + A'mu = 0 exactly, which floats never do. The
solver's multipliers are nudged onto that subspace in rationals; if they stay nonnegative, -mu.b is
a bound with nothing left to check.
"""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

# multipliers below this share of the largest are taken as zero; affects quality, never validity
_SUPPORT = 1e-9
# a row is independent if it clears this share of its length; affects quality, never validity
_PIVOT = Fraction(1, 10**9)


def exact_dual_bound(c, A, b, multipliers) -> Fraction | None:
    """Proved lower bound of min c.x over {A x <= b}; None for multipliers beyond repair. [T12b]

    c: (n,). A: (h, n). b, multipliers: (h,), floats, read as the rationals they are. For c = 0 a
    positive bound proves the set empty.
    """
    mu = _repaired(c, A, multipliers)
    if mu is None:
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
    least = _SUPPORT * multipliers.max()
    used = [int(i) for i in np.argsort(-multipliers) if multipliers[i] > least]
    rows = {i: [Fraction(float(a)) for a in A[i]] for i in used}
    mu = {i: Fraction(float(multipliers[i])) for i in used}
    residual = [
        Fraction(float(c_j)) + sum((mu[i] * rows[i][j] for i in used), Fraction(0))
        for j, c_j in enumerate(c)
    ]
    # Large multipliers absorb the correction: rows enter by decreasing size until they span it.
    basis = Basis(A.shape[1])
    correcting = []
    for i in used:
        if basis.full:
            break
        if basis.add(rows[i], _PIVOT * max(abs(a) for a in rows[i])):
            correcting.append(i)
    correction = basis.coordinates(residual)
    if correction is None:
        return None
    for i, value in zip(correcting, correction, strict=True):
        mu[i] -= value
    return mu if all(value >= 0 for value in mu.values()) else None


class Basis:
    """Independent vectors v of Q^n, added one by one, kept as M: each M v is a unit vector."""

    def __init__(self, n: int):
        self._matrix = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
        self._row_of: list[int] = []  # of each vector of the basis: the 1 of its unit vector

    def __len__(self) -> int:
        return len(self._row_of)

    @property
    def full(self) -> bool:
        """Do the vectors span the whole space?"""
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
                self._matrix[row] = [
                    entry - factor * other
                    for entry, other in zip(self._matrix[row], pivot_row, strict=True)
                ]
        return True

    def coordinates(self, vector: Sequence[Fraction]) -> list[Fraction] | None:
        """Coefficients c with sum c_i v_i = vector, in order of adding; None outside the span."""
        column = _product(self._matrix, vector)
        if any(column[row] != 0 for row in range(len(column)) if row not in self._row_of):
            return None
        return [column[row] for row in self._row_of]


def _product(matrix, vector) -> list[Fraction]:
    return [sum((m * v for m, v in zip(row, vector, strict=True)), Fraction(0)) for row in matrix]
