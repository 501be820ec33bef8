"""Support functions h(w) = max {w.x : x in S}: the view of a set that needs neither vertices nor
projection.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from parc_jax.common.lp.solve import solve
from parc_jax.common.lp.witness import gamma
from parc_jax.neuralparc.lp_batch import MAX_N, solve_batch
from parc_jax.neuralparc.sets.affine import Set
from parc_jax.neuralparc.sets.ahpolytope import AHPolytope, as_ah

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
