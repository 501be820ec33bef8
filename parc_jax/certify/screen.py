"""The pointwise test for many points at once: facet normals first, the exact separation only where they leave it open.

Same verdict as `evaluate`, up to rounding: safe needs the same three proofs, and every obstacle and interval is
separated by a direction that clears the slack. Most are, by a facet of the obstacle; most points that are not safe
show it in the one interval where the facets do worst. What remains are a few intervals of a few points.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import on_all_cores, x64
from parc_jax.avoid.segment import dot2, separation
from parc_jax.certify.evaluate import predict, prediction
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel

CHUNK = 512  # points per compiled call: intermediates stay in cache
ITEMS = 2048  # open obstacle-interval pairs per compiled call


class Sighting(NamedTuple):
    """What the first look tells; leading axis b. p0, path, pattern, bin, reaches: as in Evaluation.

    hopeful (b,): reaches, and touches nothing in the interval that looks worst. open (b, o, T): no facet separates.
    """

    p0: np.ndarray
    path: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray
    hopeful: np.ndarray
    reaches: np.ndarray
    open: np.ndarray


def sighting(net, tube, scene: Scene, z, k) -> Sighting:
    """First look at the plan with k (n_k,) whose predicted end is z (n_p,). Kernel."""
    offsets, _, _ = predict(net, *tube.interval.shape[1:], k)
    p0 = z - offsets[-1]
    seen = prediction(net, tube, scene, p0, k)
    error = jnp.asarray(tube.interval)[seen.bin]
    table, n_facets = scene.directions, scene.directions.n_facets
    room = jax.vmap(_facet_room, in_axes=(None, None, 0, 0, None))(
        seen.path, error, table.w[:, :n_facets], table.reach[:, :n_facets], scene.slack
    )
    room = jnp.where(scene.obstacles.active, room, jnp.inf)
    o, t = jnp.unravel_index(jnp.argmin(room), room.shape)
    struck = ~(room[o, t] > 0) & ~_apart(tube, scene, seen.path[t], seen.path[t + 1], seen.bin, o, t)
    return Sighting(p0, seen.path, seen.pattern, seen.bin, seen.reaches & ~struck, seen.reaches, ~(room > 0))


def _facet_room(path, error, w, reach, slack):
    """(T,) [m * |w|]: by how much the best facet normal of w (f, 2) separates each interval; not positive: by none."""
    along = dot2(path[:, None], w[None])
    size = jnp.abs(w)
    need = reach[None] + dot2(size[None], error[:, None]) + slack * size.sum(axis=1)[None]
    return (jnp.minimum(along[:-1], along[1:]) - need).max(axis=1)


def _apart(tube, scene: Scene, start, end, bin_number, o, t):
    """Is the segment of one open item separated? start, end (2,): the knots of interval t; o: obstacle."""
    corners = scene.obstacles.corner[o] + scene.obstacles.sign[o] * jnp.asarray(tube.interval)[bin_number, t][None]
    gap, w = separation(start, end, corners, scene.obstacles.radius)
    return gap - scene.slack * jnp.abs(w).sum() > 0


_sightings = jax.jit(jax.vmap(sighting, in_axes=(None, None, None, 0, 0)))
_aparts = jax.jit(jax.vmap(_apart, in_axes=(None, None, 0, 0, 0, 0, 0)))


def screen(model: TrajectoryModel, scene: Scene, z, k) -> tuple[int, np.ndarray, list[np.ndarray]]:
    """How many of the plans with ends z (b, n_p) and parameters k (b, n_k) reach the goal; which are safe (s,) int.

    Also of those that are: p0, path, pattern, bin.
    """
    n, arrays = len(k), scene.arrays

    def look(first):
        rows = np.arange(first, min(first + CHUNK, n))
        padded = np.resize(rows, CHUNK)
        with x64():
            seen = _sightings(model.net, model.tube, arrays, z[padded], k[padded])
        seen = Sighting(*(np.asarray(field)[: len(rows)] for field in seen))
        return int(seen.reaches.sum()), rows[seen.hopeful], [field[seen.hopeful] for field in seen]

    def apart(items):
        who, o, t = (np.resize(x, ITEMS) for x in items)
        with x64():
            found = _aparts(model.tube, arrays, path[who, t], path[who, t + 1], number[who], o, t)
        return np.asarray(found)[: len(items[0])]

    reached, rows, fields = zip(*on_all_cores(look, range(0, n, CHUNK)), strict=True)
    p0, path, pattern, number, *_, left = (np.concatenate(x) for x in zip(*fields, strict=True))
    items = np.nonzero(left)
    parts = [[x[i : i + ITEMS] for x in items] for i in range(0, len(items[0]), ITEMS)]
    safe = np.ones(len(p0), bool)
    for (who, _, _), found in zip(parts, on_all_cores(apart, parts), strict=True):
        safe[who[~found]] = False
    return sum(reached), np.concatenate(rows)[safe], [x[safe] for x in (p0, path, pattern, number)]
