"""One segment against one grown obstacle: the best separating direction, and the gap it proves.
[T14]

The distance of two disjoint convex polygons is attained corner-to-edge or corner-to-corner, so one
of these directions attains it: normals of the obstacle's edges, the two normals of the segment, or
the direction from the nearest corner to the segment. The candidates only propose; the gap returned
is what the support inequality of the chosen one gives.
"""

import jax
import jax.numpy as jnp

# [m] A direction that is no longer proposes nothing: its square would be subnormal and its length,
# and with it the gap, wrong by far more than rounding.
SHORTEST = 2.0**-480


def separation(pa, pb, corners, radius, xp=jnp):
    """Gap [m] and unit direction (2,) of segment [pa, pb] from polygon + disc; gap > 0 proves they
    are disjoint.

    pa, pb: (2,). corners: (m, 2) counter-clockwise, repeated corners allowed. radius: (). The gap
    is the exact distance when positive, up to rounding; a touching or overlapping pair gives gap <=
    0 up to rounding. xp: jax.numpy, or numpy for a single pair on the host, where compiling would
    cost more.
    """
    edges = xp.roll(corners, -1, axis=0) - corners
    normals = xp.stack([edges[:, 1], -edges[:, 0]], axis=1)
    along = pb - pa
    across = xp.stack([-along[1], along[0]])
    nearest = _nearest(pa, along, corners, xp)
    tips = xp.stack([across, -across, nearest])
    w = _unit(xp.concatenate([normals, tips]), xp)
    support = xp.concatenate(
        [dot2(corners, w[: len(corners)]), _support(corners, w[len(corners) :], xp)]
    )
    gaps = xp.minimum(dot2(w, pa[None]), dot2(w, pb[None])) - support
    gaps = xp.where(
        xp.abs(w).sum(axis=1) > 0.5, gaps, -xp.inf
    )  # a repeated corner has no edge normal
    w = w[xp.argmax(gaps)]
    gap = xp.minimum(dot2(w, pa), dot2(w, pb)) - xp.max(dot2(corners, w[None]))
    return gap - radius, w


def dot2(a, b):
    """Row-wise dot product in the plane, written out so that it fuses and never becomes a
    reduced-precision matmul.
    """
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def _nearest(pa, along, corners, xp):
    """Vector from the nearest corner to its closest point of the segment."""
    length = along[0] * along[0] + along[1] * along[1]
    share = xp.clip(dot2(corners - pa[None], along[None]) / xp.where(length > 0, length, 1), 0, 1)
    offset = pa[None] + share[:, None] * along[None] - corners
    return offset[xp.argmin(dot2(offset, offset))]


def _support(corners, w, xp):
    return xp.max(dot2(w[:, None], corners[None]), axis=1)


def _unit(w, xp):
    """Rows of length one; a row no longer than SHORTEST becomes zero."""
    square = dot2(w, w)
    long = square > SHORTEST**2
    length = xp.sqrt(xp.where(long, square, 1))
    return xp.where(long, 1, 0)[:, None] * w / length[:, None]


separations = jax.vmap(separation, in_axes=(0, 0, 0, None))  # over time
