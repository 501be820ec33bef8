"""Verdicts of the host door against HiGHS, and the witnesses behind them."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import linprog

from benchmarks.neuralparc.lp_batch import proves_empty
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.lp_solve import LP_MARGIN, feasible, solve
from parc_jax.common.errors import InputError
from parc_jax.common.tolerances import TOLERANCES


def draw(rng, kind):
    """A random program: integer data full of ties, generic floats, or flat sets given by pairs of
    opposite rows.
    """
    n, h = rng.integers(1, 6), rng.integers(1, 14)
    if kind == "generic":
        return rng.normal(size=n), rng.normal(size=(h, n)), rng.normal(size=h) + 0.4
    c, A = rng.integers(-2, 3, n).astype(float), rng.integers(-2, 3, (h, n)).astype(float)
    if kind == "integer":
        return c, A, rng.integers(-2, 3, h).astype(float)
    b = A @ rng.integers(-2, 3, n)
    return c, np.concatenate([A, -A]), np.concatenate([b, -b])


@pytest.mark.parametrize("kind", ["generic", "integer", "flat"])
def test_bounded_programs_agree_with_highs(rng, kind):
    seen = set()
    for _ in range(60):
        c, A, b = draw(rng, kind)
        lo, hi = np.full(len(c), -50.0), np.full(len(c), 50.0)
        ours, theirs = (
            solve(c, A, b, lo=lo, hi=hi),
            linprog(c, A, b, bounds=np.stack([lo, hi], 1), method="highs"),
        )
        seen.add(ours.status)
        if theirs.status == 2:
            assert ours.status is LPStatus.INFEASIBLE
            assert ours.lower == np.inf and np.isnan(ours.x).all()
        else:
            assert ours.status is (LPStatus.OPTIMAL if c.any() else LPStatus.FEASIBLE)
            assert ours.lower <= theirs.fun + 1e-9 * (1 + abs(theirs.fun))
            assert abs(ours.upper - theirs.fun) < 1e-6 * (1 + abs(theirs.fun))
            assert (A @ ours.x - b).max() <= TOLERANCES.lp_feasible
    assert LPStatus.OPTIMAL in seen and (kind == "flat" or LPStatus.INFEASIBLE in seen)


def test_programs_without_bounds_agree_with_highs(rng):
    seen = set()
    for _ in range(50):
        c, A, b = draw(rng, "generic")
        ours, theirs = solve(c, A, b), linprog(c, A, b, bounds=(None, None), method="highs")
        seen.add(ours.status)
        if ours.status is LPStatus.OPTIMAL:
            assert theirs.status == 0
            assert (
                ours.lower <= theirs.fun + 1e-9 * (1 + abs(theirs.fun))
                and abs(ours.upper - theirs.fun) < 1e-6
            )
        elif ours.status is LPStatus.INFEASIBLE:
            assert (
                theirs.status != 0
                and linprog(0 * c, A, b, bounds=(None, None), method="highs").status == 2
            )
        elif ours.status is LPStatus.UNBOUNDED:
            assert theirs.status in (3, 4)
            assert (A @ ours.x <= b + TOLERANCES.lp_feasible).all()
    assert {LPStatus.OPTIMAL, LPStatus.INFEASIBLE, LPStatus.UNBOUNDED} <= seen


def test_equalities_take_part_in_points_and_proofs():
    E, f = np.array([[1.0, 1.0, 1.0]]), np.array([1.0])
    ours = solve([1.0, 2.0, 3.0], -np.eye(3), np.zeros(3), E, f)
    assert ours.status is LPStatus.OPTIMAL and abs(ours.upper - 1) < 1e-7
    empty = feasible(-np.eye(3), np.zeros(3), E, -f)
    assert empty.status is LPStatus.INFEASIBLE


@pytest.mark.soundness
def test_infeasible_comes_with_a_witness_that_a_user_can_check():
    A, b = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]]), np.array([0.0, -1e-6, 1.0])
    lo, hi = np.full(2, -10.0), np.full(2, 10.0)
    ours = feasible(A, b, lo=lo, hi=hi)
    assert ours.status is LPStatus.INFEASIBLE
    assert proves_empty(A, b, ours.multipliers, lo, hi, LP_MARGIN)


def test_touching_sets_are_never_called_empty():
    A, b = np.array([[1.0], [-1.0]]), np.array([1.0, -1.0])
    assert feasible(A, b).status is LPStatus.FEASIBLE
    assert (
        feasible(A, b - np.array([0.0, 1e-12])).status is not LPStatus.INFEASIBLE
        or Fraction(b[0]) < 1
    )
    assert feasible(A, b - np.array([0.0, 1e-3])).status is LPStatus.INFEASIBLE


def test_every_status_has_advice():
    assert all(len(status.advice) > 40 for status in LPStatus)
    assert "Treat the set as possibly non-empty" in LPStatus.UNKNOWN.advice


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (([1.0], [[1.0, 0.0]], [1.0]), "expected shape"),
        (([1.0], [[np.nan]], [1.0]), "finite"),
        (([1.0], [[1.0]], [1.0], [[1.0]]), "pair"),
        (([1.0], [[1.0]], [1.0], None, None, [np.nan]), "bound lo"),
    ],
)
def test_bad_input_is_refused_with_advice(args, words):
    with pytest.raises(InputError, match=words):
        solve(*args)
