"""Questions about sets that only tests ask: supports by LPs, and many memberships at once."""

import numpy as np

from benchmarks.neuralparc.lp_batch import propose, proves_empty
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.lp_solve import LP_MARGIN, solve
from benchmarks.neuralparc.sets.affine import as_ah, membership
from parc_jax.common.lp.exact import violation
from parc_jax.common.sets.extent import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.tolerances import TOLERANCES


def supports(s, w) -> np.ndarray:
    """(d,) max {w x : x in s} along directions w (d, n), by one LP each."""
    s = as_ah(s)
    found = [solve(row, s.A, s.b, lo=s.lo, hi=s.hi) for row in -(w @ s.G)]
    assert all(one.status is LPStatus.OPTIMAL for one in found)
    return w @ s.c - np.array([one.lower for one in found])


def memberships(s, x) -> np.ndarray:
    """LPStatus (q,) of points x (q, n) in an AH-polytope, through the batched kernel.

    The n equations G xi + c = x are eliminated (xi = particular solution + null space), which
    leaves m - n <= 10 variables; verdicts are checked against the original rows.
    """
    s = as_ah(s)
    around = bounding_box(HPolytope(s.A, s.b))
    lo, hi = np.maximum(s.lo, around.lo), np.minimum(s.hi, around.hi)
    pseudo = np.linalg.pinv(s.G)
    start = (x - s.c) @ pseudo.T
    free = np.linalg.svd(s.G)[2][np.linalg.matrix_rank(s.G) :].T
    rows = np.broadcast_to(s.A @ free, (len(x), len(s.b), free.shape[1]))
    hint, y = propose(np.zeros((len(x), free.shape[1])), rows, s.b - start @ s.A.T)
    xi = start + hint @ free.T
    A = np.concatenate([s.A, s.G, -s.G])
    b = np.concatenate([np.broadcast_to(s.b, (len(x), len(s.b))), x - s.c, s.c - x], axis=1)
    inside = violation(xi, A, b, lo, hi) <= TOLERANCES.lp_feasible
    # multipliers of the equations that cancel the rest best: A'y + G'w = 0 in the row space of G
    y = np.where(y > 0, y, 0.0)
    w = -(y @ s.A) @ pseudo
    multipliers = np.concatenate([y, np.maximum(w, 0), np.maximum(-w, 0)], axis=1)
    outside = proves_empty(A, b, multipliers, lo, hi, LP_MARGIN)
    status = np.full(len(x), int(LPStatus.UNKNOWN))
    status[outside] = int(LPStatus.INFEASIBLE)
    status[inside] = int(LPStatus.FEASIBLE)
    for i in np.flatnonzero(status == int(LPStatus.UNKNOWN)):
        status[i] = int(membership(s, x[i]).status)
    return status
