"""One segment against one polygon that grows with a box of errors: the best separating direction,
and the gap it proves, in closed form. [T14]

The distance of two disjoint convex polygons is attained corner-to-edge or corner-to-corner, so one
of these directions attains it: normals of the obstacle's edges, the two normals of the segment, or
the direction from the nearest corner to the segment. The candidates only propose; the gap returned
is that of the support inequality along the chosen one.
"""

from itertools import product
from types import ModuleType

import jax.numpy as jnp

from parc_jax.common.arrays import most
from parc_jax.common.sets.rational import Point, convex_polygon
from parc_jax.common.shapes import Indices, Scalar
from parc_jax.safe_set.separation.inequality import Array, excess, height

# [m] A direction that is no longer proposes nothing: its square would be subnormal and its length,
# and with it the gap, wrong by far more than rounding.
SHORTEST = 2.0**-480


def separation(pa: Array, pb: Array, corners: Array, radius: Scalar, xp: ModuleType = jnp):
    """Gap (*b) [m], unit direction (2, *b) of segments to polygon + disc; > 0 proves them apart.

    pa, pb (2, *b); corners (v, 2, *b), counter-clockwise, some repeated. Axis b is the fast one:
    time. The gap is the exact distance when positive, up to rounding, and of a pair that touches
    not positive. xp: jax.numpy, or numpy for a single pair on the host, where compiling costs more.
    """
    edges = xp.roll(corners, -1, axis=0) - corners
    normals = _unit(xp.stack([edges[:, 1], -edges[:, 0]], axis=1), xp)
    along = pb - pa
    across = xp.stack([-along[1], along[0]])
    tips = _unit(xp.stack([across, -across, _nearest(pa, along, corners, xp)]), xp)
    gaps = _gaps(normals, pa, pb, dot2(corners, normals), xp)
    gap, w = gaps.max(axis=0), _row(gaps.argmax(axis=0), normals, xp)
    for tip in tips:
        other = _gaps(tip[None], pa, pb, dot2(corners, tip[None]).max(axis=0)[None], xp)[0]
        gap, w = xp.maximum(gap, other), xp.where(other > gap, tip, w)
    gap = excess((height(w, pa), height(w, pb)), most(dot2(corners, w[None]), axis=0))
    return gap - radius, w


def dot2(a: Array, b: Array):
    """(n, *b) of rows (n, 2, *b), written out: it fuses, and is no reduced-precision matmul."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]


def _gaps(w: Array, pa: Array, pb: Array, support: Array, xp: ModuleType):
    """(n, *b) along directions w (n, 2, *b), without the radius."""
    gaps = excess((dot2(w, pa[None]), dot2(w, pb[None])), support)
    return xp.where(xp.abs(w).sum(axis=1) > 0.5, gaps, -xp.inf)  # a repeated corner has no normal


def _row(i: Indices, rows: Array, xp: ModuleType):
    """Row i (*b) of rows (n, 2, *b). A gather would read number by number."""
    chosen = xp.arange(len(rows)).reshape(-1, *[1] * i.ndim) == i[None]
    return xp.where(chosen[:, None], rows, 0.0).sum(axis=0)


def _nearest(pa: Array, along: Array, corners: Array, xp: ModuleType):
    """(2, *b) from the nearest corner to its closest point of the segment."""
    length = height(along, along)
    share = dot2(corners - pa[None], along[None]) / xp.where(length > 0, length, 1)[None]
    offset = pa[None] + xp.clip(share, 0, 1)[:, None] * along[None] - corners
    return _row(dot2(offset, offset).argmin(axis=0), offset, xp)


def _unit(w: Array, xp: ModuleType):
    """Rows (n, 2, *b) of length one; a row no longer than SHORTEST becomes zero."""
    square = dot2(w, w)
    long = square > SHORTEST**2
    return xp.where(long, 1, 0)[:, None] * w / xp.sqrt(xp.where(long, square, 1))[:, None]


def signed_corners(points: list[Point]) -> list[tuple]:
    """[(corner, sign pattern)] of the hull of exact points + box(e), counter-clockwise, for every
    e >= 0 at once. The pattern depends on the corner alone, so one table serves every interval and
    every bin.

    Which corners and signs make those of the sum is the same for all boxes, so that of half width 1
    is added: each corner of a sum is one of one corner and one sign pattern alone.
    """
    signs = list(product((-1, 1), repeat=2))
    parts = {(x + sx, y + sy): ((x, y), (sx, sy)) for x, y in points for sx, sy in signs}
    return [parts[corner] for corner in convex_polygon(list(parts))]
