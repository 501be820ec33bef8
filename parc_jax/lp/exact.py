"""Dual bounds in rational arithmetic, for polytopes without known bounds.

Without bounds on x the multipliers must satisfy c + A'mu = 0 exactly, which floats never do. The solver's multipliers
are nudged onto that subspace in rationals; if they stay nonnegative, -mu.b is a bound with nothing left to check.
"""

from fractions import Fraction

import numpy as np

_SUPPORT = 1e-9  # multipliers below this share of the largest are taken as zero; affects quality, never validity
_PIVOT = Fraction(1, 10**9)  # a column is independent if it clears this share of its length; quality, never validity


def exact_dual_bound(c, A, b, multipliers) -> Fraction | None:
    """Proved lower bound of min c.x over {A x <= b}, or None if the multipliers could not be repaired. [T12b, rho = 0]

    c: (n,). A: (h, n). b, multipliers: (h,), floats, read as the rationals they are. For c = 0 a positive bound proves
    the set empty.
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
    """Row -> multiplier >= 0 with c + A'mu = 0 exactly, near the given ones; None if there is none near by."""
    multipliers = np.where(np.isfinite(multipliers) & (multipliers > 0), multipliers, 0.0)
    order = [int(i) for i in np.argsort(-multipliers) if multipliers[i] > _SUPPORT * multipliers.max()]
    rows = {i: [Fraction(float(a)) for a in A[i]] for i in order}
    mu = {i: Fraction(float(multipliers[i])) for i in order}
    n = A.shape[1]
    residual = [Fraction(float(c[j])) + sum((mu[i] * rows[i][j] for i in order), Fraction(0)) for j in range(n)]

    # Large multipliers absorb the correction: columns enter by decreasing size until they span the residual.
    transform = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    pivots: dict[int, int] = {}
    for i in order:
        if len(pivots) == n:
            break
        column = _product(transform, rows[i])
        free = [r for r in range(n) if r not in pivots]
        pivot = max(free, key=lambda r: abs(column[r]))
        if abs(column[pivot]) <= _PIVOT * max(abs(a) for a in rows[i]):
            continue
        pivots[pivot] = i
        transform[pivot] = [t / column[pivot] for t in transform[pivot]]
        for r in range(n):
            if r != pivot and column[r] != 0:
                transform[r] = [t - column[r] * p for t, p in zip(transform[r], transform[pivot], strict=True)]
    correction = _product(transform, residual)
    if any(correction[r] != 0 for r in range(n) if r not in pivots):
        return None
    for r, i in pivots.items():
        mu[i] -= correction[r]
    return mu if all(value >= 0 for value in mu.values()) else None


def _product(matrix, vector):
    return [sum((m * v for m, v in zip(row, vector, strict=True)), Fraction(0)) for row in matrix]
