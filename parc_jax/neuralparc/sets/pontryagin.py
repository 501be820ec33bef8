"""Pontryagin difference {x : x + y in P for all y in Q}: how a goal shrinks. Offsets are rounded
down.
"""

import numpy as np
from jaxtyping import Float

from parc_jax.common.errors import InputError
from parc_jax.common.lp.witness import gamma
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.neuralparc.sets.affine import Set
from parc_jax.neuralparc.sets.support import support


def shrink(p: HPolytope, radius: Float[np.ndarray, "... n"]) -> HPolytope:
    """P minus the box [-radius, radius], closed form. [NP, Sec. III-B]

    p: h rows in R^n. radius: (..., n) >= 0. Returns b of shape (..., h): one shrunken polytope per
        leading index.
    """
    # |A| radius, not A radius: each row loses the box corner that hurts it most.
    loss = radius @ np.abs(p.A).T
    slack = gamma(p.n + 2) * (np.abs(p.b) + loss)
    return p.replace(b=np.nextafter(p.b - loss - slack, -np.inf))


def pontryagin_difference(p: HPolytope, q: Set) -> HPolytope:
    """P minus any set Q: row i loses the support of Q along it. Box in closed form, else one LP per
    row.

    Raises InputError if Q is unbounded along a row of P, or if an LP proved no bound (then the
    difference is undecided, and an empty one is the only safe answer).
    """
    if p.n != q.n:
        raise InputError(
            f"pontryagin_difference: expected two sets of one dimension; got {p.n} and {q.n}."
        )
    if isinstance(q, Box):
        moved = shrink(p, q.radius)
        drift = p.A @ q.center
        size = np.abs(p.A) @ np.maximum(np.abs(q.lo), np.abs(q.hi))
        slack = gamma(p.n + 5) * (np.abs(moved.b) + size)
        return moved.replace(b=np.nextafter(moved.b - drift - slack, -np.inf))
    loss = support(q, p.A).upper
    if not (loss < np.inf).all():
        row = int(np.argmax(loss))
        raise InputError(
            f"pontryagin_difference: expected Q to be bounded along every row of P; row {row} has "
            "no proved bound. "
            "Give Q the missing rows, or rescale its rows to unit length."
        )
    return p.replace(b=np.nextafter(p.b - loss, -np.inf))
