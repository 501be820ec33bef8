"""Is a point in an AH-polytope? Three-valued, with a witness either way. (For H-polytopes: `HPolytope.contains`.)"""

import numpy as np
from jaxtyping import Float, Int

from parc_jax.lp.batch import propose
from parc_jax.lp.solve import feasible
from parc_jax.lp.status import LPResult, LPStatus
from parc_jax.lp.witness import dual_bound, violation
from parc_jax.sets.affine import Set
from parc_jax.sets.ahpolytope import as_ah
from parc_jax.sets.bounding_box import with_bounds
from parc_jax.tolerances import TOLERANCES


def membership(s: Set, x: Float[np.ndarray, " n"]) -> LPResult:
    """Is x (n,) in s? FEASIBLE with a base point xi (to lp_feasible), INFEASIBLE with a proof, or UNKNOWN."""
    s = as_ah(s)
    return feasible(s.A, s.b, s.G, x - s.c, s.lo, s.hi)


def is_proved_outside(s: Set, x: Float[np.ndarray, " n"]) -> bool:
    """True only with a checked dual witness. False means inside or unknown."""
    return membership(s, x).status is LPStatus.INFEASIBLE


def memberships(s: Set, x: Float[np.ndarray, "q n"]) -> Int[np.ndarray, " q"]:
    """LPStatus (q,) of many points x (q, n) in one AH-polytope, through the batched kernel; the host decides the rest.

    The n equations G xi + c = x are eliminated (xi = particular solution + null space), which leaves m - n <= 10
    variables; verdicts are checked against the original rows. Raises InputError if the base of s is proved empty.
    """
    s = with_bounds(s)
    pseudo = np.linalg.pinv(s.G)
    start = (x - s.c) @ pseudo.T
    free = np.linalg.svd(s.G)[2][np.linalg.matrix_rank(s.G) :].T
    rows = np.broadcast_to(s.A @ free, (len(x), len(s.b), free.shape[1]))
    hint, y = propose(np.zeros((len(x), free.shape[1])), rows, s.b - start @ s.A.T)
    xi = start + hint @ free.T
    E, f = np.concatenate([s.G, -s.G]), np.concatenate([x - s.c, s.c - x], axis=1)
    original = np.concatenate([s.A, E])
    offsets = np.concatenate([np.broadcast_to(s.b, (len(x), len(s.b))), f], axis=1)
    inside = violation(xi, original, offsets, s.lo, s.hi) <= TOLERANCES.lp_feasible
    # Multipliers of the equations that cancel the rest best: A'y + G'w = 0 in the row space of G.
    y = np.where(y > 0, y, 0.0)
    w = -(y @ s.A) @ pseudo
    both = np.concatenate([y, np.maximum(w, 0), np.maximum(-w, 0)], axis=1)
    both = both / np.maximum(both.max(axis=1, keepdims=True), np.finfo(float).tiny)
    outside = dual_bound(np.zeros(s.m), original, offsets, both, s.lo, s.hi) > TOLERANCES.lp_margin
    status = np.select([inside, outside], [int(LPStatus.FEASIBLE), int(LPStatus.INFEASIBLE)], int(LPStatus.UNKNOWN))
    for i in np.flatnonzero(status == int(LPStatus.UNKNOWN)):
        status[i] = int(membership(s, x[i]).status)
    return status
