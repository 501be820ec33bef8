"""Is there a point in the set? Three-valued, with a witness either way."""

import numpy as np

from parc_jax.lp.batch import feasible_batch
from parc_jax.lp.solve import feasible
from parc_jax.lp.status import LPBatch, LPResult, LPStatus
from parc_jax.sets.affine import Set
from parc_jax.sets.ahpolytope import as_ah
from parc_jax.sets.hpolytope import HPolytope


def find_point(s: Set) -> LPResult:
    """A point of the set (FEASIBLE; `x` is the base point xi), a proof that there is none (INFEASIBLE), or UNKNOWN."""
    s = as_ah(s)
    return feasible(s.A, s.b, lo=s.lo, hi=s.hi)


def is_proved_empty(s: Set) -> bool:
    """True only with a checked dual witness. False means non-empty or unknown."""
    return find_point(s).status is LPStatus.INFEASIBLE


def find_points(polytopes: HPolytope, lo=None, hi=None) -> LPBatch:
    """`find_point` for B H-polytopes of n <= 10 variables at once: A (B, h, n), b (B, h).

    lo, hi: (B, n) or (n,), bounds known to hold, for instance of the domain. Rows of padding are A = 0, b >= 0.
    """
    return feasible_batch(np.asarray(polytopes.A), np.asarray(polytopes.b), lo, hi)
