"""Estimated clearances of paths, float32: they choose proposals, no verdict reads them. Kernels."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from parc_jax.common.arrays import dot, single
from parc_jax.learning.bound.reach import Reach, reach
from parc_jax.learning.bound.tube import Tube
from parc_jax.safe_set.separation.inequality import at_both_knots, excess, height
from parc_jax.safe_set.separation.pairs import Obstacles

STRIDE = 4  # [knots] from which to which paths are taken to be straight at a rough look
AROUND = 24  # directions tried in the plane; in space those from a cube to its neighbours
Ways = Float[jax.Array, "c n_c knots"]


def along_fan(tube: Tube) -> Reach:
    """Error support table against the direction set, in float32."""
    return reach(tube, all_around(tube.n_p), dtype=np.float32)


def estimate_clearance(obstacles: Obstacles, path: Ways, taken: Reach):
    """Estimated clearance (c,) [m] of paths (c, n_c, T + 1), float32 with the time last.

    taken: error support table along the direction set, in the bins (c,) of the paths.
    """
    obstacles = jax.tree.map(single, obstacles)
    if obstacles.closed:
        return _along_edges(obstacles, path, taken.half[:, 0])
    return _along_a_fan(obstacles, path, taken)


def estimate_roughly(pairs: Obstacles, path: Ways, taken: Reach):
    """The same from every STRIDE-th knot: paths straight between these, with the errors of the
    interval in the middle; an obstacle that exists in some interval between two exists in all.
    """
    n_steps = path.shape[2] - 1
    knots = np.unique(np.linspace(0, n_steps, 1 + -(-n_steps // STRIDE)).round().astype(int))
    middle = (knots[:-1] + knots[1:]) // 2
    active = jnp.asarray(pairs.active)
    active = jnp.stack([active[:, a:b].any(axis=1) for a, b in itertools.pairwise(knots)], axis=1)
    few = pairs.replace(active=active)
    return estimate_clearance(few, path[..., knots], taken.during(middle, kernel=True))


def _along_edges(grown: Obstacles, path: Ways, error: Float[jax.Array, "c n_p intervals"]):
    """Gap along edge normals of a grown obstacle: exact at edges, too small at a disc's corner."""
    places = path.swapaxes(0, 1)

    def obstacle(j: Int[jax.Array, ""], clearance: Float[jax.Array, " c"]):
        corner = grown.vertices[j]
        sign = grown.signs[j]
        # an edge for some error > 0
        edge = jnp.roll(corner, -1, axis=0) - corner + jnp.roll(sign, -1, axis=0) - sign
        length = jnp.sqrt((edge * edge).sum(axis=1))
        normal = jnp.stack([edge[:, 1], -edge[:, 0]], axis=1)
        w = normal / jnp.where(length > 0, length, 1)[:, None]
        support = dot(corner[None], w[:, None]).max(axis=1)

        def side(i, gap):
            grow = height(jnp.abs(w[i]), error.swapaxes(0, 1))
            here = excess(at_both_knots(height(w[i], places), axis=1), support[i]) - grow
            return jnp.where(length[i] > 0, jnp.maximum(gap, here), gap)

        nothing = jnp.full(error.shape[::2], -jnp.inf, jnp.float32)
        gap = jax.lax.fori_loop(0, len(corner), side, nothing)
        gap = jnp.where(grown.active[j][None], gap - grown.radius[j], jnp.inf)
        return jnp.minimum(clearance, gap.min(axis=1))

    far = jnp.full(len(path), jnp.inf, jnp.float32)
    return jax.lax.fori_loop(0, len(grown.vertices), obstacle, far)


def _along_a_fan(pairs: Obstacles, path: Ways, taken: Reach):
    """The largest gap along a direction set, the same for all pairs: too small between the
    directions. The projection of every point on a direction is computed once for all pairs.
    """
    n_pairs, _, n_p = pairs.vertices.shape
    n_steps = path.shape[2] - 1
    fan = jnp.asarray(all_around(n_p))
    places = jnp.moveaxis(path.reshape(len(path), -1, n_p, n_steps + 1), 2, 0)

    def look(i, gaps):
        w = fan[i]
        here = excess(at_both_knots(height(w, places), axis=-1), taken.along(i, w))

        def pair(j, gaps):
            least = here[:, pairs.points[j]].min(axis=1) - dot(pairs.vertices[j], w[None]).max()
            return gaps.at[j].max(least)

        return jax.lax.fori_loop(0, n_pairs, pair, gaps)

    nothing = jnp.full((n_pairs, len(path), n_steps), -jnp.inf, jnp.float32)
    gaps = jax.lax.fori_loop(0, len(fan), look, nothing) - pairs.radius[:, None, None]
    return jnp.where(pairs.active[:, None], gaps, jnp.inf).min(axis=(0, 2))


def all_around(n_p: int) -> np.ndarray:
    """(f, n_p) unit directions all around, those along the axes among them."""
    if n_p == 2:
        angle = 2 * np.pi * np.arange(AROUND) / AROUND
        return np.stack([np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)
    cube = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=n_p)))
    cube = cube[np.abs(cube).sum(axis=1) > 0]
    return (cube / np.linalg.norm(cube, axis=1, keepdims=True)).astype(np.float32)
