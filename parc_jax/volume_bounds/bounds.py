"""Examine a batch of boxes over (z, k): why every plan in one is unsafe, or how far that is from
being proved.

A box of k is given by all vertices of the network's cells in it. Between those, with each corner of
the box of z, everything is affine, so a condition that holds at them with a margin holds on the
whole box. [T30] All numbers are float64 and decide only which leaf to write down; the checker
derives the vertices again, exactly.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import dot
from parc_jax.network.predict import HIGHEST, Layout, by_point, predict
from parc_jax.volume_bounds.contact_margins import (
    Tried,
    contact_depth,
    contacts_to_try,
    moments,
)


class Boxes(NamedTuple):
    """A batch of n boxes.

    lo, hi: (n, n_p + n_k).
    least, most: (n, T, n_c) componentwise extremes of the interval widths over the bins that the
        box overlaps; final_least, final_most: (n, n_c + n_q).
    straddles: (n, n_k) 1.0 for several bins along this axis, else 0.0.
    """

    lo: np.ndarray
    hi: np.ndarray
    least: np.ndarray
    most: np.ndarray
    final_least: np.ndarray
    final_most: np.ndarray
    straddles: np.ndarray


class Examined(NamedTuple):
    """What is known of n boxes. A margin is how far a reason clears its condition: positive proves
    it (up to rounding). The reasons are g goal rows, s rows of the start set, c contacts.

    goal (n, g), start (n, s) [row units], hit (n, c) [m]: margins of the reasons for being unsafe.
    which: (n, c, 3) obstacle, interval, index into SHARES of each contact.
    weights: (n, c, 2^n_p, n_points) of its mixtures of points, one at each corner of the box of z.
    at: (m, c, n_points, n_p) p - z of every vertex of k at that moment.
    effects: (n, g + s + c, n_p + n_k) how much a reason's margin moves along each side of the box.
    slopes: (n, g + s + c, n_p) change of the margin per z, about.
    fits: (n,) [row units] margin of "all plans reach the goal from the start set".
    gap: (n,) [m] of the centre.
    """

    goal: jax.Array
    start: jax.Array
    hit: jax.Array
    which: jax.Array
    weights: jax.Array
    at: jax.Array
    effects: jax.Array
    slopes: jax.Array
    fits: jax.Array
    gap: jax.Array


class Middle(NamedTuple):
    """The plan in the middle of each box, and what moving k from side to side changes.

    path: (n, T + 1, n_c). moved: (n, n_k, T + 1, n_c) of p - z. moved_end: (n, n_k, n_c - n_p +
    n_q) of the end of the other points less z, and of q.
    """

    path: jax.Array
    moved: jax.Array
    moved_end: jax.Array


def offsets_from_end(net, layout: Layout, k):
    """p_s - z of all points at all knots (T + 1, n_c) and q (n_q,) of one k; z is the end of the
    first point.
    """
    offsets, q, _ = predict(net, layout, k)
    z = jnp.concatenate([offsets[-1:, : layout.n_p]] * layout.n_points, axis=1)
    return offsets - z, q


def examine(net, scene, k, owner, boxes: Boxes) -> Examined:
    """Vertices k (m, n_k) of the cells, owner (m,): number of their box, n for padding. Kernel over
    the whole batch.
    """
    n, T, n_c = boxes.least.shape
    n_p = scene.z_lo.shape[0]
    layout = Layout(T, n_p, n_c // n_p)
    back, q = jax.vmap(lambda x: offsets_from_end(net, layout, x))(k)
    z_lo = boxes.lo[:, :n_p]
    z_hi = boxes.hi[:, :n_p]
    # all points move with z
    goal_z = by_point(scene.goal_A[:, :n_c], layout.n_points).sum(axis=1)
    goal_rest = scene.goal_A[:, n_p:]

    low, high = _range_of_rows(goal_z, z_lo, z_hi)
    rest = jnp.concatenate([back[:, -1, n_p:], q], axis=1)
    least_rest, most_rest = _extremes(_times(rest, goal_rest), owner, n)
    goal_size = jnp.abs(scene.goal_A)
    goal = low + least_rest - (scene.goal_b[None] - _times(boxes.final_least, goal_size))
    fits = scene.goal_b[None] - _times(boxes.final_most, goal_size) - high - most_rest
    fits = fits.min(axis=1)

    low, high = _range_of_rows(scene.start_A, z_lo, z_hi)
    least_p0, most_p0 = _extremes(_times(back[:, 0, :n_p], scene.start_A), owner, n)
    start = low + least_p0 - scene.start_b[None]
    fits = jnp.minimum(fits, (scene.start_b[None] - high - most_p0).min(axis=1))

    middle = _middle(net, layout, boxes)
    least_back, most_back = _extremes(back, owner, n)
    half_z = jnp.concatenate([(z_hi - z_lo) / 2] * layout.n_points, axis=1)
    half_size = (most_back - least_back) / 2 + half_z[:, None]
    tried = contacts_to_try(scene, middle.path, half_size, boxes.least, z_hi - z_lo)
    at, depth = contact_depth(scene, tried, back, owner, z_lo, z_hi, boxes.least)
    _, worst = _extremes(depth, owner, n)

    rows = jnp.concatenate([goal_z, scene.start_A])
    slopes = jnp.concatenate([jnp.broadcast_to(rows[None], (n, *rows.shape)), -tried.way], axis=1)
    effects = _effects_of_sides(
        [goal_z, scene.start_A],
        [middle.moved_end, middle.moved[:, :, 0, :n_p]],
        [goal_rest, scene.start_A],
        z_hi - z_lo,
        tried,
        middle.moved,
    )
    effects = effects.at[:, :, n_p:].add(_effects_of_bins(goal_size, start, tried, boxes))
    which = jnp.stack([tried.obstacle, tried.interval, tried.share], axis=2)
    return Examined(goal, start, -worst, which, tried.weights, at, effects, slopes, fits, tried.gap)


examine_jit = jax.jit(examine)


def _extremes(x, owner, n: int):
    """Least and most (n, ...) over the vertices of each box, x (m, ...)."""
    least = jax.ops.segment_min(x, owner, n + 1)[:n]
    most = jax.ops.segment_max(x, owner, n + 1)[:n]
    return least, most


def _range_of_rows(A, z_lo, z_hi):
    """Least and most of A z over the boxes of z: (n, rows) each."""
    low = A[None] * z_lo[:, None]
    high = A[None] * z_hi[:, None]
    return jnp.minimum(low, high).sum(axis=2), jnp.maximum(low, high).sum(axis=2)


def _middle(net, layout: Layout, boxes: Boxes) -> Middle:
    n_p = layout.n_p
    half_k = (boxes.hi[:, n_p:] - boxes.lo[:, n_p:]) / 2
    n_k = half_k.shape[1]
    center = (boxes.hi + boxes.lo) / 2
    steps = jnp.concatenate([jnp.zeros((1, n_k)), jnp.eye(n_k), -jnp.eye(n_k)])
    probes = center[:, None, n_p:] + steps[None] * half_k[:, None]
    back, q = jax.vmap(jax.vmap(lambda x: offsets_from_end(net, layout, x)))(probes)
    end = jnp.concatenate([back[:, :, -1, n_p:], q], axis=2)
    z = jnp.concatenate([center[:, None, :n_p]] * layout.n_points, axis=2)
    return Middle(
        path=z + back[:, 0],
        moved=back[:, 1 : n_k + 1] - back[:, n_k + 1 :],
        moved_end=end[:, 1 : n_k + 1] - end[:, n_k + 1 :],
    )


def _times(x, A):
    """x (n, j), A (rows, j) -> (n, rows)."""
    return jnp.matmul(x, A.T, precision=HIGHEST)


def _mixed(x, tried: Tried):
    """Columns x (n, c, ..., n_c) mixed as the points of each contact are, by the mean of its
    weights: (n, c, ..., n_p).
    """
    weights = tried.weights.mean(axis=2)
    weights = weights.reshape(*weights.shape[:2], *[1] * (x.ndim - 2), weights.shape[2])
    return dot(jnp.swapaxes(by_point(x, weights.shape[-1]), -1, -2), weights)


def _effects_of_sides(z_rows, k_moves, k_rows, z_size, tried: Tried, moved):
    """|change| of goal rows, start rows and contacts along the sides: (n, g + s + c, n_p + n_k)."""
    n = len(z_size)
    along_z = [jnp.abs(A)[None] * z_size[:, None] for A in z_rows]
    along_z.append(jnp.abs(tried.way) * z_size[:, None])
    along_k = [
        jnp.abs(jnp.einsum("nij,rj->nri", move, A, precision=HIGHEST))
        for move, A in zip(k_moves, k_rows, strict=True)
    ]
    moved_at = moments(moved)[jnp.arange(n)[:, None], :, tried.interval, tried.share]
    moved_at = _mixed(moved_at, tried)
    along_k.append(jnp.abs(jnp.einsum("ncij,ncj->nci", moved_at, tried.way, precision=HIGHEST)))
    parts = [jnp.concatenate([z, k], axis=2) for z, k in zip(along_z, along_k, strict=True)]
    return jnp.concatenate(parts, axis=1)


def _effects_of_bins(goal_size, start, tried: Tried, boxes: Boxes):
    """|change| of the reasons when the box is split at the edges of bins: (n, g + s + c, n_k)."""
    n = len(boxes.lo)
    more_goal = _times(boxes.final_most - boxes.final_least, goal_size)
    wider = (boxes.most - boxes.least)[jnp.arange(n)[:, None], tried.interval]
    more_hit = dot(jnp.abs(tried.way), _mixed(wider, tried))
    blur = jnp.concatenate([more_goal, jnp.zeros_like(start), more_hit], axis=1)
    count = jnp.maximum(boxes.straddles.sum(axis=1), 1.0)
    return blur[:, :, None] * (boxes.straddles / count[:, None])[:, None]
