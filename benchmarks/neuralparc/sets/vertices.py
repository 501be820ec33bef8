"""Vertices in up to six dimensions, through Qhull, empty and flat sets included."""

import numpy as np
from jaxtyping import Float

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.common.lp.solve import minimise
from parc_jax.common.sets.extent import chebyshev_center
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import halfspace_intersection

MAX_N = 6
# [size of the set] thinner sets are treated as flat: their vertices move by at most this much
_FLAT = 1e-9
_SAME = 1e-10  # [size of the set] vertices closer than this are one


def vertices(p: HPolytope) -> Float[np.ndarray, "v n"]:
    """Vertices (v, n) of a bounded polytope, in no particular order; (0, n) if it is proved empty.

    Floats: a vertex misses its rows by rounding. For exact ones use `rational_vertices`, or
    supports.
    Raises InputError if p is unbounded or n > 6, SoundnessError if emptiness could not be decided.
    """
    if p.n > MAX_N:
        raise InputError(f"vertices: expected at most {MAX_N} dimensions; got {p.n}. Use supports.")
    ball = chebyshev_center(p)
    if ball.radius == -np.inf:
        return np.zeros((0, p.n))
    if np.isnan(ball.radius):
        raise SoundnessError(
            "vertices: could not decide whether the set is empty. Rescale its rows to unit length."
        )
    length = np.linalg.norm(p.A, axis=1)
    kept = length > 0
    rows = HPolytope(p.A[kept] / length[kept, None], p.b[kept] / length[kept])
    size = 1.0 + float(np.abs(ball.center).max())
    if ball.radius > _FLAT * size:
        found = _round_vertices(rows, ball.center)
    else:
        found = _flat_vertices(rows, size)
    distinct: list[np.ndarray] = []  # one of every cluster of points that close per coordinate
    for q in found[np.lexsort(found.T)]:
        if not any((np.abs(q - other) <= _SAME * size).all() for other in distinct):
            distinct.append(q)
    return np.array(distinct).reshape(-1, p.n)


def _round_vertices(p: HPolytope, inside: np.ndarray) -> np.ndarray:
    """Vertices of a full-dimensional polytope from an interior point."""
    if p.n == 1:
        ends = p.b / p.A[:, 0]
        above = ends[p.A[:, 0] > 0]
        below = ends[p.A[:, 0] < 0]
        if not (len(above) and len(below)):
            raise _unbounded()
        return np.array([[below.max()], [above.min()]])
    found = halfspace_intersection(p.A, p.b, inside)
    if found is None:
        raise _unbounded()  # too few rows to enclose the point, or all parallel
    # The dual points enclose the origin exactly when the rows close the set in every direction.
    closed = (found.dual_equations[:, -1] < -1e-12).all()
    if not closed or not np.isfinite(found.intersections).all():
        raise _unbounded()
    return found.intersections


def _flat_vertices(p: HPolytope, size: float) -> np.ndarray:
    """Vertices of a set without interior: rows that are equalities are solved for, taken out."""
    n = p.n
    h = len(p.b)
    # max sum t over A x + t <= b s, 0 <= t <= 1, s large: of x / s exactly the rows that can be
    # slack somewhere get t = 1, all at once
    rows = np.concatenate([p.A, -p.b[:, None], np.eye(h)], axis=1)
    unknown = np.full(n, np.inf)
    found, _ = minimise(
        np.r_[np.zeros(n + 1), -np.ones(h)],
        rows,
        np.zeros(h),
        np.r_[-unknown, 1.0, np.zeros(h)],
        np.r_[unknown, 1 / (10 * _FLAT * size), np.ones(h)],
    )
    if found is None:
        raise SoundnessError(
            "vertices: could not find the flat directions of the set. Rescale its rows to unit "
            "length."
        )
    point = found[:n] / found[n]
    tight = found[n + 1 :] < 0.5
    _, singular, right = np.linalg.svd(p.A[tight])
    rank = int((singular > 1e-9).sum())
    if rank == n:
        return point[None]
    free = right[rank:].T
    inner = p.A[~tight] @ free
    offset = p.b[~tight] - p.A[~tight] @ point
    used = np.linalg.norm(inner, axis=1) > 1e-9
    if rank == 0 or not used.any():
        raise _unbounded()
    return point + vertices(HPolytope(inner[used], offset[used])) @ free.T


def _unbounded() -> InputError:
    return InputError(
        "vertices: expected a bounded set; its rows leave a direction open. Add the missing rows."
    )
