"""Edge normals of the convex hull of a few points in the plane, for many point sets at once."""

from typing import NamedTuple

import jax
import jax.numpy as jnp


class _Walk(NamedTuple):
    """State of the walk. count: edges found. here, first: (2,) points. along: (2,) last edge. normals: (m, 2)."""

    count: jax.Array
    here: jax.Array
    first: jax.Array
    along: jax.Array
    normals: jax.Array
    done: jax.Array


def hull_normals(points):
    """Outward edge normals (m, 2) of the hull of points (m, 2), not scaled; unused rows repeat one, or are zero.

    Gift wrapping in floats. Repeated and collinear points are fine. Supports along these normals describe the hull to
    rounding; since any direction gives a valid support, a poor normal can only make a set look larger, never smaller.
    Pure kernel for one set. A single point gives zeros.
    """
    leftmost = jnp.lexsort((points[:, 1], points[:, 0]))[0]
    first = points[leftmost]
    down = jnp.array([0.0, -1.0], points.dtype)
    start = _Walk(jnp.int32(0), first, first, down, jnp.zeros_like(points), jnp.bool_(False))
    end = jax.lax.while_loop(lambda w: ~w.done & (w.count < points.shape[0]), lambda w: _next_edge(points, w), start)
    index = jnp.arange(points.shape[0], dtype=jnp.int32)[:, None]
    return jnp.where(index < end.count, end.normals, end.normals[:1])


def _next_edge(points, walk: _Walk) -> _Walk:
    """Turn left as little as possible; of points in the same direction take the farthest."""
    to = points - walk.here[None]
    dot = to[:, 0] * walk.along[0] + to[:, 1] * walk.along[1]
    cross = walk.along[0] * to[:, 1] - walk.along[1] * to[:, 0]
    size = jnp.abs(cross) + jnp.abs(dot)
    # Grows with the turning angle from 0 to 2 over half a turn, with full relative precision near both ends.
    share = jnp.maximum(cross, 0) / jnp.where(size > 0, size, 1)
    turn = jnp.where(size > 0, jnp.where(dot >= 0, share, 2 - share), jnp.inf)
    least = jnp.min(turn)
    chosen = jnp.argmax(jnp.where(turn <= least, size, -1))
    edge = to[chosen]
    normals = walk.normals.at[walk.count].set(jnp.stack([edge[1], -edge[0]]))
    back = jnp.all(points[chosen] == walk.first)
    return _Walk(walk.count + 1, points[chosen], walk.first, edge, normals, back)
