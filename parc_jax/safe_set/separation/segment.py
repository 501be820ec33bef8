"""One segment against one polygon that grows with a box of errors: the best separating direction,
and the gap it proves, in closed form. [T14]

The distance of two disjoint convex polygons is attained corner-to-edge or corner-to-corner, so one
of these directions attains it: normals of the obstacle's edges, the two normals of the segment, or
the direction from the nearest corner to the segment. The candidates only propose; the gap returned
is that of the support inequality along the chosen one.
"""

from fractions import Fraction
from types import ModuleType

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import most
from parc_jax.common.sets.rational import Point
from parc_jax.common.shapes import Scalar, Vector, Vectors
from parc_jax.safe_set.separation.inequality import excess, height

# [m] A direction that is no longer proposes nothing: its square would be subnormal and its length,
# and with it the gap, wrong by far more than rounding.
SHORTEST = 2.0**-480


def separation(pa: Vector, pb: Vector, corners: Vectors, radius: Scalar, xp: ModuleType = jnp):
    """Gap [m] and unit direction (2,) of segment [pa, pb] from polygon + disc; gap > 0 proves they
    are disjoint.

    corners: counter-clockwise, repeated corners allowed. The gap is the exact distance when
    positive, up to rounding; a touching or overlapping pair gives gap <= 0 up to rounding. xp:
    jax.numpy, or numpy for a single pair on the host, where compiling would cost more.
    """
    edges = xp.roll(corners, -1, axis=0) - corners
    normals = xp.stack([edges[:, 1], -edges[:, 0]], axis=1)
    along = pb - pa
    across = xp.stack([-along[1], along[0]])
    nearest = _nearest(pa, along, corners, xp)
    tips = xp.stack([across, -across, nearest])
    w = _unit(xp.concatenate([normals, tips]), xp)
    of_tips = xp.max(dot2(w[len(corners) :, None], corners[None]), axis=1)
    support = xp.concatenate([dot2(corners, w[: len(corners)]), of_tips])
    gaps = excess((height(w.T, pa), height(w.T, pb)), support)
    gaps = xp.where(
        xp.abs(w).sum(axis=1) > 0.5, gaps, -xp.inf
    )  # a repeated corner has no edge normal
    w = w[xp.argmax(gaps)]
    gap = excess((height(w, pa), height(w, pb)), most(height(w, corners.T)))
    return gap - radius, w


def dot2(a: Float[ArrayLike, "*#b 2"], b: Float[ArrayLike, "*#b 2"]):
    """Row-wise dot in the plane, written out: it fuses, and is no reduced-precision matmul."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def _nearest(pa: Vector, along: Vector, corners: Vectors, xp: ModuleType):
    """Vector from the nearest corner to its closest point of the segment."""
    length = along[0] * along[0] + along[1] * along[1]
    share = xp.clip(dot2(corners - pa[None], along[None]) / xp.where(length > 0, length, 1), 0, 1)
    offset = pa[None] + share[:, None] * along[None] - corners
    return offset[xp.argmin(dot2(offset, offset))]


def _unit(w: Vectors, xp: ModuleType):
    """Rows of length one; a row no longer than SHORTEST becomes zero."""
    square = dot2(w, w)
    long = square > SHORTEST**2
    length = xp.sqrt(xp.where(long, square, 1))
    return xp.where(long, 1, 0)[:, None] * w / length[:, None]


separations = jax.vmap(separation, in_axes=(0, 0, 0, None))  # over time


def signed_corners(polygon: list[Point]) -> list[tuple]:
    """[(corner, sign pattern)] of polygon + box(e), counter-clockwise, for every e >= 0 at once;
    polygon: its corners, exact, counter-clockwise. The pattern depends on the corner alone, so one
    table serves every interval and every bin.

    A corner of the sum maximises some w; near an axis of w its sign pattern changes. Walking around
    the circle in the quadrants of w gives each corner of the polygon once per quadrant that its
    normal cone meets.
    """
    out = []
    for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1)):  # quadrants of w, counter-clockwise
        entry, leave = ((sx, 0), (0, sy)) if sx == sy else ((0, sy), (sx, 0))
        start = _farthest(polygon, entry, leave)
        end = _farthest(polygon, leave, entry)
        index = start
        while True:
            out.append((polygon[index], (sx, sy)))
            if index == end:
                break
            index = (index + 1) % len(polygon)
    return out


def _farthest(polygon: list[Point], w: tuple[int, int], tie: tuple[int, int]) -> int:
    """Index of the corner maximising w, ties towards `tie`; both are plus or minus unit vectors."""
    return max(range(len(polygon)), key=lambda i: (_along(w, polygon[i]), _along(tie, polygon[i])))


def _along(axis: tuple[int, int], point: Point) -> Fraction:
    """axis . point of exact numbers, without a product."""
    value = point[0] if axis[0] else point[1]
    return value if sum(axis) > 0 else -value
