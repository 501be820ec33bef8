"""Examine a batch of boxes over (z, k): why every plan in one is unsafe, or how far that is from
being proved.

A box of k is given by all vertices of the network's cells in it. Between those, with each corner of
the box of z, everything is affine, so a condition that holds at them with a margin holds on the
whole box. [T30] All numbers are float64 and decide only which leaf to write down; the checker
derives the vertices again, exactly.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.network.predict import HIGHEST, Layout, predict
from parc_jax.obstacles.segment import dot2

SHARES = (0.0, 0.5, 1.0)  # moments within an interval at which contact is tried
CANDIDATES = 6  # (obstacle, interval, moment) tried per box, the most promising first


class Boxes(NamedTuple):
    """A batch of n boxes.

    lo, hi: (n, n_p + n_k).
    least, most: (n, T, n_p) componentwise extremes of the interval widths over the bins that the
        box overlaps; final_least, final_most: (n, n_p + n_q).
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
    at: (m, c, 2) p - z of every vertex of k at that moment.
    effects: (n, g + s + c, n_p + n_k) how much a reason's margin moves along each side of the box.
    slopes: (n, g + s + c, n_p) change of the margin per z, about.
    fits: (n,) [row units] margin of "all plans reach the goal from the start set".
    gap: (n,) [m] of the centre.
    """

    goal: jax.Array
    start: jax.Array
    hit: jax.Array
    which: jax.Array
    at: jax.Array
    effects: jax.Array
    slopes: jax.Array
    fits: jax.Array
    gap: jax.Array


class Middle(NamedTuple):
    """The plan in the middle of each box, and what moving k from side to side changes.

    path: (n, T + 1, n_p). moved: (n, n_k, T + 1, n_p) of p - z. moved_q: (n, n_k, n_q).
    """

    path: jax.Array
    moved: jax.Array
    moved_q: jax.Array


class Candidates(NamedTuple):
    """The contacts tried in each box. obstacle, interval, share: (n, c) numbers. way: (n, c, 2)
    directions out of the obstacle. gap: (n,) [m] of the middle of the box, over all of them.
    """

    obstacle: jax.Array
    interval: jax.Array
    share: jax.Array
    way: jax.Array
    gap: jax.Array


def offsets_from_end(net, n_steps: int, n_p: int, k):
    """p_s - z at all knots (T + 1, n_p) and q (n_q,) of one k."""
    offsets, q, _ = predict(net, Layout(n_steps, n_p), k)
    return offsets - offsets[-1:], q


def examine(net, scene, k, owner, boxes: Boxes) -> Examined:
    """Vertices k (m, n_k) of the cells, owner (m,): number of their box, n for padding. Kernel over
    the whole batch.
    """
    n = len(boxes.lo)
    T, n_p = boxes.least.shape[1:]
    back, q = jax.vmap(lambda x: offsets_from_end(net, T, n_p, x))(k)
    z_lo = boxes.lo[:, :n_p]
    z_hi = boxes.hi[:, :n_p]
    goal_p = scene.goal_A[:, :n_p]
    goal_q = scene.goal_A[:, n_p:]

    low, high = _range_of_rows(goal_p, z_lo, z_hi)
    least_q, most_q = _extremes(_times(q, goal_q), owner, n)
    goal_size = jnp.abs(scene.goal_A)
    goal = low + least_q - (scene.goal_b[None] - _times(boxes.final_least, goal_size))
    fits = scene.goal_b[None] - _times(boxes.final_most, goal_size) - high - most_q
    fits = fits.min(axis=1)

    low, high = _range_of_rows(scene.start_A, z_lo, z_hi)
    least_p0, most_p0 = _extremes(_times(back[:, 0], scene.start_A), owner, n)
    start = low + least_p0 - scene.start_b[None]
    fits = jnp.minimum(fits, (scene.start_b[None] - high - most_p0).min(axis=1))

    middle = _middle(net, boxes)
    least_back, most_back = _extremes(back, owner, n)
    half_size = (most_back - least_back) / 2 + ((z_hi - z_lo) / 2)[:, None]
    tried = _candidates(scene.obstacles, middle.path, half_size, boxes)
    at, depth = _contact_depth(scene.obstacles, tried, back, owner, boxes)
    _, worst = _extremes(depth, owner, n)

    rows = jnp.concatenate([goal_p, scene.start_A])
    slopes = jnp.concatenate([jnp.broadcast_to(rows[None], (n, *rows.shape)), -tried.way], axis=1)
    effects = _effects_of_sides(
        [goal_p, scene.start_A],
        [middle.moved_q, middle.moved[:, :, 0]],
        [goal_q, scene.start_A],
        z_hi - z_lo,
        tried,
        middle.moved,
    )
    effects = effects.at[:, :, n_p:].add(_effects_of_bins(goal_size, start, tried, boxes))
    which = jnp.stack([tried.obstacle, tried.interval, tried.share], axis=2)
    return Examined(goal, start, -worst, which, at, effects, slopes, fits, tried.gap)


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


def _middle(net, boxes: Boxes) -> Middle:
    T, n_p = boxes.least.shape[1:]
    half_k = (boxes.hi[:, n_p:] - boxes.lo[:, n_p:]) / 2
    n_k = half_k.shape[1]
    center = (boxes.hi + boxes.lo) / 2
    steps = jnp.concatenate([jnp.zeros((1, n_k)), jnp.eye(n_k), -jnp.eye(n_k)])
    probes = center[:, None, n_p:] + steps[None] * half_k[:, None]
    back, q = jax.vmap(jax.vmap(lambda x: offsets_from_end(net, T, n_p, x)))(probes)
    return Middle(
        path=center[:, None, :n_p] + back[:, 0],
        moved=back[:, 1 : n_k + 1] - back[:, n_k + 1 :],
        moved_q=q[:, 1 : n_k + 1] - q[:, n_k + 1 :],
    )


def _candidates(obstacles, path, half_size, boxes: Boxes) -> Candidates:
    """The contacts whose gap at the middle of the box, plus half the box along it, is smallest.

    These gaps only steer the search. With the widest widths instead of the least ones they would
    point at worse contacts, but prove nothing false: whether a contact holds is decided by
    `_contact_depth`, with the least widths, and in the end by the checker.
    """
    n = len(path)
    gaps, ways = jax.vmap(_gaps, in_axes=(None, 0, 0))(obstacles, path, boxes.least)
    score = gaps + dot2(jnp.abs(ways), _moments(half_size)[:, None])
    scores = -score.reshape(n, -1)
    _, flat = jax.lax.top_k(scores, min(CANDIDATES, scores.shape[1]))
    o, t, share = jnp.unravel_index(flat, score.shape[1:])
    way = ways[jnp.arange(n)[:, None], o, t, share]
    return Candidates(o, t, share, way, gaps.min(axis=(1, 2, 3)))


def _contact_depth(obstacles, tried: Candidates, back, owner, boxes: Boxes):
    """p - z (m, c, 2) of every vertex at the moments tried, and the largest gap (m, c) there over
    the corners of z: negative where every plan touches.
    """
    n_p = boxes.least.shape[2]
    box = jnp.minimum(owner, len(boxes.lo) - 1)
    t = tried.interval[box]
    at = _moments(back)[jnp.arange(len(back))[:, None], t, tried.share[box]]
    upper = jnp.asarray(list(itertools.product((False, True), repeat=n_p)))
    corners = jnp.where(upper[None], boxes.hi[:, None, :n_p], boxes.lo[:, None, :n_p])
    depth = jax.vmap(_deepest, in_axes=(None, 0, 0, 0, 0, 0))(
        obstacles, at, corners[box], tried.obstacle[box], t, boxes.least[box]
    )
    return at, depth


def _times(x, A):
    """x (n, j), A (rows, j) -> (n, rows)."""
    return jnp.matmul(x, A.T, precision=HIGHEST)


def _moments(path):
    """Points (..., T, shares, 2) of a path (..., T + 1, 2) at the SHARES of every interval."""
    before = path[..., :-1, :]
    after = path[..., 1:, :]
    return jnp.stack([before * (1 - share) + after * share for share in SHARES], axis=-2)


def point_gap(p, corners, radius):
    """Signed distance [m] of a point p (2,) from polygon + disc, negative inside, and its unit
    direction (2,).

    corners: (m, 2) counter-clockwise, repeated corners allowed. Along the edge normals or away from
    the nearest corner.
    """
    edges = jnp.roll(corners, -1, axis=0) - corners
    away = p[None] - corners
    nearest = away[jnp.argmin(dot2(away, away))]
    normals = jnp.stack([edges[:, 1], -edges[:, 0]], axis=1)
    w = jnp.concatenate([normals, nearest[None]])
    length = jnp.sqrt(dot2(w, w))
    w = w / jnp.where(length > 0, length, 1.0)[:, None]
    gaps = jnp.where(length > 0, dot2(w[:, None], away[None]).min(axis=1), -jnp.inf)
    best = jnp.argmax(gaps)
    return gaps[best] - radius, w[best]


def _gaps(grown, path, error):
    """Gap (o, T, shares) and direction (o, T, shares, 2) of every moment of one path (T + 1, 2)
    from every obstacle.
    """

    def one(corner, sign, active):
        corners = corner[None] + sign[None] * error[:, None]
        in_interval = jax.vmap(lambda p, c: point_gap(p, c, grown.radius), in_axes=(0, None))
        gap, w = jax.vmap(in_interval)(_moments(path), corners)
        return jnp.where(active[:, None], gap, jnp.inf), w

    return jax.vmap(one)(grown.corner, grown.sign, grown.active)


def _deepest(grown, at, corners, obstacle, interval, error):
    """Largest gap (c,) over the corners (v, 2) of z of one vertex of k, whose moments are at (c,
    2).
    """

    def one(p, o, t):
        grown_corners = grown.corner[o] + grown.sign[o] * error[t][None]
        gap, _ = jax.vmap(lambda z: point_gap(z + p, grown_corners, grown.radius))(corners)
        return jnp.where(grown.active[o, t], gap.max(), jnp.inf)

    return jax.vmap(one)(at, obstacle, interval)


def _effects_of_sides(z_rows, k_moves, k_rows, z_size, tried: Candidates, moved):
    """|change| of goal rows, start rows and contacts along the sides: (n, g + s + c, n_p + n_k)."""
    n = len(z_size)
    along_z = [jnp.abs(A)[None] * z_size[:, None] for A in z_rows]
    along_z.append(jnp.abs(tried.way) * z_size[:, None])
    along_k = [
        jnp.abs(jnp.einsum("nij,rj->nri", move, A, precision=HIGHEST))
        for move, A in zip(k_moves, k_rows, strict=True)
    ]
    moved_at = _moments(moved)[jnp.arange(n)[:, None], :, tried.interval, tried.share]
    along_k.append(jnp.abs(jnp.einsum("ncij,ncj->nci", moved_at, tried.way, precision=HIGHEST)))
    parts = [jnp.concatenate([z, k], axis=2) for z, k in zip(along_z, along_k, strict=True)]
    return jnp.concatenate(parts, axis=1)


def _effects_of_bins(goal_size, start, tried: Candidates, boxes: Boxes):
    """|change| of the reasons when the box is split at the edges of bins: (n, g + s + c, n_k)."""
    n = len(boxes.lo)
    more_goal = _times(boxes.final_most - boxes.final_least, goal_size)
    wider = (boxes.most - boxes.least)[jnp.arange(n)[:, None], tried.interval]
    more_hit = dot2(jnp.abs(tried.way), wider)
    blur = jnp.concatenate([more_goal, jnp.zeros_like(start), more_hit], axis=1)
    count = jnp.maximum(boxes.straddles.sum(axis=1), 1.0)
    return blur[:, :, None] * (boxes.straddles / count[:, None])[:, None]
