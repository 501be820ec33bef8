"""Clarabel as a source of hints. Nothing it says is believed; `solve` checks it."""

from dataclasses import dataclass

import numpy as np

from parc_jax.common.lp.program import LinearProgram

_MAX_ITERATIONS = 200
_ACCURACY = 1e-10  # asked of the solver; the verdict does not rely on it
_KINDS = {"Solved": "solved", "PrimalInfeasible": "empty", "DualInfeasible": "unbounded"}


@dataclass(frozen=True)
class Hint:
    """What the solver claims.

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
    import clarabel
    import scipy.sparse as sparse

    rows, offsets = lp.bound_rows()
    matrix = np.concatenate([lp.E, lp.A, rows])
    e = lp.E.shape[0]
    h = lp.A.shape[0]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = _MAX_ITERATIONS
    settings.max_threads = 1
    settings.tol_gap_abs = _ACCURACY
    settings.tol_gap_rel = _ACCURACY
    settings.tol_feas = _ACCURACY
    cones = [clarabel.NonnegativeConeT(h + len(offsets))]
    if e:
        cones.insert(0, clarabel.ZeroConeT(e))
    try:
        solution = clarabel.DefaultSolver(
            sparse.csc_matrix((lp.n, lp.n)),
            lp.c,
            _dense_to_csc(matrix),
            np.concatenate([lp.f, lp.b, offsets]),
            cones,
            settings,
        ).solve()
        words = str(solution.status)
        x = np.array(solution.x, dtype=float)
        z = np.array(solution.z, dtype=float)
    except Exception as error:  # a solver that panics is a solver in trouble
        return _trouble(lp, f"{type(error).__name__}: {error}")
    if x.shape != (lp.n,) or z.shape != (matrix.shape[0],):
        return _trouble(lp, f"{words} with vectors of the wrong length")
    of_equalities = z[:e]
    y = np.concatenate([z[e : e + h], np.maximum(of_equalities, 0), np.maximum(-of_equalities, 0)])
    return Hint(_KINDS.get(words, "trouble"), x, y, z[e + h :], words)


def _trouble(lp: LinearProgram, words: str) -> Hint:
    """A hint that says nothing."""
    sizes = lp.n, len(lp.b) + 2 * len(lp.f), len(lp.bound_rows()[1])
    return Hint("trouble", *(np.full(size, np.nan) for size in sizes), words)


def _dense_to_csc(matrix: np.ndarray):
    """Sparse columns with every entry stored: faster to build than by searching for zeros."""
    import scipy.sparse as sparse

    rows, columns = matrix.shape
    indices = np.tile(np.arange(rows), columns)
    return sparse.csc_matrix(
        (matrix.T.ravel(), indices, np.arange(columns + 1) * rows), shape=matrix.shape
    )
