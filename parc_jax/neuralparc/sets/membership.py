"""Is there a point in a set, is this point in it? Three-valued, with a witness either way. (For
points of H-polytopes: `HPolytope.contains`.)

Support functions h(w) = max {w.x : x in S}: the view of a set that needs neither vertices nor
projection.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from parc_jax.common.lp.exact import gamma, proves_empty, violation
from parc_jax.common.lp.program import LPResult, LPStatus
from parc_jax.common.lp.solve import feasible, solve
from parc_jax.common.sets.bounding_box import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.neuralparc.lp_batch import MAX_N, LPBatch, feasible_batch, propose, solve_batch
from parc_jax.neuralparc.sets.affine import AHPolytope, Set, as_ah

_MANY = 64  # directions from which the batched kernel is worth its compilation


class Support(NamedTuple):
    """h(w) for a batch of directions.

    status: (d,) LPStatus.
    upper: (d,) proved h(w) <= upper; inf where nothing is proved, -inf for a set proved empty.
    lower: (d,) value at a point of the set. point: (d, n) that point, NaN where there is none.
    """

    status: Int[np.ndarray, " d"]
    upper: Float[np.ndarray, " d"]
    lower: Float[np.ndarray, " d"]
    point: Float[np.ndarray, "d n"]


def support(s: Set, w: Float[np.ndarray, "d n"]) -> Support:
    """Supports of any set in directions w (d, n), by LPs with proved upper bounds.

    Obstacles use `upper`, so they only grow. An unbounded direction has status UNBOUNDED and upper
    inf.
    """
    s = as_ah(s)
    w = np.asarray(w, dtype=np.float64)
    cost = -(w @ s.G)
    offset = w @ s.c
    bounded = np.isfinite(s.lo) & np.isfinite(s.hi)
    if len(w) >= _MANY and s.m <= MAX_N and bounded.all():
        found = solve_batch(cost, s.A, np.broadcast_to(s.b, (len(w), len(s.b))), s.lo, s.hi)
        status = found.status
        xi = found.x
        lower = found.lower
        upper = found.upper
    else:
        one_by_one = [solve(row, s.A, s.b, lo=s.lo, hi=s.hi) for row in cost]
        status = np.array([int(one.status) for one in one_by_one])
        xi = np.array([one.x for one in one_by_one]).reshape(len(w), s.m)
        lower = np.array([one.lower for one in one_by_one])
        upper = np.array([one.upper for one in one_by_one])
    size = np.abs(w) @ np.abs(s.c) + np.where(np.isfinite(lower), np.abs(lower), 0.0)
    slack = _rounding_of_cost(s, w, bounded) + gamma(s.n + 4) * size
    proved = np.where(lower == np.inf, -np.inf, np.nextafter(offset - lower + slack, np.inf))
    return Support(status, proved, offset - upper, xi @ s.G.T + s.c)


def _rounding_of_cost(s: AHPolytope, w: np.ndarray, bounded: np.ndarray) -> np.ndarray:
    """(d,) How much the rounded cost w G can differ from the exact one over the base of s."""
    if _is_selection(s.G):
        return np.zeros(len(w))
    largest_xi = np.where(bounded, np.maximum(np.abs(s.lo), np.abs(s.hi)), np.inf)
    error = gamma(s.n + 1) * (np.abs(w) @ np.abs(s.G))
    with np.errstate(invalid="ignore"):
        return np.where(error > 0, error * largest_xi, 0.0).sum(axis=1)


def _is_selection(G: np.ndarray) -> bool:
    """Is every column zero or a unit vector? Then products with G are exact."""
    return bool(((G == 0) | (G == 1)).all() and (G.sum(axis=0) <= 1).all())


def find_point(s: Set) -> LPResult:
    """A point of the set (FEASIBLE; `x` is the base point xi), a proof that there is none
    (INFEASIBLE), or UNKNOWN.
    """
    s = as_ah(s)
    return feasible(s.A, s.b, lo=s.lo, hi=s.hi)


def is_proved_empty(s: Set) -> bool:
    """True only with a checked dual witness. False means non-empty or unknown."""
    return find_point(s).status is LPStatus.INFEASIBLE


def find_points(polytopes: HPolytope, lo=None, hi=None) -> LPBatch:
    """`find_point` for B H-polytopes of n <= 10 variables at once: A (B, h, n), b (B, h).

    lo, hi: (B, n) or (n,), bounds known to hold, for instance of the domain. Rows of padding are
    A = 0, b >= 0.
    """
    return feasible_batch(np.asarray(polytopes.A), np.asarray(polytopes.b), lo, hi)


def membership(s: Set, x: Float[np.ndarray, " n"]) -> LPResult:
    """Is x (n,) in s? FEASIBLE with a base point xi (to lp_feasible), INFEASIBLE with a proof, or
    UNKNOWN.
    """
    s = as_ah(s)
    return feasible(s.A, s.b, s.G, x - s.c, s.lo, s.hi)


def is_proved_outside(s: Set, x: Float[np.ndarray, " n"]) -> bool:
    """True only with a checked dual witness. False means inside or unknown."""
    return membership(s, x).status is LPStatus.INFEASIBLE


def memberships(s: Set, x: Float[np.ndarray, "q n"]) -> Int[np.ndarray, " q"]:
    """LPStatus (q,) of many points x (q, n) in one AH-polytope, through the batched kernel; the
    host decides the rest.

    The n equations G xi + c = x are eliminated (xi = particular solution + null space), which
    leaves m - n <= 10 variables; verdicts are checked against the original rows. Raises InputError
    if the base of s is proved empty.
    """
    s = with_bounds(s)
    pseudo = np.linalg.pinv(s.G)
    start = (x - s.c) @ pseudo.T
    free = np.linalg.svd(s.G)[2][np.linalg.matrix_rank(s.G) :].T
    rows = np.broadcast_to(s.A @ free, (len(x), len(s.b), free.shape[1]))
    hint, y = propose(np.zeros((len(x), free.shape[1])), rows, s.b - start @ s.A.T)
    xi = start + hint @ free.T
    A = np.concatenate([s.A, s.G, -s.G])
    b = np.concatenate([np.broadcast_to(s.b, (len(x), len(s.b))), x - s.c, s.c - x], axis=1)
    inside = violation(xi, A, b, s.lo, s.hi) <= TOLERANCES.lp_feasible
    # Multipliers of the equations that cancel the rest best: A'y + G'w = 0 in the row space of G.
    y = np.where(y > 0, y, 0.0)
    w = -(y @ s.A) @ pseudo
    multipliers = np.concatenate([y, np.maximum(w, 0), np.maximum(-w, 0)], axis=1)
    outside = proves_empty(A, b, multipliers, s.lo, s.hi, TOLERANCES.lp_margin)
    status = np.full(len(x), int(LPStatus.UNKNOWN))
    status[outside] = int(LPStatus.INFEASIBLE)
    status[inside] = int(LPStatus.FEASIBLE)
    for i in np.flatnonzero(status == int(LPStatus.UNKNOWN)):
        status[i] = int(membership(s, x[i]).status)
    return status


def with_bounds(s: Set) -> AHPolytope:
    """The same set with proved bounds on its base points: two LPs per coordinate, worth it for many
    questions.

    Raises InputError if the base is proved empty.
    """
    s = as_ah(s)
    if np.isfinite(s.lo).all() and np.isfinite(s.hi).all():
        return s
    around = bounding_box(HPolytope(s.A, s.b))
    return s.replace(lo=np.maximum(s.lo, around.lo), hi=np.minimum(s.hi, around.hi))
