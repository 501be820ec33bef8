"""Injected solver failures: whatever the solver says, nothing is called empty or optimal without
our own proof.
"""

import dataclasses

import numpy as np
import pytest

from benchmarks.neuralparc import lp_batch as batch_module
from benchmarks.neuralparc import lp_solve as solve_module
from benchmarks.neuralparc.lp_program import LPStatus, linear_program
from benchmarks.neuralparc.lp_solve import Hint, clarabel_hint, feasible, solve

pytestmark = pytest.mark.soundness
SQUARE = (np.concatenate([np.eye(2), -np.eye(2)]), np.ones(4))  # not empty
EMPTY = (np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-1.0, -1.0]))


def lying(kind, fill):
    def hint(lp):
        h = lp.A.shape[0] + 2 * lp.E.shape[0]
        return Hint(
            kind,
            np.full(lp.n, fill),
            np.full(h, fill),
            np.full(len(lp.bound_rows()[1]), fill),
            "lie",
        )

    return hint


@pytest.mark.parametrize("kind", ["solved", "empty", "unbounded", "trouble"])
@pytest.mark.parametrize("fill", [np.nan, np.inf, 0.0, 1.0, -1.0, 1e300])
def test_a_lying_solver_never_makes_a_set_empty(monkeypatch, kind, fill):
    monkeypatch.setattr(solve_module, "clarabel_hint", lying(kind, fill))
    for bounds in ((None, None), (np.full(2, -9.0), np.full(2, 9.0))):
        assert feasible(*SQUARE, lo=bounds[0], hi=bounds[1]).status in (
            LPStatus.FEASIBLE,
            LPStatus.UNKNOWN,
        )
        found = solve([1.0, 0.5], *SQUARE, lo=bounds[0], hi=bounds[1])
        assert found.status is not LPStatus.INFEASIBLE
        assert found.lower <= -1.5 <= found.upper
        assert feasible(*EMPTY, lo=bounds[0], hi=bounds[1]).status in (
            LPStatus.INFEASIBLE,
            LPStatus.UNKNOWN,
        )


@pytest.mark.parametrize(
    "words", ["AlmostSolved", "AlmostPrimalInfeasible", "MaxIterations", "NumericalError"]
)
def test_limits_and_almost_answers_are_unknown(monkeypatch, words):
    real = clarabel_hint
    monkeypatch.setattr(
        solve_module,
        "clarabel_hint",
        lambda lp: dataclasses.replace(real(lp), kind="trouble", words=words),
    )
    for rows in (SQUARE, EMPTY):
        answer = feasible(*rows, lo=np.full(2, -9.0), hi=np.full(2, 9.0))
        assert answer.status is LPStatus.UNKNOWN and words in answer.words


def test_swapped_verdicts_do_not_pass(monkeypatch):
    real, swap = (
        clarabel_hint,
        {"solved": "empty", "empty": "solved", "unbounded": "empty", "trouble": "solved"},
    )
    monkeypatch.setattr(
        solve_module,
        "clarabel_hint",
        lambda lp: dataclasses.replace(real(lp), kind=swap[real(lp).kind]),
    )
    assert feasible(*SQUARE).status is not LPStatus.INFEASIBLE
    assert feasible(*EMPTY).status is LPStatus.UNKNOWN


def test_a_solver_that_raises_is_a_solver_in_trouble(monkeypatch):
    import clarabel

    def panic(*args):
        raise RuntimeError("panicked at linear algebra")

    monkeypatch.setattr(clarabel, "DefaultSolver", panic)
    answer = feasible(*EMPTY)
    assert answer.status is LPStatus.UNKNOWN and "panicked" in answer.words


@pytest.mark.parametrize(
    "status", ["Solved", "PrimalInfeasible", "DualInfeasible", "NumericalError"]
)
def test_vectors_of_the_wrong_length_are_trouble(monkeypatch, status):
    import clarabel

    class Solver:
        def __init__(self, *args):
            pass

        def solve(self):
            return type("Solution", (), {"status": status, "x": [0.0], "z": []})()

    monkeypatch.setattr(clarabel, "DefaultSolver", Solver)
    assert clarabel_hint(linear_program(np.zeros(2), *EMPTY)).kind == "trouble"


@pytest.mark.parametrize("fill", [np.nan, 0.0, 1.0, 1e300, -1.0])
def test_a_lying_batch_kernel_never_makes_a_set_empty(monkeypatch, fill):
    """The kernel is a hint too; with the host solver in trouble as well, everything is unknown or
    rightly decided.
    """
    monkeypatch.setattr(
        batch_module, "propose", lambda c, A, b: (np.full(c.shape, fill), np.full(b.shape, fill))
    )
    monkeypatch.setattr(solve_module, "clarabel_hint", lying("trouble", np.nan))
    A = np.stack([SQUARE[0][:2], np.array([[1.0, 0.0], [-1.0, 0.0]])])
    b = np.stack([np.ones(2), np.full(2, -1.0)])
    found = batch_module.solve_batch(np.zeros((2, 2)), A, b, np.full(2, -9.0), np.full(2, 9.0))
    assert found.status[0] in (LPStatus.FEASIBLE, LPStatus.UNKNOWN)
    assert found.status[1] in (LPStatus.INFEASIBLE, LPStatus.UNKNOWN)
