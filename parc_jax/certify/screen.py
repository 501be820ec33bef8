"""The pointwise test for many points at once: a few knots first, then facet normals, the exact separation for the rest.

Same verdict as `evaluate`, up to rounding: safe needs the same three proofs, and every obstacle and interval is
separated by a direction that clears the slack. Most points that are not safe show it at one of a few knots, and most of
the others in the one interval where the facets do worst; most intervals of the rest are separated by a facet of the
obstacle. What remains are a few intervals of a few points.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.avoid.segment import dot2, separation
from parc_jax.certify.evaluate import arrival, in_chunks, predict, prediction
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.network.relu import ReLUNetwork

CHUNK = 512  # points per compiled call: intermediates stay in cache
GLANCES = 2048  # the same for the first look
KNOTS = 12  # that the first look sees
TINY = 1e-300  # [m^2] against 0 / 0 where a corner is repeated
ITEMS = 2048  # open obstacle-interval pairs per compiled call


def glance(few: ReLUNetwork, knots, tube, scene: Scene, z, k):
    """Does the plan with k (n_k,) and predicted end z (n_p,) reach; does it, and is outside of everything? Kernel.

    few: the network with the outputs of some knots (m,) only, the last one among them.
    """
    n_steps, n_p = tube.interval.shape[1:]
    offsets, q, _ = predict(few, len(knots), n_p, k)
    p0 = z - offsets[-1]
    path = p0[None] + offsets
    number, goal, start = arrival(tube, scene, p0, path[-1], q, k)
    reaches = (goal >= 0) & (start >= 0) & (number >= 0)
    at = jnp.minimum(jnp.concatenate([jnp.zeros(1, int), knots]), n_steps - 1)  # the interval that a knot begins
    error = jnp.asarray(tube.interval)[number, at]
    struck = jax.vmap(_struck, in_axes=(0, 0, None, None, None))(
        scene.obstacles.corner, scene.obstacles.sign, scene.obstacles.radius, path, error
    )
    return reaches, reaches & ~(struck & scene.obstacles.active[:, at]).any()


def _struck(corner, sign, radius, p, error):
    """(t,) bool: are points p (t, 2) inside the polygon corner (m, 2) + sign * error (t, 2), or within the radius?

    Edge by edge and without a division of the field into cases: this runs for every plan that is ever drawn. A point
    or a wall has no inside; their area is exactly zero, as it is measured from one of the corners.
    """
    inside, nearest, area = jnp.ones(len(p), bool), jnp.full(len(p), jnp.inf), jnp.zeros(len(p), p.dtype)
    corners = [c[None] + s[None] * error for c, s in zip(corner, sign, strict=True)]
    for a, b in zip([corners[-1], *corners[:-1]], corners, strict=True):
        along, to, from_a, from_b = b - a, p - a, a - corners[0], b - corners[0]
        area += from_a[:, 0] * from_b[:, 1] - from_a[:, 1] * from_b[:, 0]
        inside &= along[:, 0] * to[:, 1] >= along[:, 1] * to[:, 0]
        share = jnp.clip(dot2(to, along) / jnp.maximum(dot2(along, along), TINY), 0, 1)
        off = to - share[:, None] * along
        nearest = jnp.minimum(nearest, dot2(off, off))
    return (inside & (area > 0)) | (nearest <= radius * radius)


class Sighting(NamedTuple):
    """What the second look tells; leading axis b. p0, path, pattern, bin: as in Evaluation.

    hopeful (b,): reaches, and touches nothing in the interval that looks worst. open (b, o, T): no facet separates.
    """

    p0: np.ndarray
    path: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray
    hopeful: np.ndarray
    open: np.ndarray


def sighting(net, tube, scene: Scene, z, k) -> Sighting:
    """Second look at the plan with k (n_k,) whose predicted end is z (n_p,). Kernel."""
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
    return Sighting(p0, seen.path, seen.pattern, seen.bin, seen.reaches & ~struck, ~(room > 0))


def _facet_room(path, error, w, reach, slack):
    """(T,) [m * |w|]: by how much the best facet normal of w (f, 2) separates each interval; not positive: by none."""
    along = dot2(path[:, None], w[None])
    size = jnp.abs(w)
    need = reach[None] + dot2(size[None], error[:, None]) + slack * size.sum(axis=1)[None]
    return (jnp.minimum(along[:-1], along[1:]) - need).max(axis=1)


def _few_outputs(model: TrajectoryModel) -> tuple[ReLUNetwork, np.ndarray]:
    """The network with the outputs of KNOTS knots and of q only, and the numbers of those knots, evenly spread."""
    net, n_p, n_steps = model.net, model.n_p, model.time.n_steps
    knots = np.unique(np.linspace(0, n_steps, KNOTS).round().astype(int))[1:]
    rows = [n_p * (knots[:, None] - 1) + np.arange(n_p), np.arange(n_steps * n_p, len(net.biases[-1]))[:, None]]
    rows = np.concatenate([part.ravel() for part in rows])
    few = [(*part[:-1], part[-1][rows]) for part in (net.weights, net.biases)]
    return net.replace(weights=few[0], biases=few[1]), knots


def _apart(tube, scene: Scene, start, end, bin_number, o, t):
    """Is the segment of one open item separated? start, end (2,): the knots of interval t; o: obstacle."""
    corners = scene.obstacles.corner[o] + scene.obstacles.sign[o] * jnp.asarray(tube.interval)[bin_number, t][None]
    gap, w = separation(start, end, corners, scene.obstacles.radius)
    return gap - scene.slack * jnp.abs(w).sum() > 0


_glances = jax.jit(jax.vmap(glance, in_axes=(None, None, None, None, 0, 0)))
_sightings = jax.jit(jax.vmap(sighting, in_axes=(None, None, None, 0, 0)))
_aparts = jax.jit(jax.vmap(_apart, in_axes=(None, None, 0, 0, 0, 0, 0)))


def screen(model: TrajectoryModel, scene: Scene, z, k) -> tuple[int, np.ndarray, list[np.ndarray]]:
    """How many of the plans with ends z (b, n_p) and parameters k (b, n_k) reach the goal; which are safe (s,) int.

    Also of those that are: p0, path, pattern, bin.
    """
    arrays = scene.arrays
    few, knots = _few_outputs(model)

    glances = lambda z, k: _glances(few, knots, model.tube, arrays, z, k)  # noqa: E731
    sightings = lambda z, k: _sightings(model.net, model.tube, arrays, z, k)  # noqa: E731
    aparts = lambda *items: _aparts(model.tube, arrays, *items)  # noqa: E731
    reaches, outside = in_chunks(GLANCES, glances, z, k)
    rows = np.flatnonzero(outside)
    seen = in_chunks(CHUNK, sightings, z[rows], k[rows])
    hopeful = seen.hopeful
    p0, path, pattern, number, left = (field[hopeful] for field in (*seen[:4], seen.open))
    who, o, t = np.nonzero(left)
    safe = np.ones(len(p0), bool)
    if len(who):
        safe[who[~in_chunks(ITEMS, aparts, path[who, t], path[who, t + 1], number[who], o, t)]] = False
    return int(reaches.sum()), rows[hopeful][safe], [x[safe] for x in (p0, path, pattern, number)]
