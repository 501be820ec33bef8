"""How far polytopes reach: their deepest point, and the smallest box around them."""

from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import row_bounds
from parc_jax.common.lp.solve import minimise
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import OFF, corners_of_many
from parc_jax.common.tolerances import TOLERANCES


class Ball(NamedTuple):
    """A largest inscribed ball.

    center: (n,), NaN where there is none. radius: () >= 0, measured from the rows at the centre and
    not taken from the solver; -inf where the set is proved empty, NaN where that is not known.
    """

    center: np.ndarray
    radius: float


def chebyshev_center(p: HPolytope) -> Ball:
    """Centre of the largest ball in p, of a radius up to the offsets' size: p may be unbounded."""
    length = np.linalg.norm(p.A, axis=1)
    size = 1.0 + float(np.max(np.abs(p.b) / np.where(length > 0, length, 1.0), initial=0.0))
    rows = np.concatenate([p.A, length[:, None]], axis=1)
    cost = np.r_[np.zeros(p.n), -1.0]
    unknown = np.full(p.n, np.inf)
    # a negative radius, by which rows are missed, always exists
    x, bound = minimise(cost, rows, p.b, np.r_[-unknown, -size], np.r_[unknown, size])
    if bound > 0:
        return Ball(np.full(p.n, np.nan), -np.inf)
    if x is None or x[-1] < -TOLERANCES.lp_feasible:
        return Ball(np.full(p.n, np.nan), np.nan)
    center = x[:-1]
    depth = (p.b - p.A @ center) / np.where(length > 0, length, 1.0)
    return Ball(center, float(np.clip(depth.min(initial=size), 0.0, size)))


def bounding_box(s: HPolytope, name: str = "bounding_box") -> Box:
    """A box proved to contain s: two LPs per coordinate, or a closed form where each row is about
    one coordinate or about one of some disjoint pairs.

    Infinite where s is unbounded or no bound was proved. Raises InputError if s is proved empty.
    """
    if (known := _by_pairs(s)) is not None:
        return known
    lo, hi = row_bounds(s.A, s.b)
    eye = np.eye(s.n)
    least, most = ([minimise(w, s.A, s.b, lo, hi)[1] for w in way] for way in (eye, -eye))
    if -np.inf in least + most and chebyshev_center(s).radius == -np.inf:
        raise InputError(f"{name}: expected a set with points in it; rows contradict each other.")
    return Box(np.array(least), -np.array(most))


def _by_pairs(s: HPolytope) -> Box | None:
    """The box of a polytope whose rows are about disjoint pairs of coordinates. None for any other
    polytope, and where LPs have to tell: unbounded, empty or nearly so.
    """
    involved = s.A != 0
    lo, hi = row_bounds(s.A, s.b)
    for axis in range(s.n):
        rows = involved[:, axis]
        pair = np.flatnonzero(involved[rows].any(axis=0))
        if len(pair) > 2:
            return None
        if len(pair) < 2 or pair[0] != axis:
            continue
        rows = involved[:, pair].any(axis=1)
        if np.delete(involved[rows], pair, axis=1).any():
            return None
        (corners,) = corners_of_many([HPolytope(s.A[rows][:, pair], s.b[rows])])
        if corners is None:
            return None
        off = 2 * OFF * np.abs(corners).max()  # twice, for the sum
        lo[pair] = np.maximum(lo[pair], corners.min(axis=0) - off)
        hi[pair] = np.minimum(hi[pair], corners.max(axis=0) + off)
    return Box(lo, hi) if (lo <= hi).all() else None
