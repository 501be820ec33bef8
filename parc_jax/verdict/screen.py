"""The pointwise test for many points at once: a few knots first, then facet normals, the exact
separation for the rest.

Same verdict as `pointwise`, up to rounding: safe needs the same three proofs, and every obstacle
and interval is separated by a direction that clears the slack. Most points that are not safe show
it at one of a few knots, and most of the others in the one interval where the facets do worst; most
intervals of the rest are separated by a facet of the obstacle. What remains are a few intervals of
a few points.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import map_rows
from parc_jax.model import TrajectoryModel
from parc_jax.network.predict import predict
from parc_jax.network.relu import ReLUNetwork
from parc_jax.obstacles.segment import dot2, separation
from parc_jax.verdict.pointwise import arrival, prediction
from parc_jax.verdict.scene import Scene

CHUNK = 512  # points per compiled call: intermediates stay in cache
KNOT_CHUNK = 2048  # the same for the test at a few knots
KNOTS = 12  # at which that test is made
TINY = 1e-300  # [m^2] against 0 / 0 where a corner is repeated
ITEMS = 2048  # open obstacle-interval pairs per compiled call


def knot_test(few: ReLUNetwork, knots, tube, scene: Scene, z, k):
    """Does the plan with k (n_k,) and predicted end z (n_p,) reach; does it, and is outside of
    everything? Kernel.

    few: the network with the outputs of some knots (m,) only, the last one among them.
    """
    offsets, q, _ = predict(few, tube.layout._replace(n_steps=len(knots)), k)
    p0 = z - offsets[-1]
    path = p0[None] + offsets
    bin, goal, start = arrival(tube, scene, p0, path[-1], q, k)
    reaches = (goal >= 0) & (start >= 0) & (bin >= 0)
    # the interval that a knot begins
    at = jnp.minimum(jnp.concatenate([jnp.zeros(1, int), knots]), tube.n_steps - 1)
    error = tube.during(bin, at)
    touching = jax.vmap(_touching, in_axes=(0, 0, None, None, None))(
        scene.obstacles.corner, scene.obstacles.sign, scene.obstacles.radius, path, error
    )
    return reaches, reaches & ~(touching & scene.obstacles.active[:, at]).any()


def _touching(corner, sign, radius, p, error):
    """(t,) bool: are points p (t, 2) inside the polygon corner (m, 2) + sign * error (t, 2), or
    within the radius?

    Edge by edge and without a division of the field into cases: this runs for every plan that is
    ever drawn. A point or a wall has no inside; their area is exactly zero, as it is measured from
    one of the corners.
    """
    inside = jnp.ones(len(p), bool)
    nearest = jnp.full(len(p), jnp.inf)
    area = jnp.zeros(len(p), p.dtype)
    corners = [c[None] + s[None] * error for c, s in zip(corner, sign, strict=True)]
    for a, b in zip([corners[-1], *corners[:-1]], corners, strict=True):
        along = b - a
        to = p - a
        from_a = a - corners[0]
        from_b = b - corners[0]
        area += from_a[:, 0] * from_b[:, 1] - from_a[:, 1] * from_b[:, 0]
        inside &= along[:, 0] * to[:, 1] >= along[:, 1] * to[:, 0]
        share = jnp.clip(dot2(to, along) / jnp.maximum(dot2(along, along), TINY), 0, 1)
        off = to - share[:, None] * along
        nearest = jnp.minimum(nearest, dot2(off, off))
    return (inside & (area > 0)) | (nearest <= radius * radius)


class FacetTest(NamedTuple):
    """What the test with facet normals tells; leading axis b. p0, path, pattern, bin: as in
    Verdicts.

    possible (b,): reaches, and touches nothing in the interval that looks worst. open (b, o, T): no
    facet separates.
    """

    p0: np.ndarray
    path: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray
    possible: np.ndarray
    open: np.ndarray


def facet_test(net, tube, scene: Scene, z, k) -> FacetTest:
    """Facets and the plan with k (n_k,) whose predicted end is z (n_p,). Kernel."""
    offsets, _, _ = predict(net, tube.layout, k)
    p0 = z - offsets[-1]
    seen = prediction(net, tube, scene, p0, k)
    error = tube.during(seen.bin)
    table = scene.directions
    n_facets = table.n_facets
    gap = jax.vmap(_facet_gap, in_axes=(None, None, 0, 0, None))(
        seen.path, error, table.w[:, :n_facets], table.support[:, :n_facets], scene.slack
    )
    gap = jnp.where(scene.obstacles.active, gap, jnp.inf)
    o, t = jnp.unravel_index(jnp.argmin(gap), gap.shape)
    touching = ~(gap[o, t] > 0) & ~_separated(
        tube, scene, seen.path[t], seen.path[t + 1], seen.bin, o, t
    )
    return FacetTest(p0, seen.path, seen.pattern, seen.bin, seen.reaches & ~touching, ~(gap > 0))


def _facet_gap(path, error, w, support, slack):
    """(T,) [m * |w|]: by how much the best facet normal of w (f, 2) separates each interval; not
    positive: by none.
    """
    along = dot2(path[:, None], w[None])
    size = jnp.abs(w)
    threshold = support[None] + dot2(size[None], error[:, None]) + slack * size.sum(axis=1)[None]
    return (jnp.minimum(along[:-1], along[1:]) - threshold).max(axis=1)


def _few_outputs(model: TrajectoryModel) -> tuple[ReLUNetwork, np.ndarray]:
    """The network with the outputs of KNOTS knots and of q only, and the indices of those knots,
    evenly spread.
    """
    net, n_p, n_steps = model.net, model.n_p, model.time.n_steps
    knots = np.unique(np.linspace(0, n_steps, KNOTS).round().astype(int))[1:]
    rows = [
        n_p * (knots[:, None] - 1) + np.arange(n_p),
        np.arange(n_steps * n_p, len(net.biases[-1]))[:, None],
    ]
    rows = np.concatenate([part.ravel() for part in rows])
    few = [(*part[:-1], part[-1][rows]) for part in (net.weights, net.biases)]
    return net.replace(weights=few[0], biases=few[1]), knots


def _separated(tube, scene: Scene, start, end, bin, o, t):
    """Is the segment of one open item separated? start, end (2,): the knots of interval t; o:
    obstacle.
    """
    corners = scene.obstacles.corner[o] + scene.obstacles.sign[o] * tube.during(bin, t)[None]
    gap, w = separation(start, end, corners, scene.obstacles.radius)
    return gap - scene.slack * jnp.abs(w).sum() > 0


_knot_tests = jax.jit(jax.vmap(knot_test, in_axes=(None, None, None, None, 0, 0)))
_facet_tests = jax.jit(jax.vmap(facet_test, in_axes=(None, None, None, 0, 0)))
_separated_items = jax.jit(jax.vmap(_separated, in_axes=(None, None, 0, 0, 0, 0, 0)))


class Screened(NamedTuple):
    """The safe ones of b plans, s of them. reaching: how many of all reach the goal.

    row (s,): which of the b plans. p0 (s, n_p), path (s, T + 1, n_p), pattern (s, n_hidden), bin
    (s,): as in Verdicts.
    """

    reaching: int
    row: np.ndarray
    p0: np.ndarray
    path: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray


def screen(model: TrajectoryModel, scene: Scene, z, k) -> Screened:
    """Which of the plans with predicted ends z (b, n_p) and parameters k (b, n_k) are safe."""
    net, tube, arrays = model.net, model.tube, scene.arrays
    few, knots = _few_outputs(model)
    reaches, outside = map_rows(
        KNOT_CHUNK, lambda z, k: _knot_tests(few, knots, tube, arrays, z, k), z, k
    )
    row = np.flatnonzero(outside)
    seen = map_rows(CHUNK, lambda z, k: _facet_tests(net, tube, arrays, z, k), z[row], k[row])
    row = row[seen.possible]
    seen = FacetTest(*(field[seen.possible] for field in seen))
    plan, o, t = np.nonzero(seen.open)
    safe = np.ones(len(row), bool)
    if len(plan):
        separated = map_rows(
            ITEMS,
            lambda *items: _separated_items(tube, arrays, *items),
            seen.path[plan, t],
            seen.path[plan, t + 1],
            seen.bin[plan],
            o,
            t,
        )
        safe[plan[~separated]] = False
    p0, path, pattern, bin = (field[safe] for field in seen[:4])
    return Screened(int(reaches.sum()), row[safe], p0, path, pattern, bin)
