"""What the facets of obstacles say of a plan: normals that are known, so that a look at an interval
is a few products. [T14, T20]

All facets and points of a kind of obstacles at once, the intervals innermost: how far a plan is
along their normals is told once for all obstacles that share these, and those that only pad are
never looked at. What the errors between fitted faces take along a fixed direction is a number per
bin, interval and point; so such a tube costs what a box costs.
"""

from collections.abc import Callable
from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import dot, once, x64
from parc_jax.common.shapes import Index, Knot, Path
from parc_jax.learning.bound.error_set import ErrorTemplate
from parc_jax.learning.bound.reach import Reach, numbered, reach
from parc_jax.learning.bound.tube import Tube
from parc_jax.problem.body import Disc
from parc_jax.safe_set.separation.directions import body_support
from parc_jax.safe_set.separation.inequality import at_both_knots, excess, height
from parc_jax.safe_set.verdict.scene import Scene, Tabled


class Facets(NamedTuple):
    """What errors take along the facet normals of the pairs of a scene, each kept once.

    number (o, f): which of the normals. reach: against these. inside (n_bins, T, n_points, n_p): an
    error that each bin allows, None for boxes. core (o, f) [m * |w|]: whoever is below all of it
    is in the obstacle, moved by one point of the shape.
    """

    number: np.ndarray
    reach: Reach
    inside: jax.Array | None
    core: np.ndarray

    def holds(self, o: Index, place: Knot, scene: Tabled):
        """Is a point of pair o for certain in the obstacle, at places (n_c,)? Kernel."""
        n_p, normals = scene.directions.w.shape[-1], jnp.asarray(scene.directions.w)
        points = place.reshape(-1, n_p)[jnp.asarray(scene.obstacles.points)[o]]
        along = dot(points[:, None], normals[o][None, : self.core.shape[1]])
        return (along < jnp.asarray(self.core)[o][None]).all(axis=1).any()

    def look(self, path: Path, bin: Index, scene: Tabled, see: Callable, state: Any):
        """The state after all pairs: see(o, gap, state), with gap (T,) [m * |w|] by how much the
        best facet normal separates pair o in each interval, less the slack; not positive: by none.
        Kernel.
        """
        taken, number = self.reach.of(bin), jnp.asarray(self.number)

        def known(o: Index):
            return along_facets(o, path, scene, lambda f, w, i: taken.along(number[o, f], w, i))

        def of_pair(o: Index, along: list[jax.Array], state: Any):
            return see(o, facet_gap(o, along, scene), state)

        return scene.alike.look(known, of_pair, state)


def along_facets(
    o: Index, path: Path, scene: Tabled, lost: Callable | None = None
) -> list[jax.Array]:
    """(T,) for each facet of a pair: how far all its points are along the normal in each interval.
    lost(facet, normal, point): (T,) what errors take, None for nothing. Kernel.
    """
    normals, pairs = jnp.asarray(scene.directions.w), jnp.asarray(scene.obstacles.points)
    places = path.T.reshape(-1, normals.shape[-1], len(path))  # (n_points, n_p, T + 1)

    own = [(pairs[o] == point).any() for point in range(len(places))]

    def of_facet(f: int):
        w = normals[o, f]
        far = jnp.inf
        # by every point, so that it is known which, and read in place
        for point, mine in enumerate(own):
            heights = at_both_knots(height(w, places[point]))
            room = excess(heights, 0.0 if lost is None else lost(f, w, point))
            far = jnp.minimum(far, jnp.where(mine, room, jnp.inf))
        return far

    return [of_facet(f) for f in range(scene.directions.n_facets)]


def facet_gap(o: Index, along: list[jax.Array], scene: Tabled):
    """(T,) [m * |w|] by how much the best facet normal separates a pair, less the slack, from what
    `along_facets` says of it, or of one with the same normals. Kernel.
    """
    normals, support = jnp.asarray(scene.directions.w), jnp.asarray(scene.directions.support)
    lost = (support[o, f] + scene.slack * jnp.abs(normals[o, f]).sum() for f in range(len(along)))
    return reduce(jnp.maximum, (far - own for far, own in zip(along, lost, strict=True)))


def facets_of(scene: Scene) -> Facets:
    """The facets of a scene. What errors between faces take along them is worked out once per tube
    and set of normals.
    """
    tube, table = scene.model.tube, scene.directions
    normals = table.w[: int(scene.count), : table.n_facets]
    unique, number = numbered(normals, len(table.w))
    inside = None if tube.templates is None else once(tube, _inside)
    return Facets(number, reach(tube, unique, number.size), inside, _core(scene))


def _core(scene: Scene) -> np.ndarray:
    """(o, f) of a scene; where not all facets are among the directions nothing is known."""
    table = scene.directions
    core = np.full((len(table.w), table.n_facets), -np.inf)
    for o, (shape, cones) in enumerate(zip(table.shapes, table.cones, strict=True)):
        w = table.w[o, : table.n_facets]
        within = 0.0 if isinstance(shape, Disc) else w @ shape.vertices.mean(axis=0)
        if len(np.unique(cones)) <= table.n_facets:
            core[o] = table.support[o, : table.n_facets] - body_support(shape, w) - within
    return core - scene.slack * np.abs(table.w[:, : table.n_facets]).sum(axis=2)


def _inside(tube: Tube) -> jax.Array:
    with x64():
        return _middles(tube.errors)


@jax.jit
def _middles(errors: ErrorTemplate):
    """An error that each bin allows (n_bins, T, n_points, n_p): the middle of some corners."""
    axes = jnp.eye(errors.half.shape[-1])
    return jax.lax.map(errors.vertex, jnp.concatenate([axes, -axes])).mean(axis=0)
