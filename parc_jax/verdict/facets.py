"""What the facets of obstacles say of a plan: normals that are known, so that a look at an interval
is a few products. [T14, T20]

Obstacle by obstacle, all facets and points of one at once, the intervals innermost: nothing is kept
between two obstacles, and those that only pad are never looked at. What the errors between fitted
faces take along a fixed direction is a number per bin, interval and point, told once for all
obstacles that share a normal; so such a tube costs what a box costs.
"""

from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.base.arrays import once, x64
from parc_jax.claim.error_set import ErrorBox, ErrorTemplate
from parc_jax.claim.reach import reach
from parc_jax.claim.tube import Tube
from parc_jax.verdict.scene import Scene, Tabled


class Facets(NamedTuple):
    """What errors take along the facet normals of the pairs of a scene, each kept once.

    number (o, f): which of the u normals. lost (u, n_bins, n_points, T): what the errors take
    along each, None where boxes tell it as fast. inside (n_bins, T, n_points, n_p): an error that
    each bin allows, None for boxes.
    """

    number: np.ndarray
    lost: jax.Array | None
    inside: jax.Array | None

    def gap(self, o, path, tube: Tube, bin, scene: Tabled):
        """(T,) [m * |w|]: by how much the best facet normal separates pair o in each interval, less
        the slack; not positive: by none. path (T + 1, n_c). Kernel.
        """
        table, pairs = scene.directions, jnp.asarray(scene.obstacles.points)
        places = path.T.reshape(tube.n_points, -1, path.shape[0])  # (n_points, n_p, T + 1)
        boxes = tube.during(bin).half.transpose(1, 2, 0) if self.lost is None else None
        number, normals, support = map(jnp.asarray, (self.number, table.w, table.support))

        def room_of(f, point):
            """(T,) how far a point is along a facet's normal, whatever its error."""
            w, place = normals[o, f], places[point]
            along = sum(w[c] * place[c] for c in range(len(w)))
            if boxes is None:
                lost = self.lost[number[o, f], bin, point]
            else:
                lost = sum(jnp.abs(w[c]) * boxes[point, c] for c in range(len(w)))
            return jnp.minimum(along[:-1], along[1:]) - lost

        def beyond(f):
            """(T,) by how much all points of a pair are beyond a facet."""
            # where there is one point it is known which, and it is read in place
            points = (0,) if tube.n_points == 1 else pairs[o]
            room = reduce(jnp.minimum, (room_of(f, point) for point in points))
            return room - (support[o, f] + scene.slack * jnp.abs(normals[o, f]).sum())

        return reduce(jnp.maximum, (beyond(f) for f in range(table.n_facets)))


def facets_of(scene: Scene) -> Facets:
    """The facets of a scene. What errors between faces take along them is worked out once per tube
    and set of normals.
    """
    tube, table, n_pairs = scene.model.tube, scene.directions, int(scene.count)
    number = np.zeros((len(table.w), table.n_facets), int)
    if isinstance(tube.errors, ErrorBox):
        return Facets(number, None, None)
    w = table.w[:n_pairs, : table.n_facets]
    unique, which = np.unique(w.reshape(-1, w.shape[2]), axis=0, return_inverse=True)
    number[:n_pairs] = which.reshape(w.shape[:2])
    lost = reach(tube, unique, number.size)
    return Facets(number, lost, once(tube, _inside))


def _inside(tube: Tube) -> jax.Array:
    with x64():
        return _middles(tube.errors)


@jax.jit
def _middles(errors: ErrorTemplate):
    """An error that each bin allows (n_bins, T, n_points, n_p): the middle of some corners."""
    axes = jnp.eye(errors.half.shape[-1])
    return jax.lax.map(errors.vertex, jnp.concatenate([axes, -axes])).mean(axis=0)
