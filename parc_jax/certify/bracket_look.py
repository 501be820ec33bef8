"""Look at a batch of boxes over (z, k): why every plan in one is unsafe, or how far that is from being proved.

A box of k is given by all vertices of the network's cells in it. Between those, with each corner of the box of z,
everything is affine, so a condition that holds at them with a margin holds on the whole box. [T13-T16]
All numbers are float64 and decide only which leaf to write down; the checker derives the vertices again, exactly.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.avoid.segment import dot2
from parc_jax.certify.evaluate import HIGHEST, predict

SHARES = (0.0, 0.5, 1.0)  # moments within an interval at which contact is looked for
CANDIDATES = 6  # (obstacle, interval, moment) looked at per box, the most promising first


class Boxes(NamedTuple):
    """A batch of n boxes. lo, hi (n, n_p + n_k). least, most (n, T, n_p): componentwise extremes of the interval widths
    over the bins that the box overlaps; final_least, final_most (n, n_p + n_q). straddles (n, n_k): 1.0 for several
    bins along this axis, else 0.0."""

    lo: np.ndarray
    hi: np.ndarray
    least: np.ndarray
    most: np.ndarray
    final_least: np.ndarray
    final_most: np.ndarray
    straddles: np.ndarray


class Look(NamedTuple):
    """What was seen of n boxes. A room is how far a reason clears its condition: positive proves it (up to rounding).

    goal (n, g), start (n, s) [row units], hit (n, c) [m]: rooms of the reasons for being unsafe.
    which (n, c, 3): obstacle, interval, index into SHARES. at (m, c, 2): p - z of every vertex of k at that moment.
    effects (n, g + s + c, n_p + n_k): how much a reason's room moves along each side of the box.
    slopes (n, g + s + c, n_p): change of the room per z, about.
    fits (n,) [row units]: room of "all plans reach the goal from the start set". gap (n,) [m]: of the centre.
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


def offsets_from_end(net, n_steps: int, n_p: int, k):
    """p_s - z at all knots (T + 1, n_p) and q (n_q,) of one k."""
    offsets, q, _ = predict(net, n_steps, n_p, k)
    return offsets - offsets[-1:], q


def look(net, scene, k, owner, boxes: Boxes) -> Look:
    """Vertices k (m, n_k) of the cells, owner (m,): number of their box, n for padding. Kernel over the whole batch."""
    n, (T, n_p) = len(boxes.lo), boxes.least.shape[1:]
    predict_all = jax.vmap(lambda x: offsets_from_end(net, T, n_p, x))
    back, q = predict_all(k)
    z_lo, z_hi = boxes.lo[:, :n_p], boxes.hi[:, :n_p]

    def least_of(x):
        return jax.ops.segment_min(x, owner, n + 1)[:n]

    def most_of(x):
        return jax.ops.segment_max(x, owner, n + 1)[:n]

    def z_range(A):  # least and most of A z over the box of z, (n, rows) each
        low, high = A[None] * z_lo[:, None], A[None] * z_hi[:, None]
        return jnp.minimum(low, high).sum(axis=2), jnp.maximum(low, high).sum(axis=2)

    goal_p, goal_q, size = scene.goal_A[:, :n_p], scene.goal_A[:, n_p:], jnp.abs(scene.goal_A)
    (low, high), value = z_range(goal_p), _times(q, goal_q)
    bound = scene.goal_b[None] - _times(boxes.final_least, size)
    goal = low + least_of(value) - bound
    fits = (scene.goal_b[None] - _times(boxes.final_most, size) - high - most_of(value)).min(axis=1)

    (low, high), value = z_range(scene.start_A), _times(back[:, 0], scene.start_A)
    start = low + least_of(value) - scene.start_b[None]
    fits = jnp.minimum(fits, (scene.start_b[None] - high - most_of(value)).min(axis=1))

    half_k = (boxes.hi[:, n_p:] - boxes.lo[:, n_p:]) / 2
    middle = (boxes.hi + boxes.lo) / 2
    steps = jnp.concatenate([jnp.zeros((1, half_k.shape[1])), jnp.eye(half_k.shape[1]), -jnp.eye(half_k.shape[1])])
    probes = middle[:, None, n_p:] + steps[None] * half_k[:, None]
    seen, seen_q = jax.vmap(predict_all)(probes)
    n_k = half_k.shape[1]
    moved, moved_q = seen[:, 1 : n_k + 1] - seen[:, n_k + 1 :], seen_q[:, 1 : n_k + 1] - seen_q[:, n_k + 1 :]

    path = middle[:, None, :n_p] + seen[:, 0]
    gaps, ways = jax.vmap(_gaps, in_axes=(None, 0, 0))(scene.obstacles, path, boxes.least)
    reach = (most_of(back) - least_of(back)) / 2 + ((z_hi - z_lo) / 2)[:, None]
    score = gaps + dot2(jnp.abs(ways), _moments(reach)[:, None])
    scores = -score.reshape(n, -1)
    _, flat = jax.lax.top_k(scores, min(CANDIDATES, scores.shape[1]))
    o, t, share = jnp.unravel_index(flat, score.shape[1:])
    which = jnp.stack([o, t, share], axis=2)
    chosen = ways[jnp.arange(n)[:, None], o, t, share]

    mine = jnp.minimum(owner, n - 1)
    moments = _moments(back)
    at = moments[jnp.arange(len(k))[:, None], t[mine], share[mine]]
    sides = jnp.asarray(list(itertools.product((False, True), repeat=n_p)))
    corners = jnp.where(sides[None], z_hi[:, None], z_lo[:, None])
    worst = jax.vmap(_deepest, in_axes=(None, 0, 0, 0, 0))(
        scene.obstacles, at, corners[mine], jax.tree.map(lambda x: x[mine], (o, t)), boxes.least[mine]
    )
    moved_at = _moments(moved)[jnp.arange(n)[:, None], :, t, share]  # (n, c, n_k, 2)
    effects = _effects(
        [goal_p, scene.start_A], [moved_q, moved[:, :, 0]], [goal_q, scene.start_A], z_hi - z_lo, chosen, moved_at
    )
    blur = jnp.concatenate([
        _times(boxes.final_most - boxes.final_least, size),
        jnp.zeros_like(start),
        dot2(jnp.abs(chosen), (boxes.most - boxes.least)[jnp.arange(n)[:, None], t]),
    ], axis=1)  # fmt: skip
    shared = boxes.straddles / jnp.maximum(boxes.straddles.sum(axis=1), 1.0)[:, None]
    effects = effects.at[:, :, n_p:].add(blur[:, :, None] * shared[:, None])
    rows = jnp.concatenate([goal_p, scene.start_A])
    slopes = jnp.concatenate([jnp.broadcast_to(rows[None], (n, *rows.shape)), -chosen], axis=1)
    return Look(goal, start, -most_of(worst), which, at, effects, slopes, fits, gaps.min(axis=(1, 2, 3)))


look_jit = jax.jit(look)


def _times(x, A):
    """x (n, j), A (rows, j) -> (n, rows)."""
    return jnp.matmul(x, A.T, precision=HIGHEST)


def _moments(path):
    """Points (..., T, shares, 2) of a path (..., T + 1, 2) at the SHARES of every interval."""
    before, after = path[..., :-1, :], path[..., 1:, :]
    return jnp.stack([before * (1 - share) + after * share for share in SHARES], axis=-2)


def point_gap(p, corners, radius):
    """Signed distance [m] of a point p (2,) from polygon + disc, negative inside, and its unit direction (2,).

    corners: (m, 2) counter-clockwise, repeated corners allowed. Along the edge normals or away from the nearest corner.
    """
    edges = jnp.roll(corners, -1, axis=0) - corners
    away = p[None] - corners
    distance = dot2(away, away)
    w = jnp.concatenate([jnp.stack([edges[:, 1], -edges[:, 0]], axis=1), away[jnp.argmin(distance)][None]])
    length = jnp.sqrt(dot2(w, w))
    w = w / jnp.where(length > 0, length, 1.0)[:, None]
    gaps = jnp.where(length > 0, dot2(w[:, None], away[None]).min(axis=1), -jnp.inf)
    best = jnp.argmax(gaps)
    return gaps[best] - radius, w[best]


def _gaps(grown, path, error):
    """Gap (o, T, shares) and direction (o, T, shares, 2) of every moment of one path (T + 1, 2) from every obstacle."""

    def one(corner, sign, active):
        corners = corner[None] + sign[None] * error[:, None]
        in_interval = jax.vmap(lambda p, c: point_gap(p, c, grown.radius), in_axes=(0, None))
        gap, w = jax.vmap(in_interval)(_moments(path), corners)
        return jnp.where(active[:, None], gap, jnp.inf), w

    return jax.vmap(one)(grown.corner, grown.sign, grown.active)


def _deepest(grown, at, corners, where, error):
    """Largest gap (c,) over the corners (v, 2) of z of one vertex of k, whose moments are at (c, 2)."""

    def one(p, o, t):
        grown_corners = grown.corner[o] + grown.sign[o] * error[t][None]
        gap, _ = jax.vmap(lambda z: point_gap(z + p, grown_corners, grown.radius))(corners)
        return jnp.where(grown.active[o, t], gap.max(), jnp.inf)

    return jax.vmap(one)(at, *where)


def _effects(z_rows, k_moves, k_rows, z_size, chosen, moved_at):
    """|change| of goal rows, start rows and contacts along the sides: (n, g + s + c, n_p + n_k)."""
    along_z = [jnp.abs(A)[None] * z_size[:, None] for A in z_rows] + [jnp.abs(chosen) * z_size[:, None]]
    along_k = [
        jnp.abs(jnp.einsum("nij,rj->nri", moved, A, precision=HIGHEST))
        for moved, A in zip(k_moves, k_rows, strict=True)
    ]
    along_k.append(jnp.abs(jnp.einsum("ncij,ncj->nci", moved_at, chosen, precision=HIGHEST)))
    parts = [jnp.concatenate([z, k], axis=2) for z, k in zip(along_z, along_k, strict=True)]
    return jnp.concatenate(parts, axis=1)
