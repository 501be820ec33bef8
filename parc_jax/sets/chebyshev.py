"""Chebyshev centre: the deepest point of a polytope, and how deep it lies."""

from typing import NamedTuple

import numpy as np

from parc_jax.lp.solve import solve
from parc_jax.lp.status import LPStatus
from parc_jax.sets.hpolytope import HPolytope


class Ball(NamedTuple):
    """Largest inscribed ball found.

    status: FEASIBLE (a ball of this radius fits), INFEASIBLE (the set is proved empty) or UNKNOWN.
    center: (n,). radius: () >= 0, measured from the rows at the centre and not taken from the
    solver. NaN where there is no ball.
    """

    status: LPStatus
    center: np.ndarray
    radius: float


def chebyshev_center(p: HPolytope, largest: float | None = None) -> Ball:
    """Centre of the largest ball in p, or of a ball of radius `largest` for sets that hold bigger
    ones.

    The default for `largest` is the size of the offsets, so that unbounded sets have an answer too.
    """
    length = np.linalg.norm(p.A, axis=1)
    if largest is None:
        largest = 1.0 + float(np.max(np.abs(p.b) / np.where(length > 0, length, 1.0), initial=0.0))
    rows = np.concatenate([p.A, length[:, None]], axis=1)
    cost = np.r_[np.zeros(p.n), -1.0]
    unknown = np.full(p.n, np.inf)
    found = solve(cost, rows, p.b, lo=np.r_[-unknown, 0.0], hi=np.r_[unknown, largest])
    if found.status not in (LPStatus.OPTIMAL, LPStatus.FEASIBLE):
        status = LPStatus.INFEASIBLE if found.status is LPStatus.INFEASIBLE else LPStatus.UNKNOWN
        return Ball(status, np.full(p.n, np.nan), float("nan"))
    center = found.x[:-1]
    depth = (p.b - p.A @ center) / np.where(length > 0, length, 1.0)
    return Ball(LPStatus.FEASIBLE, center, float(np.clip(depth.min(initial=largest), 0.0, largest)))
