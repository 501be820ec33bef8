"""Linear programs by Clarabel. Its points are measured, its multipliers prove the bounds. [T12]"""

import numpy as np

from parc_jax.common.lp.exact import dual_bound, exact_dual_bound, round_down, row_bounds, violation
from parc_jax.common.tolerances import TOLERANCES

_MAX_ITERATIONS = 200
_ACCURACY = 1e-10  # asked of the solver; no verdict relies on it


def ask_clarabel(c, rows, offsets, equalities=0) -> tuple[str, np.ndarray, np.ndarray]:
    """Ask Clarabel once for min c.x over {rows x <= offsets}.

    c (n,), rows (h, n), offsets (h,); the first `equalities` rows hold with equality.
    Returns its status in its words, a point (n,) and multipliers (h,), of which nothing is checked.
    Never raises: a solver that panics returns NaN and the reason in place of the status.
    """
    import clarabel
    import scipy.sparse as sparse

    h, n = rows.shape
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = _MAX_ITERATIONS
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _ACCURACY
    cones = [clarabel.ZeroConeT(equalities)] if equalities else []
    # columns with every entry stored: faster to build than by searching for zeros
    columns = rows.T.ravel(), np.tile(np.arange(h), n), np.arange(n + 1) * h
    try:
        solution = clarabel.DefaultSolver(
            sparse.csc_matrix((n, n)),
            c,
            sparse.csc_matrix(columns, shape=rows.shape),
            offsets,
            [*cones, clarabel.NonnegativeConeT(h - equalities)],
            settings,
        ).solve()
        words, x, z = str(solution.status), np.array(solution.x), np.array(solution.z)
    except Exception as error:
        words, x, z = f"{type(error).__name__}: {error}", np.full(n, np.nan), np.full(h, np.nan)
    if x.shape != (n,) or z.shape != (h,):
        words += " with vectors of the wrong length"
        x, z = np.full(n, np.nan), np.full(h, np.nan)
    return words, x.astype(float), z.astype(float)


def minimise(c, A, b, lo, hi) -> tuple[np.ndarray | None, float]:
    """A point (n,) of {A x <= b, lo <= x <= hi} where c.x is least, and a proved lower bound of it.

    c (n,), A (h, n), b (h,); lo, hi (n,), infinite where unknown. The point satisfies the rows to
    lp_feasible; None, with the bound -inf, where Clarabel found none.
    """
    above, below, eye = np.isfinite(hi), np.isfinite(lo), np.eye(len(c))
    rows = np.concatenate([A, eye[above], -eye[below]])
    offsets = np.concatenate([b, hi[above], -lo[below]])
    words, x, y = ask_clarabel(c, rows, offsets)
    if words != "Solved" or not violation(x, A, b, lo, hi) <= TOLERANCES.lp_feasible:
        return None, -np.inf
    bound = float(dual_bound(c, A, b, y[: len(b)], *row_bounds(A, b, lo, hi)))
    if bound == -np.inf:  # a coordinate without bounds: the multipliers are repaired in rationals
        exact = exact_dual_bound(c, rows, offsets, np.maximum(y, 0.0))
        bound = -np.inf if exact is None else round_down(exact)
    return x, bound
