"""Operations on polytopes: Minkowski sum, Pontryagin difference, clipping, redundant rows.

Minkowski sum {x + y : x in P, y in Q}: how an obstacle grows. Offsets are rounded up.

Pontryagin difference {x : x + y in P for all y in Q}: how a goal shrinks. Offsets are rounded
down.

Cutting a polytope given by its vertices with axis-aligned walls, never too small.

Rows that can go without changing the set.
"""

import numpy as np
from jaxtyping import Float

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import gamma, round_up
from parc_jax.common.lp.program import LPStatus
from parc_jax.common.lp.solve import solve
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import convex_hull
from parc_jax.common.sets.rational import exact_support, rational_vertices
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.neuralparc.sets.affine import Set, as_ah, product
from parc_jax.neuralparc.sets.membership import support


def minkowski_sum(p: Set, q: Set) -> Set:
    """The sum of any two sets, exact. Two boxes give a box (rounded outward), else an AH-polytope
    of stacked bases.
    """
    if p.n != q.n:
        raise InputError(f"minkowski_sum: expected two sets of one dimension; got {p.n} and {q.n}.")
    if isinstance(p, Box) and isinstance(q, Box):
        return Box(np.nextafter(p.lo + q.lo, -np.inf), np.nextafter(p.hi + q.hi, np.inf))
    both = product(as_ah(p), as_ah(q))
    return both.replace(G=both.G[: p.n] + both.G[p.n :], c=both.c[: p.n] + both.c[p.n :])


def grow(p: HPolytope, radius: Float[np.ndarray, "... n"]) -> HPolytope:
    """P plus the box [-radius, radius] along the rows of P: contains the sum, and equals it if P
    has the box's normals.

    p: h rows in R^n. radius: (..., n) >= 0. Returns b of shape (..., h). In the plane,
    `with_axis_rows` adds the four axis normals, so that the result is the sum itself.
    """
    gain = radius @ np.abs(p.A).T
    slack = gamma(p.n + 2) * (np.abs(p.b) + gain)
    return p.replace(b=np.nextafter(p.b + gain + slack, np.inf))


def polygon_sum(p: HPolytope, q: HPolytope) -> HPolytope:
    """Sum of two bounded polygons as an H-polytope: the normals of both, offsets from exact
    vertices, rounded up.

    In the plane every edge of the sum is parallel to an edge of one of them. Raises InputError if a
    set is empty or unbounded.
    """
    normals = np.concatenate([p.A, q.A])
    corners = [rational_vertices(s) for s in (p, q)]
    if not all(corners):
        raise InputError("polygon_sum: expected two sets with points in them; one is empty.")
    offsets = [round_up(sum(exact_support(points, w) for points in corners)) for w in normals]
    return HPolytope(normals, np.array(offsets))


def with_axis_rows(p: HPolytope) -> HPolytope:
    """The same bounded polygon with the four axis normals as (touching) rows added, rounded up."""
    axes = np.concatenate([np.eye(2), -np.eye(2)])
    corners = rational_vertices(p)
    if not corners:
        raise InputError("with_axis_rows: expected a set with points in it; it is empty.")
    offsets = np.array([round_up(exact_support(corners, w)) for w in axes])
    return HPolytope(np.concatenate([p.A, axes]), np.r_[p.b, offsets])


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


_UNIT = 2.0**-53


def clip_to_box(points: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Points whose hull is hull(points) cut by lo <= x <= hi, up to rounding: (v, n) -> (w, n); (0,
    n) if they miss.

    Rounded outward along the edges: where an edge is nearly parallel to a wall, the point of
    intersection is uncertain, and the far end of what is possible is taken.
    """
    for axis in range(points.shape[1]):
        for value, side in ((hi[axis], 1.0), (lo[axis], -1.0)):
            points = _cut(points, axis, value, side)
    return points


def extreme_points(points: np.ndarray) -> np.ndarray:
    """Those of the points that span their hull, by Qhull; all of them if the hull is flat."""
    if points.shape[1] == 1:
        return np.unique(points, axis=0)[[0, -1]] if len(points) else points
    points = np.unique(points, axis=0)
    if len(points) <= points.shape[1] + 1:
        return points
    hull = convex_hull(points)
    return points if hull is None else points[hull.vertices]


def _cut(points: np.ndarray, axis: int, value: float, side: float) -> np.ndarray:
    """Hull of points cut by side * x[axis] <= side * value: what lies inside, and where
    inside-outside pairs cross.
    """
    x = side * points[:, axis]
    inside = points[x <= side * value]
    outside = points[x > side * value]
    if not (len(inside) and len(outside)):
        return inside
    start = inside[:, None]
    end = outside[None]
    span = side * (end[..., axis] - start[..., axis])
    # Every pair crosses inside the hull, so pairs that are no edges do no harm.
    share = side * (value - start[..., axis]) / span
    uncertain = 4 * _UNIT * (abs(value) + np.abs(start[..., axis]) + np.abs(end[..., axis])) / span
    crossing = start + np.minimum(share + uncertain, 1.0)[..., None] * (end - start)
    return extreme_points(np.concatenate([inside, crossing.reshape(-1, points.shape[1])]))


def irredundant_rows(p: HPolytope) -> np.ndarray:
    """Indices of rows that define the same set, in order: one LP per row, each against the rows
    kept so far.

    A row is dropped only with a proof that the others keep a.x <= b + redundant_row (|a| + |b|):
    the set can only grow, and by no more than that. Undecided rows stay, and so do all that empty a
    set.
    """
    kept = list(_without_repeats(p))
    for row in list(kept):
        others = [i for i in kept if i != row]
        if not others:
            break
        # The row itself, moved out by one length, keeps the LP bounded.
        length = float(np.linalg.norm(p.A[row]))
        A = np.concatenate([p.A[others], p.A[[row]]])
        found = solve(-p.A[row], A, np.r_[p.b[others], p.b[row] + length])
        # With no point at all, the moved row itself may be what empties the set: keep it.
        has_point = found.status in (LPStatus.OPTIMAL, LPStatus.FEASIBLE)
        slack = TOLERANCES.redundant_row * (length + abs(p.b[row]))
        if has_point and -found.lower <= p.b[row] + slack:
            kept = others
    return np.array(sorted(kept), dtype=int)


def without_redundant_rows(p: HPolytope) -> HPolytope:
    """The same set (see `irredundant_rows`) with fewer rows."""
    rows = irredundant_rows(p)
    return HPolytope(p.A[rows], p.b[rows])


def _without_repeats(p: HPolytope) -> list[int]:
    """Of rows that are exact positive multiples by a power of two, or equal, the tightest; trivial
    rows 0 <= b go.
    """
    best: dict[bytes, int] = {}
    for i, (row, offset) in enumerate(zip(p.A, p.b, strict=True)):
        if not row.any():
            if offset < 0:
                best[row.tobytes() + b"contradiction"] = i
            continue
        scale = _power_of_two(row)
        name = (row * scale + 0.0).tobytes()
        other = best.get(name)
        if other is None or offset * scale < p.b[other] * _power_of_two(p.A[other]):
            best[name] = i
    return sorted(best.values())


def _power_of_two(row: np.ndarray) -> float:
    """Factor that brings the largest entry of a row into [1/2, 1), without rounding."""
    return 2.0 ** -np.frexp(float(np.abs(row).max()))[1]
