"""Smallest box around a polytope."""

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import row_bounds
from parc_jax.common.lp.solve import minimise
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.vertices import chebyshev_center

# [1] of the terms of a bound that is a sum of two rows: far more than their rounding
ROUNDING = 2.0**-44
STEEPEST = 2.0**20  # [1] weights of two rows, beyond which they are too nearly parallel
TIGHT = 1e-9  # [largest bound] to which a corner must meet all rows, or LPs are asked


def bounding_box(s: Box | HPolytope) -> Box:
    """A box proved to contain s, tight to lp_gap: two LPs per coordinate, or a closed form where
    each row is about one coordinate or about one of some disjoint pairs.

    Infinite where s is unbounded or no bound was proved. Raises InputError if s is proved empty.
    """
    if isinstance(s, Box):
        return s
    known = _by_pairs(s)
    if known is not None:
        return known
    lo, hi = row_bounds(s.A, s.b)
    eye = np.eye(s.n)
    least, most = ([minimise(w, s.A, s.b, lo, hi)[1] for w in way] for way in (eye, -eye))
    if -np.inf in least + most and chebyshev_center(s).radius == -np.inf:
        raise InputError(
            "bounding_box: expected a set with points in it; its rows contradict each other."
        )
    return Box(np.array(least), -np.array(most))


def _by_pairs(s: HPolytope) -> Box | None:
    """The box of a polytope whose rows are about disjoint pairs of coordinates. None for any other
    polytope, and where LPs have to tell: unbounded, empty or nearly so.
    """
    involved = s.A != 0
    lo = np.full(s.n, -np.inf)
    hi = np.full(s.n, np.inf)
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
        found = _of_polygon(s.A[rows][:, pair], s.b[rows])
        if found is None:
            return None
        lo[pair], hi[pair] = found
    alone = np.count_nonzero(involved, axis=1) == 1
    for row, offset in zip(s.A[alone], s.b[alone], strict=True):
        axis = int(np.flatnonzero(row)[0])
        bound = offset / row[axis]
        if row[axis] > 0:
            hi[axis] = min(hi[axis], np.nextafter(bound, np.inf))
        else:
            lo[axis] = max(lo[axis], np.nextafter(bound, -np.inf))
    return Box(lo, hi) if (lo <= hi).all() else None


def _of_polygon(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Lower and upper bounds (2,) of the polygon A x <= b.

    A direction w that is a nonnegative sum of two rows is bounded by the same sum of their
    offsets, and for one pair of rows that is the support: the pair of the corner farthest along w.
    """
    i, j = np.triu_indices(len(b), 1)
    cross = A[i, 0] * A[j, 1] - A[i, 1] * A[j, 0]
    i, j, cross = (x[cross != 0] for x in (i, j, cross))
    w = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[:, None]
    weight_i = (w[..., 0] * A[j, 1] - w[..., 1] * A[j, 0]) / cross
    weight_j = (A[i, 0] * w[..., 1] - A[i, 1] * w[..., 0]) / cross
    steep = weight_i * np.abs(A[i]).sum(axis=1) + weight_j * np.abs(A[j]).sum(axis=1)
    fits = (weight_i >= 0) & (weight_j >= 0) & (steep <= STEEPEST)
    if not fits.any(axis=1).all():
        return None
    bound = np.where(fits, weight_i * b[i] + weight_j * b[j], np.inf)
    size = 2 * np.abs(bound.min(axis=1)).max()
    corner = (
        np.stack([b[i] * A[j, 1] - b[j] * A[i, 1], A[i, 0] * b[j] - A[j, 0] * b[i]], axis=1)
        / cross[:, None]
    )
    inside = (corner @ A.T <= b + TIGHT * (size * np.abs(A).sum(axis=1) + np.abs(b))).all(axis=1)
    attained = fits & inside & (bound <= bound.min(axis=1)[:, None] + TIGHT * size)
    if not attained.any(axis=1).all():
        return None
    lost = ROUNDING * (weight_i * np.abs(b[i]) + weight_j * np.abs(b[j]) + steep * size)
    proved = np.where(fits, bound + lost, np.inf).min(axis=1)
    return -proved[2:], proved[:2]
