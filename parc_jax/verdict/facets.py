"""What the facets of obstacles say of a plan: normals that are known, so that a look at an interval
is a few products. [T14, T20]

Obstacle by obstacle, all facets and points of one at once, the intervals innermost: nothing is kept
between two obstacles, and those that only pad are never looked at. What the errors between fitted
faces take along a fixed direction is a number per bin, interval and point, told once for all
obstacles that share a normal; so such a tube costs what a box costs.
"""

from collections.abc import Callable
from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.base.arrays import once, x64
from parc_jax.base.shapes import Index, Path
from parc_jax.claim.error_set import ErrorTemplate
from parc_jax.claim.reach import Reach, numbered, reach
from parc_jax.claim.tube import Tube
from parc_jax.separation.inequality import at_both_knots, excess, height
from parc_jax.verdict.scene import Scene, Tabled


class Facets(NamedTuple):
    """What errors take along the facet normals of the pairs of a scene, each kept once.

    number (o, f): which of the normals. reach: against these. inside (n_bins, T, n_points, n_p): an
    error that each bin allows, None for boxes.
    """

    number: np.ndarray
    reach: Reach
    inside: jax.Array | None

    def gap(self, o: Index, path: Path, bin: Index, scene: Tabled):
        """(T,) [m * |w|]: by how much the best facet normal separates pair o in each interval, less
        the slack; not positive: by none. Kernel.
        """
        taken, number = self.reach.of(bin), jnp.asarray(self.number)
        return facet_gap(o, path, scene, lambda f, w, point: taken.along(number[o, f], w, point))


def facet_gap(o: Index, path: Path, scene: Tabled, lost: Callable | None = None):
    """As `Facets.gap`; lost(facet, normal, point): (T,) what errors take, None for nothing."""
    table, pairs = scene.directions, jnp.asarray(scene.obstacles.points)
    places = path.T.reshape(-1, table.w.shape[-1], len(path))  # (n_points, n_p, T + 1)
    normals, support = jnp.asarray(table.w), jnp.asarray(table.support)

    def beyond(f: int):
        """(T,) by how much all points of a pair are beyond a facet, whatever their errors."""
        w = normals[o, f]

        def of_point(point: Index):
            heights = at_both_knots(height(w, places[point]))
            return excess(heights, 0.0 if lost is None else lost(f, w, point))

        # where there is one point it is known which, and it is read in place
        points = (0,) if len(places) == 1 else pairs[o]
        room = reduce(jnp.minimum, (of_point(point) for point in points))
        return room - (support[o, f] + scene.slack * jnp.abs(w).sum())

    return reduce(jnp.maximum, (beyond(f) for f in range(table.n_facets)))


def facets_of(scene: Scene) -> Facets:
    """The facets of a scene. What errors between faces take along them is worked out once per tube
    and set of normals.
    """
    tube, table = scene.model.tube, scene.directions
    normals = table.w[: int(scene.count), : table.n_facets]
    unique, number = numbered(normals, len(table.w))
    inside = None if tube.templates is None else once(tube, _inside)
    return Facets(number, reach(tube, unique, number.size), inside)


def _inside(tube: Tube) -> jax.Array:
    with x64():
        return _middles(tube.errors)


@jax.jit
def _middles(errors: ErrorTemplate):
    """An error that each bin allows (n_bins, T, n_points, n_p): the middle of some corners."""
    axes = jnp.eye(errors.half.shape[-1])
    return jax.lax.map(errors.vertex, jnp.concatenate([axes, -axes])).mean(axis=0)
