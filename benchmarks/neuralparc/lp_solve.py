"""The host door to linear programs: Clarabel's answers, checked before they are verdicts.

Clarabel as a source of hints. Nothing it says is believed; `solve` checks it.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.neuralparc.lp_program import LinearProgram, LPResult, LPStatus, linear_program
from parc_jax.common.lp.exact import dual_bound, exact_dual_bound, round_down, row_bounds, violation
from parc_jax.common.lp.solve import ask_clarabel
from parc_jax.common.tolerances import TOLERANCES

# [1 + |optimum|] an optimum is called OPTIMAL if its proved bounds are this close; verdicts use the
# bounds
GAP = 1e-7
LP_MARGIN = 1e-12  # [row units] a dual proof of emptiness must clear zero by this
_KINDS = {"Solved": "solved", "PrimalInfeasible": "empty", "DualInfeasible": "unbounded"}


@dataclass(frozen=True)
class Hint:
    """The claim of the solver.

    kind: "solved", "empty", "unbounded", or "trouble" (limits, stalls, "almost", exceptions).
    x: (n,) point or ray. y: (h + 2e,) multipliers of the stacked rows, y_bounds: of the bound rows.
    """

    kind: str
    x: np.ndarray
    y: np.ndarray
    y_bounds: np.ndarray
    words: str


def clarabel_hint(lp: LinearProgram) -> Hint:
    """Run Clarabel once. Never raises on solver trouble: that is kind "trouble"."""
    rows, offsets = lp.bound_rows()
    e, h = len(lp.f), len(lp.b)
    words, x, z = ask_clarabel(
        lp.c,
        np.concatenate([lp.E, lp.A, rows]),
        np.concatenate([lp.f, lp.b, offsets]),
        equalities=e,
    )
    of_equalities = z[:e]
    y = np.concatenate([z[e : e + h], np.maximum(of_equalities, 0), np.maximum(-of_equalities, 0)])
    return Hint(_KINDS.get(words, "trouble"), x, y, z[e + h :], words)


def solve(c, A, b, E=None, f=None, lo=None, hi=None) -> LPResult:
    """min c.x over {A x <= b, E x = f, lo <= x <= hi}.

    c: (n,). A: (h, n), b: (h,). E: (e, n), f: (e,) or None. lo, hi: (n,), may be infinite, or None.
    Returns LPResult; its `lower` is proved under any status. Bounds make proofs cheap; without
    them the dual witness is repaired in rational arithmetic. Raises InputError on wrong shapes or
    non-finite data, never on solver trouble.
    """
    return solve_program(linear_program(c, A, b, E, f, lo, hi))


def feasible(A, b, E=None, f=None, lo=None, hi=None) -> LPResult:
    """{A x <= b, E x = f, lo <= x <= hi}: FEASIBLE with a point, INFEASIBLE, proved, or UNKNOWN."""
    return solve(np.zeros(np.shape(A)[1]), A, b, E, f, lo, hi)


def solve_program(lp: LinearProgram) -> LPResult:
    """As `solve`, for a program that is already built."""
    hint = clarabel_hint(lp)
    result = _checked(lp, hint)
    if result.status is not LPStatus.UNKNOWN:
        return result
    return _by_elastic_rows(lp, f"{hint.words}; elastic: ")


def _checked(lp: LinearProgram, hint: Hint) -> LPResult:
    """The verdict that the hint's vectors prove; its kind only decides which proof is tried."""
    if hint.kind == "solved":
        return _with_point(lp, hint.x, hint, _lower_bound(lp, lp.c, hint) if lp.c.any() else 0.0)
    if hint.kind == "empty" and _lower_bound(lp, np.zeros(lp.n), hint) > LP_MARGIN:
        return _result(lp, LPStatus.INFEASIBLE, None, hint, np.inf)
    if hint.kind == "unbounded" and _falls_for_ever(lp, hint.x):
        # A direction of descent alone proves nothing: the set may be empty.
        point = solve_program(LinearProgram(np.zeros(lp.n), lp.A, lp.b, lp.E, lp.f, lp.lo, lp.hi))
        if point.status is LPStatus.FEASIBLE:
            return _result(lp, LPStatus.UNBOUNDED, point.x, hint, -np.inf)
        if point.status is LPStatus.INFEASIBLE:
            return point
    return _result(lp, LPStatus.UNKNOWN, None, hint, -np.inf)


def _with_point(lp: LinearProgram, x, hint: Hint, lower: float) -> LPResult:
    """FEASIBLE if the point satisfies the rows, OPTIMAL if the lower bound meets its value."""
    A, b = lp.stacked()
    if not violation(x, A, b, lp.lo, lp.hi) <= TOLERANCES.lp_feasible:  # False for NaN
        return _result(lp, LPStatus.UNKNOWN, None, hint, lower)
    value = float(lp.c @ x)
    met = bool(lp.c.any()) and value - lower <= GAP * (1 + abs(value))
    return _result(lp, LPStatus.OPTIMAL if met else LPStatus.FEASIBLE, x, hint, lower)


def _lower_bound(lp: LinearProgram, c, hint: Hint) -> float:
    """Proved lower bound of min c.x: in floats through the bounds, else in rationals."""
    A, b = lp.stacked()
    lo, hi = row_bounds(A, b, lp.lo, lp.hi)
    y = np.where(hint.y > 0, hint.y, 0.0)
    largest = max(float(np.max(y, initial=0.0)), float(np.max(hint.y_bounds, initial=0.0)))
    scale = 1.0 if c.any() else largest
    if not (np.isfinite(scale) and scale > 0):
        return -np.inf
    # Valid for any multipliers. The float proof finds the best multipliers of the bounds by itself.
    bound = float(dual_bound(c, A, b, y / scale, lo, hi))
    if bound > (-np.inf if c.any() else LP_MARGIN):
        return bound
    rows, offsets = lp.bound_rows()
    both = np.concatenate([hint.y, hint.y_bounds]) / scale
    exact = exact_dual_bound(c, np.concatenate([A, rows]), np.concatenate([b, offsets]), both)
    return bound if exact is None else max(bound, round_down(exact))


def _falls_for_ever(lp: LinearProgram, ray: np.ndarray) -> bool:
    """Does c.x fall along the ray, of size one, without leaving the rows (to lp_feasible)?"""
    length = float(np.abs(ray).max())
    if not (np.isfinite(length) and length > 0):
        return False
    ray = ray / length
    A, b = lp.stacked()
    rows, offsets = lp.bound_rows()
    leaves = violation(ray, np.concatenate([A, rows]), np.zeros(len(b) + len(offsets)))
    stays = bool(leaves <= TOLERANCES.lp_feasible)
    least = TOLERANCES.lp_feasible * float(np.linalg.norm(lp.c))
    return stays and float(lp.c @ ray) < -least


def _by_elastic_rows(lp: LinearProgram, words: str) -> LPResult:
    """A second opinion: min t, {A x <= b + t |A|, |E x - f| <= t |E|}, never empty nor flat."""
    A, b = lp.stacked()
    rows, offsets = lp.bound_rows()
    length = np.linalg.norm(A, axis=1, keepdims=True)
    wide = np.concatenate([np.concatenate([A, -length], axis=1), np.pad(rows, ((0, 0), (0, 1)))])
    elastic = linear_program(
        np.r_[np.zeros(lp.n), 1.0], wide, np.r_[b, offsets], lo=np.r_[np.full(lp.n, -np.inf), -1.0]
    )
    raw = clarabel_hint(elastic)
    hint = Hint(raw.kind, raw.x[:-1], raw.y[: len(b)], raw.y[len(b) :], words + raw.words)
    if raw.kind != "solved":
        return _result(lp, LPStatus.UNKNOWN, None, hint, -np.inf)
    if _lower_bound(lp, np.zeros(lp.n), hint) > LP_MARGIN:
        return _result(lp, LPStatus.INFEASIBLE, None, hint, np.inf)
    return _with_point(lp, hint.x, hint, 0.0 if not lp.c.any() else -np.inf)


def _result(lp: LinearProgram, status: LPStatus, x, hint: Hint, lower: float) -> LPResult:
    x = np.full(lp.n, np.nan) if x is None else x
    upper = float(lp.c @ x) if np.isfinite(x).all() else np.inf
    multipliers = np.full(len(lp.b), np.nan)
    if status is not LPStatus.UNKNOWN:
        multipliers = np.maximum(hint.y[: len(lp.b)], 0.0)
    return LPResult(status, x, multipliers, float(lower), upper, hint.words)
