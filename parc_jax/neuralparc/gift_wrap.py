"""Edge normals of the convex hull of a few points in the plane, for many point sets at once."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

# [extent of the set] points closer than this count as one; merging only makes the set look larger
_SAME = 1e-13


class _Walk(NamedTuple):
    """All walks, in step.

    count: edges found. x, y: (...) where they are. u, v: (...) their last edges.
    normal_x, normal_y: (m, ...). closed: (...) whether a walk has come back to its start.
    """

    count: jax.Array
    x: jax.Array
    y: jax.Array
    u: jax.Array
    v: jax.Array
    normal_x: jax.Array
    normal_y: jax.Array
    closed: jax.Array


def hull_normals(x, y):
    """Outward edge normals of the hull of m points (x, y), not scaled: a pair of arrays (m, ...).

    x, y: (m, ...), one set along axis 0, or many along trailing axes. Rows beyond the last edge
    repeat earlier ones. Gift wrapping in floats; repeated and collinear points are fine, a single
    point gives zeros. Supports along these normals describe the hull to rounding; since any
    direction gives a valid support, a poor normal can only make a set look larger, never smaller.
    """
    left = x.min(0)
    low = jnp.where(x == left[None], y, jnp.inf).min(0)
    extent = jnp.maximum(x.max(0) - left, y.max(0) - y.min(0))
    start = _Walk(
        count=jnp.int32(0),
        x=left,
        y=low,
        u=jnp.zeros_like(left),
        v=-jnp.ones_like(left),
        normal_x=jnp.zeros_like(x),
        normal_y=jnp.zeros_like(y),
        closed=jnp.zeros_like(left, dtype=bool),
    )

    def going(walk: _Walk):
        return (walk.count < x.shape[0]) & ~walk.closed.all()

    def step(walk: _Walk):
        return _next_edge(x, y, left, low, _SAME * extent, walk)

    end = jax.lax.while_loop(going, step, start)
    used = _numbers(x) < end.count
    normal_x = jnp.where(used, end.normal_x, end.normal_x[:1])
    normal_y = jnp.where(used, end.normal_y, end.normal_y[:1])
    return normal_x, normal_y


def _next_edge(x, y, left, low, tiny, walk: _Walk) -> _Walk:
    """Turn left as little as possible; of points in the same direction take the farthest."""
    to_x = x - walk.x[None]
    to_y = y - walk.y[None]
    dot = to_x * walk.u[None] + to_y * walk.v[None]
    cross = walk.u[None] * to_y - walk.v[None] * to_x
    length = jnp.maximum(jnp.abs(to_x), jnp.abs(to_y))
    away = length > tiny[None]
    # Grows with the turning angle from 0 to 2 over half a turn, with full relative precision near
    # both ends.
    share = jnp.maximum(cross, 0) / jnp.where(away, jnp.abs(cross) + jnp.abs(dot), 1)
    turn = jnp.where(away, jnp.where(dot >= 0, share, 2 - share), jnp.inf)
    far = jnp.where(turn <= turn.min(0)[None], jnp.where(away, length, 0), -1)
    number = _numbers(x)
    # The first of the farthest; written as two minima because XLA does not vectorise argmax on a
    # CPU.
    chosen = number == jnp.where(far >= far.max(0)[None], number, x.shape[0]).min(0)[None]
    here_x = jnp.where(chosen, x, 0).sum(0)
    here_y = jnp.where(chosen, y, 0).sum(0)
    u = here_x - walk.x
    v = here_y - walk.y
    back = jnp.maximum(jnp.abs(here_x - left), jnp.abs(here_y - low)) <= tiny
    moved = (u != 0) | (v != 0)  # a single point stays where it is and keeps looking down
    return _Walk(
        count=walk.count + 1,
        x=here_x,
        y=here_y,
        u=jnp.where(moved, u, walk.u),
        v=jnp.where(moved, v, walk.v),
        normal_x=walk.normal_x.at[walk.count].set(v),
        normal_y=walk.normal_y.at[walk.count].set(-u),
        closed=walk.closed | back,
    )


def _numbers(x):
    """Point numbers along axis 0, to compare with arrays like x."""
    return jnp.arange(x.shape[0], dtype=jnp.int32).reshape((-1,) + (1,) * (x.ndim - 1))
