"""What the facets of obstacles say of the points of a body, told once for all obstacles that share
a normal. [T14, T20]

Obstacles of one shape have their normals in common, boxes all of them. How far every point is along
a normal, less what its errors take, is worked out once per normal, with the intervals innermost;
an obstacle then only compares. What the errors between fitted faces take along a fixed direction
is a number per bin, interval and point, so such a tube costs what a box costs.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import remembered, x64
from parc_jax.claim.error_set import ErrorBox, ErrorTemplate
from parc_jax.claim.tube import Tube
from parc_jax.obstacles.grown import bucket
from parc_jax.verdict.scene import Scene


class Facets(NamedTuple):
    """Facet normals of the pairs of a scene, each kept once.

    w (u, n_p). number (o, f): which of them. points (parts, i): reference points of the parts of
    the body; part (o,): of every pair. lost (n_bins, u, n_points, T): what the errors take along
    each, None where boxes tell it as fast. inside (n_bins, T, n_points, n_p): an error that each
    bin allows, None for boxes.
    """

    w: np.ndarray
    number: np.ndarray
    points: np.ndarray
    part: np.ndarray
    lost: jax.Array | None
    inside: jax.Array | None

    def gap(self, path, tube: Tube, bin, support, slack):
        """(o, T) [m * |w|]: by how much the best facet normal separates each pair in each interval;
        not positive: by none. path (T + 1, n_c), support (o, f). Kernel.
        """
        n_points = tube.n_points
        places = path.T.reshape(n_points, -1, path.shape[0])  # (n_points, n_p, T + 1)
        axes = [w[:, None, None] for w in jnp.asarray(self.w).T]
        along = sum(w * places[None, :, c] for c, w in enumerate(axes))
        along = jnp.minimum(along[..., :-1], along[..., 1:]) - self._lost(tube, bin, axes)
        of_part = along[:, self.points].min(axis=2)  # (u, parts, T)
        own = of_part[self.number, self.part[:, None]]  # (o, f, T)
        w_size = jnp.abs(jnp.asarray(self.w)).sum(axis=-1)
        return (own - (support + slack * w_size[self.number])[..., None]).max(axis=1)

    def _lost(self, tube: Tube, bin, axes):
        """(u, n_points, T)"""
        if self.lost is not None:
            return self.lost[bin]
        half = tube.during(bin).half  # (T, n_points, n_p)
        return sum(jnp.abs(w) * half[..., c].T[None] for c, w in enumerate(axes))


def facets_of(tube: Tube, scene: Scene) -> Facets:
    """The facets of a scene. What errors between faces take along them is worked out once per tube
    and set of normals.
    """
    table, obstacles = scene.directions, scene.obstacles
    w = table.w[:, : table.n_facets]
    unique, number = np.unique(w.reshape(-1, w.shape[2]), axis=0, return_inverse=True)
    padding = bucket(len(unique)) - len(unique)
    unique = np.pad(unique, ((0, padding), (0, 0)), mode="edge")
    points, part = np.unique(obstacles.points, axis=0, return_inverse=True)
    lost, inside = None, None
    if not isinstance(tube.errors, ErrorBox):
        half = tube.templates.interval.half

        def make():
            with x64():
                return _of_templates(tube.errors, unique)

        lost, inside = remembered(half, ("facets", unique.shape, unique.tobytes()), make)
    return Facets(unique, number.reshape(w.shape[:2]), points, part.ravel(), lost, inside)


@jax.jit
def _of_templates(errors: ErrorTemplate, w):
    """What errors take along -w (u, n_p): (n_bins, u, n_points, T), and an error that each bin
    allows (n_bins, T, n_points, n_p): the middle of some corners.
    """
    lost = jax.lax.map(lambda one: errors.support(-one), jnp.asarray(w))
    axes = jnp.eye(w.shape[1])
    corners = jax.lax.map(errors.vertex, jnp.concatenate([axes, -axes]))
    return lost.transpose(1, 0, 3, 2), corners.mean(axis=0)
