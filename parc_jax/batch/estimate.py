"""Estimated clearances of many plans of one scene, in float32: they decide which plans are checked,
and no verdict reads them. Kernels.
"""

import itertools

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import dot
from parc_jax.claim.error_set import ErrorSet, at
from parc_jax.network.predict import by_point
from parc_jax.obstacles.grown import GrownObstacles
from parc_jax.obstacles.pairs import Pairs

AROUND = 24  # directions tried in the plane; in space those from a cube to its neighbours


def estimate_clearance(obstacles: GrownObstacles | Pairs, path, errors: ErrorSet):
    """Estimated clearance [m] (c,) of paths (c, n_c, T + 1), time last, with errors (c, T,
    n_points), all float32.
    """
    obstacles = jax.tree.map(_single, obstacles)
    if isinstance(obstacles, GrownObstacles):
        return _along_edges(obstacles, path, errors.half[:, :, 0].swapaxes(1, 2))
    return _along_a_fan(obstacles, path, errors)


def _along_edges(grown: GrownObstacles, path, error):
    """The largest gap along edge normals of the grown obstacle: exact beside an edge, too small
    around a corner of a disc. error (c, 2, T).
    """

    def obstacle(j, clearance):
        corner = grown.corner[j]
        sign = grown.sign[j]
        # an edge for some error > 0
        edge = jnp.roll(corner, -1, axis=0) - corner + jnp.roll(sign, -1, axis=0) - sign
        length = jnp.sqrt((edge * edge).sum(axis=1))
        normal = jnp.stack([edge[:, 1], -edge[:, 0]], axis=1)
        w = normal / jnp.where(length > 0, length, 1)[:, None]
        support = dot(corner[None], w[:, None]).max(axis=1)

        def side(i, gap):
            out = w[i, 0] * path[:, 0] + w[i, 1] * path[:, 1] - support[i]
            grow = jnp.abs(w[i, 0]) * error[:, 0] + jnp.abs(w[i, 1]) * error[:, 1]
            here = jnp.minimum(out[:, :-1], out[:, 1:]) - grow
            return jnp.where(length[i] > 0, jnp.maximum(gap, here), gap)

        nothing = jnp.full(error.shape[::2], -jnp.inf, jnp.float32)
        gap = jax.lax.fori_loop(0, len(corner), side, nothing)
        return jnp.minimum(clearance, jnp.where(grown.active[j][None], gap, jnp.inf).min(axis=1))

    far = jnp.full(len(path), jnp.inf, jnp.float32)
    return jax.lax.fori_loop(0, len(grown.corner), obstacle, far) - grown.radius


def _along_a_fan(pairs: Pairs, path, errors: ErrorSet):
    """The largest gap along directions of a fan, the same for all pairs: too small between them."""
    n_p = pairs.vertices.shape[-1]
    fan = jnp.asarray(_fan(n_p))
    places = by_point(path.swapaxes(1, 2), path.shape[1] // n_p)

    def pair(j, clearance):
        points = pairs.points[j]
        near = places[:, :, points]
        allowed = at(errors, np.s_[:, :, points])

        def look(i, gap):
            w = fan[i]
            along = dot(near, w[None, None, None])
            lost = allowed.support(-w[None, None, None])
            here = jnp.minimum(along[:, :-1], along[:, 1:]) - lost
            return jnp.maximum(gap, here.min(axis=2) - dot(pairs.vertices[j], w[None]).max())

        nothing = jnp.full((len(path), near.shape[1] - 1), -jnp.inf, jnp.float32)
        gap = jax.lax.fori_loop(0, len(fan), look, nothing) - pairs.radius[j]
        return jnp.minimum(clearance, jnp.where(pairs.active[j][None], gap, jnp.inf).min(axis=1))

    far = jnp.full(len(path), jnp.inf, jnp.float32)
    return jax.lax.fori_loop(0, len(pairs.vertices), pair, far)


def _fan(n_p: int) -> np.ndarray:
    """(f, n_p) unit directions all around, those along the axes among them."""
    if n_p == 2:
        angle = 2 * np.pi * np.arange(AROUND) / AROUND
        return np.stack([np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)
    cube = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=n_p)))
    cube = cube[np.abs(cube).sum(axis=1) > 0]
    return (cube / np.linalg.norm(cube, axis=1, keepdims=True)).astype(np.float32)


def _single(x):
    x = jnp.asarray(x)
    return x.astype(jnp.float32) if jnp.issubdtype(x.dtype, jnp.floating) else x
