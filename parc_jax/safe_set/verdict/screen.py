"""The pointwise test for many plans: facet normals first, exact separation for the rest. [T14, T20]

Same verdict as `pointwise`, up to rounding: safe needs the same three proofs, and every obstacle
and interval is separated by a direction that clears the rounding tolerance. Most plans that are not
safe show it in the one interval where the facets do worst; most intervals of the others are
separated by a facet of the obstacle. A few intervals of a few plans remain.

All facets and points of a group of obstacles at once, the intervals innermost: the projections of a
plan on their normals are computed once per group, and padding is never tested. The support of
fitted errors along a fixed direction is a number per bin, interval and point; so a fitted tube
costs as much as a box. What no facet separates a direction of the whole table mostly does.
"""

from collections.abc import Callable
from functools import partial, reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import least, map_rows, once, slices, x64
from parc_jax.common.backend import compiled
from parc_jax.common.shapes import Index, Items, Knot, ManyParams, Params, Path, Positions, Vector
from parc_jax.learning.bound.bins import open_bin_of
from parc_jax.learning.bound.reach import Reach, numbered, reach
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import by_point, moved_to, predict
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.separation.inequality import at_both_knots, excess, height
from parc_jax.safe_set.verdict.pointwise import anchor, on_device
from parc_jax.safe_set.verdict.scene import Scene, Tabled


class Facets(NamedTuple):
    """Supports of errors along the facet normals of the pairs of a scene, each normal once.

    number: (o, f) which of the normals; of the whole table (o, d) where all are tabulated.
    reach: error support table along these.
    """

    number: np.ndarray
    reach: Reach

    def look(self, path: Path, bin: Index, scene: Tabled, see: Callable, state: Any):
        """The state after all pairs. Kernel.

        see: (o, gap, state) -> state, with gap (T,) [m * |w|] by which the best facet normal
        separates pair o in each interval, less the rounding tolerance; not positive: by none.
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
    """(T,) per facet of a pair: least projection of its points on the normal per interval. Kernel.

    lost: (facet, normal, point) -> (T,) support of the errors, None for no errors.
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
    """(T,) [m * |w|] by how much the best facet normal separates a pair, less the rounding
    tolerance, given `along_facets` of it, or of one with the same normals. Kernel.
    """
    normals, support = jnp.asarray(scene.directions.w), jnp.asarray(scene.directions.support)
    lost = (support[o, f] + scene.slack * jnp.abs(normals[o, f]).sum() for f in range(len(along)))
    return reduce(jnp.maximum, (far - own for far, own in zip(along, lost, strict=True)))


def facets_of(scene: Scene) -> Facets:
    """The facets of a scene. Supports of fitted errors are computed once per tube and set of
    normals, along the whole table if that is not much.
    """
    tube, table = scene.model.tube, scene.directions
    n_d, n_sets = table.w.shape[1], np.prod(jax.tree.leaves(tube.errors)[0].shape[:3])
    few = tube.templates is None or table.w[..., 0].size * n_sets > MOST
    normals = table.w[: int(scene.count), : table.n_facets if few else n_d]
    unique, number = numbered(normals, len(table.w))
    return Facets(number, reach(tube, unique, number.size))


MOST = 2**24  # supports of errors along all directions of a scene
CHUNK = 512  # plans per compiled call: intermediates stay in cache
COMPARED = 32  # intervals, about, among which the one that looks worst is sought
ITEMS = 2048  # open obstacle-interval pairs per compiled call
SPARSE = 8  # one in so many of a plan's open items comes first: what touches does so for long
AT_ONCE = 8192  # plans that are in memory with all that is open about them
# the same, where each is a search for a direction: what only fills up a call costs much
SEARCHED = 256


class FacetTest(NamedTuple):
    """Result of the test by facet normals; leading axis b. p0, path, pattern, bin: as in Verdicts.

    worst: (b, 2) the pair and interval of the least gap among some that are compared.
    unsure: (b,) must these be tested still?
    possible: (b,) is not known to touch.
    open: (b, o, T) no facet separates any other.
    """

    p0: np.ndarray
    path: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray
    worst: np.ndarray
    unsure: np.ndarray
    possible: np.ndarray
    open: np.ndarray


def facet_test(
    net: ReLUNetwork, tube: Tube, scene: Tabled, facets: Facets, p0: Vector, k: Params
) -> FacetTest:
    """Facets and a plan that reaches the goal. Kernel."""
    offsets, _, pattern = predict(net, tube.layout, k)
    path, bin = moved_to(p0, offsets), open_bin_of(tube.edges, k)

    active = jnp.asarray(scene.obstacles.active)
    step = max(1, active.shape[1] // COMPARED)

    def look(o: Index, gap: Float[jax.Array, " t"], state: tuple):
        worst, at, open_ = state
        gap = jnp.where(active[o], gap, jnp.inf)
        some = gap[::step]  # most plans that touch do so for long: a few intervals show it
        i = jnp.argmin(some)
        at = jnp.where(some[i] < worst, jnp.stack([o, step * i.astype(o.dtype)]), at)
        return jnp.minimum(worst, some[i]), at, open_.at[o].set(~(gap > 0))

    nothing = jnp.full((), jnp.inf), jnp.zeros(2, jnp.int32), jnp.zeros(active.shape, bool)
    gap, worst, open_ = facets.look(path, bin, scene, look, nothing)
    o, i = worst
    unsure, possible = ~(gap > 0), jnp.ones((), bool)
    if scene.obstacles.closed:  # cheap enough for every plan; a search waits for those in doubt
        separated = _separated(tube, scene, path[i], path[i + 1], bin, o, i)
        unsure, possible = jnp.zeros((), bool), separated | ~unsure
    return FacetTest(p0, path, pattern, bin, worst, unsure, possible, open_.at[o, i].set(False))


def _separated(tube: Tube, scene: Tabled, start: Knot, end: Knot, bin: Index, o: Index, t: Index):
    """Is one open item separated? start, end: the knots of interval t; o: pair."""
    gap, w = scene.obstacles.gap(o, start, end, tube.during(bin, t))
    return gap - scene.slack * jnp.abs(w).sum() > 0


_facet_tests = compiled(jax.vmap(facet_test, in_axes=(*[None] * 4, 0, 0)))
_separated_items = compiled(jax.vmap(_separated, in_axes=(None, None, 0, 0, 0, 0, 0)))


@compiled
@partial(jax.vmap, in_axes=(None, None, 0, 0, 0, 0, 0))
def _separated_by_table(
    facets: Facets, scene: Tabled, start: Knot, end: Knot, bin: Index, o: Index, t: Index
):
    """Does a direction of the table separate an open item? Kernel."""
    w, points = jnp.asarray(scene.directions.w)[o], jnp.asarray(scene.obstacles.points)[o]
    places = [by_point(x, len(x) // w.shape[1])[points].T[..., None] for x in (start, end)]
    lost = facets.reach.lost[facets.number[o], bin, points[:, None], t]
    room = least(excess([height(w.T[:, None], x) for x in places], lost), axis=0)
    support = jnp.asarray(scene.directions.support)[o] + scene.slack * jnp.abs(w).sum(axis=1)
    return (room > support).any()


def _whole(scene: Scene) -> tuple:
    model, facets = scene.model, facets_of(scene)
    with x64():
        return jax.device_put((model.net, on_device(model.tube), scene.tabled, facets))


class Screened(NamedTuple):
    """The safe ones of b plans, s of them. reaching: how many of all reach the goal.

    row (s,): which of the b plans. p0 (s, n_p), path (s, T + 1, n_c), pattern (s, n_hidden), bin
    (s,): as in Verdicts.
    """

    reaching: int
    row: np.ndarray
    p0: np.ndarray
    path: np.ndarray
    pattern: np.ndarray
    bin: np.ndarray


def screen(scene: Scene, z: Positions, k: ManyParams) -> Screened:
    """Which of the plans with predicted ends z and parameters k are safe."""
    p0, reaches = anchor(scene, z, k)
    row = np.flatnonzero(reaches)
    parts = [_screen(scene, p0, k, row[some]) for some in slices(max(len(row), 1), AT_ONCE)]
    return Screened(len(row), *(np.concatenate(field) for field in zip(*parts, strict=True)))


def _screen(scene: Scene, p0: Positions, k: ManyParams, row: np.ndarray) -> tuple:
    """Which of the plans of these rows, all of which reach, are safe: the fields of `Screened`."""
    asked = once(scene, _whole)
    row, seen = map_rows(
        CHUNK,
        lambda row, p0, k: (row, _facet_tests(*asked, p0, k)),
        *(row, p0[row], k[row]),
        only=lambda found: found[1].possible,
    )
    safe = np.ones(len(row), bool)
    unsure = np.flatnonzero(seen.unsure)
    safe[unsure] = _apart(scene, seen, unsure, *seen.worst[unsure].T)
    row, seen = row[safe], FacetTest(*(field[safe] for field in seen))
    safe = np.ones(len(row), bool)
    plan, o, t = np.nonzero(seen.open[:, : int(scene.count)])
    few = (np.arange(len(plan)) - np.searchsorted(plan, plan)) % SPARSE == SPARSE // 2
    for some in (few, ~few):
        item = np.flatnonzero(some & safe[plan])
        apart = _apart(scene, seen, plan[item], o[item], t[item])
        safe[plan[item][~apart]] = False
    return row[safe], *(field[safe] for field in seen[:4])


def _apart(scene: Scene, seen: FacetTest, plan: Items, o: Items, t: Items) -> np.ndarray:
    """(items,) bool: are plans kept apart from pairs o in intervals t?"""
    if not len(plan):
        return np.zeros(0, bool)
    _, tube, arrays, facets = once(scene, _whole)
    o, t = o.astype(np.int32), t.astype(np.int32)  # one type: one program
    items = seen.path[plan, t], seen.path[plan, t + 1], seen.bin[plan], o, t
    found = np.zeros(len(plan), bool)
    if facets.number.shape[1] > arrays.directions.n_facets:
        # a tenth of the cost of a search, and settles most
        found = map_rows(ITEMS, partial(_separated_by_table, facets, arrays), *items)
    if len(left := np.flatnonzero(~found)):
        size = ITEMS if scene.obstacles.closed else SEARCHED
        items = (x[left] for x in items)
        found[left] = map_rows(size, partial(_separated_items, tube, arrays), *items)
    return found
