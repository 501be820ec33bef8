"""Linear programs by HiGHS, whose answers are hints: points are measured, bounds are proved from
its multipliers. [T12]
"""

import numpy as np

from parc_jax.common.lp.exact import dual_bound, exact_dual_bound, round_down, row_bounds, violation
from parc_jax.common.tolerances import TOLERANCES

# asked of the solver; no verdict relies on it
ACCURACY = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def minimise(c, A, b, lo=None, hi=None) -> tuple[np.ndarray | None, float]:
    """A point (n,) of {A x <= b, lo <= x <= hi} where c.x is least, and a proved lower bound of the
    minimum.

    c (n,), A (h, n), b (h,); lo, hi (n,), infinite where unknown. The point satisfies the rows to
    lp_feasible; None, with the bound -inf, where HiGHS found none.
    """
    from scipy.optimize import linprog

    lo = np.full(len(c), -np.inf) if lo is None else lo
    hi = np.full(len(c), np.inf) if hi is None else hi
    bounds = np.stack([lo, hi], axis=1)
    found = linprog(c, A, b, bounds=bounds, method="highs", options=dict(ACCURACY))
    if found.status != 0 or not violation(found.x, A, b, lo, hi) <= TOLERANCES.lp_feasible:
        return None, -np.inf
    y = np.maximum(-found.ineqlin.marginals, 0.0)
    bound = float(dual_bound(c, A, b, y, *row_bounds(A, b, lo, hi)))
    if bound > -np.inf:
        return found.x, bound
    # a coordinate without bounds: the multipliers are repaired in rationals
    above, below, eye = np.isfinite(hi), np.isfinite(lo), np.eye(len(c))
    rows = np.concatenate([A, eye[above], -eye[below]])
    offsets = np.concatenate([b, hi[above], -lo[below]])
    sides = np.concatenate([-found.upper.marginals[above], found.lower.marginals[below]])
    exact = exact_dual_bound(c, rows, offsets, np.concatenate([y, np.maximum(sides, 0.0)]))
    return found.x, -np.inf if exact is None else round_down(exact)
