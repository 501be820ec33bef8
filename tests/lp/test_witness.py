"""Witnesses hold for any multipliers, and the bound they give is never above the true minimum."""

from fractions import Fraction

import numpy as np
import pytest

from benchmarks.neuralparc.lp_batch import proves_empty
from parc_jax.common.lp.exact import (
    dual_bound,
    exact_dual_bound,
    round_down,
    round_up,
    row_bounds,
    violation,
)

INF = np.inf


def exact_t12b(c, A, b, mu, lo, hi) -> Fraction:
    """[T12b] in rationals for the given multipliers, term by term."""
    c, b, mu, lo, hi = ([Fraction(float(v)) for v in part] for part in (c, b, mu, lo, hi))
    A = [[Fraction(float(a)) for a in row] for row in A]
    rho = [c_j + sum(m * row[j] for m, row in zip(mu, A, strict=True)) for j, c_j in enumerate(c)]
    ends = sum(min(r * low, r * high) for r, low, high in zip(rho, lo, hi, strict=True))
    return ends - sum(m * v for m, v in zip(mu, b, strict=True))


@pytest.mark.soundness
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_float_bound_is_below_the_rational_bound_and_close(rng, scale):
    for _ in range(60):
        n, h = rng.integers(1, 6), rng.integers(1, 12)
        A, b, c = rng.normal(size=(h, n)) * scale, rng.normal(size=h), rng.normal(size=n)
        mu, lo = rng.exponential(size=h), rng.normal(size=n) - 3
        hi = lo + rng.exponential(size=n)
        exact = exact_t12b(c, A, b, mu, lo, hi)
        bound = float(dual_bound(c, A, b, mu, lo, hi))
        assert Fraction(bound) <= exact
        assert float(exact) - bound < 1e-13 * (1 + scale) * 100


@pytest.mark.parametrize("bad", [np.nan, -1.0])
def test_bad_multipliers_prove_nothing(bad):
    A, b = np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0])  # x <= -1 and x >= 1
    lo, hi = np.array([-5.0]), np.array([5.0])
    assert proves_empty(A, b, np.array([1.0, 1.0]), lo, hi, 1e-12)
    assert not proves_empty(A, b, np.array([bad, bad]), lo, hi, 1e-12)
    assert not proves_empty(A, b, np.array([1.0, bad]), lo, hi, 1e-12)
    assert not proves_empty(A, b, np.array([np.inf, np.inf]), lo, hi, 1e-12)


def test_unknown_bounds_need_exact_cancellation():
    A, b, free = np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0]), np.array([INF])
    y = np.array([1.0, np.nextafter(1.0, 2)])
    assert dual_bound(np.zeros(1), A, b, y, -free, free) == -INF
    assert exact_dual_bound(np.zeros(1), A, b, y) > 0


def test_violation_reports_the_worst_row_and_nan():
    A, b = np.eye(2), np.array([1.0, 2.0])
    assert violation(np.array([1.5, 2.25]), A, b) == 0.5
    assert violation(np.array([0.0, 0.0]), A, b) == 0.0
    assert violation(np.array([0.0, 0.0]), A, b, lo=np.array([0.25, 0.0])) == 0.25
    assert np.isnan(violation(np.array([0.0, np.nan]), A, b))


def test_row_bounds_read_single_entry_rows_outward():
    A, b = np.array([[3.0, 0.0], [0.0, -2.0], [1.0, 1.0]]), np.array([1.0, 4.0, 0.0])
    lo, hi = row_bounds(A, b)
    assert lo[0] == -INF and hi[1] == INF
    assert Fraction(hi[0]) > Fraction(1, 3) and hi[0] < 0.3334
    assert Fraction(lo[1]) < -2
    low, high = row_bounds(A, b, np.array([0.0, -1.0]), np.array([0.25, 1.0]))
    assert (low == [0.0, -1.0]).all() and (high == [0.25, 1.0]).all()


def test_exact_bound_repairs_rounded_multipliers():
    # min x + y over x >= 1/3, y >= 1/7: dual multipliers 1, 1, perturbed in the last digits.
    A, b = -np.eye(2), -np.array([1 / 3, 1 / 7])
    c, mu = np.ones(2), np.array([1.0 + 3e-16, 1.0 - 2e-16])
    bound = exact_dual_bound(c, A, b, mu)
    assert bound == Fraction(1 / 3) + Fraction(1 / 7)
    assert exact_dual_bound(c, A, b, np.array([1.0, 0.0])) is None
    assert exact_dual_bound(-c, A, b, mu) is None  # would need negative multipliers
    assert exact_dual_bound(c, A, b, np.full(2, np.nan)) is None


def test_directed_rounding_brackets_the_rational():
    third = Fraction(1, 3)
    assert Fraction(round_down(third)) < third < Fraction(round_up(third))
    assert round_down(Fraction(1, 4)) == round_up(Fraction(1, 4)) == 0.25
