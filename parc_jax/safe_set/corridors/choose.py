"""Choose a corridor around a safe plan, its seed. [T14, T26, T27]

Plans that satisfy a corridor are safe however it was chosen; the choice decides how many they are.
It holds as many neighbours of the seed as it can: safe plans with similar paths that no corridor
holds yet, in any cell. Equal directions are then merged into the fewest runs over time that hold
the same neighbours, so certificates stay short.
"""

from collections.abc import Callable
from functools import partial, reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool, Float, Int, UInt

from parc_jax.common.arrays import once, single
from parc_jax.common.backend import compiled
from parc_jax.common.shapes import Index
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.learning.bound.reach import numbered, placed_errors, reach
from parc_jax.learning.network.predict import by_point
from parc_jax.safe_set.separation.inequality import at_both_knots, excess, height
from parc_jax.safe_set.separation.pairs import Pair
from parc_jax.safe_set.verdict.scene import Scene, Tabled, size_class

MOST_BYTES = 2**29  # along a scene's table: what is more is worked out wherever it is asked
LEAST_KNOWN = 256  # directions that are told, if that is not much more
MUCH = 2**26  # [bytes]


class Allowed(NamedTuple):
    """Errors of some plans, in float32.

    errors: (n_bins, T, n_points).
    bins: (b,) of the plans.
    known: (u, n_bins, n_points, T) supports against u directions, for fitted errors; None where
        they are computed.
    which: (o, d) the table's directions among these.
    """

    errors: ErrorSet
    bins: jax.Array
    known: jax.Array | None = None
    which: jax.Array | None = None

    def lost(self, plan: Index, point: Index, back: tuple[jax.Array, ...]):
        """(T, d) support of a plan's errors at a point along `back`, axes of directions. Kernel."""
        return at(self.errors, (self.bins[plan], slice(None), point, None)).support_by_axis(back)

    def lost_along_table(self, o: Index, plan: Index, point: Index, back: tuple[jax.Array, ...]):
        """The same along all directions of the table of pair o. Kernel."""
        if self.known is None:
            return self.lost(plan, point, back)
        return self.known[self.which[o], self.bins[plan], point].T


def allowed_of(scene: Scene) -> Allowed:
    """Errors of a scene's tube, and their supports along its table; bins are still missing."""
    tube, table = scene.model.tube, scene.directions
    allowed = Allowed(once(tube, placed_errors, np.dtype(np.float32)), np.zeros(0, int))
    if tube.templates is None:
        return allowed
    unique, which = numbered(table.w[: int(scene.count)], len(table.w))
    n, bytes_each = len(unique), 4 * int(np.prod(tube.errors.half.shape[:-2]))
    if bytes_each * n > MOST_BYTES:
        return allowed
    size = size_class(n, LEAST_KNOWN if bytes_each * LEAST_KNOWN <= MUCH else 1)
    return allowed._replace(known=reach(tube, unique, size, np.float32).lost, which=which)


PLANS = 64  # the seed and its neighbours: which of them a direction separates is one 64-bit mask
AT_ONCE = PLANS  # of them along few directions
# plans from which one direction of the seed's own is to keep away, by dimension: in space
# a table is coarse, and what serves one plan best separates few of its neighbours
CLUSTERS = {2: (1,), 3: (1, 4, 16)}
Rooms = Float[jax.Array, "plans t d"]
LEVELS = 4  # a plan that l other intervals lose counts 4^-l, but no less than 4^-(LEVELS - 1)


class Chosen(NamedTuple):
    """The choice for one seed.

    direction: (o, T) number in the table, or the table's length for the direction in `nearest`.
    nearest: (o, T, n_p) direction from the nearest point of the obstacle to the seed, or to the
        hull of it and its nearest neighbours.
    kept: () bool, the seed satisfies the corridor.
    """

    direction: jax.Array
    nearest: jax.Array
    kept: jax.Array


def choose(scene: Tabled, paths: Float[ArrayLike, "plans knots n_c"], allowed: Allowed) -> Chosen:
    """Choose the directions around one seed, in float32; the full test in float64 decides later
    which plans satisfy them. Kernel.

    paths: of the seed, then its neighbours, PLANS in all.
    """
    paths, allowed, scene = jax.tree.map(single, (paths, allowed, scene))
    obstacles, table = scene.obstacles, scene.directions
    clusters = CLUSTERS[table.w.shape[-1]]
    places = by_point(paths, jax.tree.leaves(allowed.errors)[0].shape[2])

    def of_kind(o: Index):
        lost = partial(allowed.lost_along_table, o)
        return _rooms(table.w[o][None], obstacles.points[o], places, lost)

    def of_pair(o: Index, rooms: Rooms, state: tuple):
        one = obstacles.only(o)
        near = jnp.stack([_from_cluster(one, paths, allowed, n) for n in clusters], axis=1)
        rooms_near = _rooms(near, one.points, places, allowed.lost, AT_ONCE)
        support = table.support[o][None] + scene.slack * jnp.abs(table.w[o]).sum(axis=1)[None]
        # beside the table, which all plans share, the best directions of the seed and its nearest
        support_near = jax.vmap(jax.vmap(one.support))(near)
        support_near = support_near + scene.slack * jnp.abs(near).sum(axis=2)
        masks = jnp.concatenate(
            [_separated(rooms, support), _separated(rooms_near, support_near)], axis=1
        )
        masks = jnp.where(one.active[:, None], masks, ~jnp.uint64(0))
        # begin greedily: the direction that holds most plans, among those that hold the seed
        choice = jnp.argmax(jnp.where(_with_seed(masks), _count(masks), -1), axis=1)
        put = (x.at[o].set(new) for x, new in zip(state, (near, masks, choice), strict=True))
        return tuple(put)

    n_o, n_steps = obstacles.active.shape
    n_d = table.w.shape[1] + len(clusters)
    nearest = jnp.zeros((n_o, n_steps, len(clusters), table.w.shape[2]), paths.dtype)
    # what only pads is separated by anything
    masks = jnp.full((n_o, n_steps, n_d), ~jnp.uint64(0))
    begin = nearest, masks, jnp.zeros((n_o, n_steps), int)
    nearest, masks, choice = scene.alike.look(of_kind, of_pair, begin)
    items, choice = masks.reshape(-1, n_d), choice.ravel()
    choice = _sweep(choice, items, scene.count * n_steps)
    chosen = jnp.take_along_axis(items, choice[:, None], axis=1)[:, 0]
    inside = jax.lax.reduce_and(chosen, (0,))

    def merge(o: Index, state: tuple):
        direction, shortest, kept = state
        # any direction may replace the chosen one that loses none of the plans inside
        valid = masks[o] & inside == inside
        runs = _fewest_runs(valid, table.w.shape[1])
        kept &= jnp.take_along_axis(valid, runs[:, None], axis=1).all()
        cluster = jnp.maximum(runs - table.w.shape[1], 0)[:, None, None]
        near = jnp.take_along_axis(nearest[o], cluster, axis=1)[:, 0]
        runs = jnp.minimum(runs, table.w.shape[1])
        return direction.at[o].set(runs), shortest.at[o].set(near), kept

    begin = jnp.zeros((n_o, n_steps), int), nearest[:, :, 0], _with_seed(inside)
    return Chosen(*jax.lax.fori_loop(0, scene.count, merge, begin))


def _from_cluster(pair: Pair, paths: Float[jax.Array, "plans knots n_c"], allowed: Allowed, n: int):
    """(T, n_p) unit directions that keep the hull of the first n plans away with most room."""
    errors = at(allowed.errors, allowed.bins[:n])
    n_points = jax.tree.leaves(errors)[0].shape[2]
    together = jnp.moveaxis(paths[:n], 0, 1).reshape(paths.shape[1], -1)
    # (T, n * n_points, ...)
    errors = jax.tree.map(lambda x: jnp.concatenate(x, axis=1), errors)
    points = jnp.concatenate([pair.points + n_points * i for i in range(n)])
    return pair._replace(points=points).gaps(together, errors)[1]


# of many seeds
choose_batch = compiled(jax.vmap(choose, in_axes=(None, 0, Allowed(None, 0))))


def _rooms(
    w: Float[jax.Array, "_ d n_p"],
    points: Int[jax.Array, " i"],
    places: Float[jax.Array, "plans knots points n_p"],
    lost: Callable,
    at_once: int | None = None,
):
    """(plans, T, d) least projection of each plan's points on directions, less the errors' support.

    w: (1 or T, d, n_p). points: (i,) of the pair. places: of all points.
    lost: as of `Allowed`.
    at_once: plans in one step, None for one after another.
    """
    # axis by axis and point by point: a loop over plans whose arrays (T, d) stay in cache
    axes = jax.lax.optimization_barrier(tuple(jnp.moveaxis(w, 2, 0)))
    back = tuple(-x for x in axes)

    def of_plan(number: Index):
        def of_point(point: Index):
            at_knots = places[number][:, point].T[..., None]
            heights = [height(axes, knots) for knots in at_both_knots(at_knots, axis=1)]
            return excess(heights, lost(number, point, back))

        return reduce(jnp.minimum, (of_point(point) for point in points))

    return jax.lax.map(of_plan, jnp.arange(PLANS), batch_size=at_once)


def _separated(rooms: Rooms, support: Float[jax.Array, "_ d"]):
    """Masks (T, d); bit i: the direction separates plan i from the obstacle with this support."""
    bit = (jnp.uint64(1) << _bits())[:, None, None]
    return jax.lax.reduce_or(jnp.where(rooms > support[None], bit, jnp.uint64(0)), (0,))


def _sweep(choice: Int[jax.Array, " i"], masks: UInt[jax.Array, "i d"], n: Index):
    """Swap the first n items one after another: a plan that l other items lose counts 4^-l."""

    def losing(i: Index, lost: Int[jax.Array, " plans"]):
        return lost + _loses(masks[i, choice[i]])

    lost = jax.lax.fori_loop(0, n, losing, jnp.zeros(PLANS, jnp.int32))

    def swap(i: Index, state: tuple):
        lost, choice = state
        options = masks[i]
        others = lost - _loses(options[choice[i]])
        # a plan that many other items lose is lost anyway: it hardly counts here
        level = jnp.minimum(others, LEVELS - 1)
        score = sum(
            4 ** (LEVELS - 1 - n)
            * _count(options & jnp.where(level == n, jnp.uint64(1) << _bits(), jnp.uint64(0)).sum())
            for n in range(LEVELS)
        )
        best = jnp.argmax(jnp.where(_with_seed(options), score, -1))
        return others + _loses(options[best]), choice.at[i].set(best)

    return jax.lax.fori_loop(0, n, swap, (lost, choice))[1]


def _with_seed(masks: UInt[jax.Array, "..."]):
    return masks & jnp.uint64(1) > 0


def _bits():
    return jnp.arange(PLANS, dtype=jnp.uint64)


def _count(masks: UInt[jax.Array, "..."]):
    return jax.lax.population_count(masks).astype(jnp.int32)


def _loses(masks: UInt[jax.Array, "..."]):
    """(..., PLANS) 1 for each plan whose bit is not set."""
    bits = jnp.broadcast_to(_bits(), (*masks.shape, PLANS))
    return 1 - (masks[..., None] >> bits & jnp.uint64(1)).astype(jnp.int32)


def _fewest_runs(valid: Bool[jax.Array, "t d"], n_table: int):
    """choice (T,): always take the direction that lasts longest.

    The last columns are directions of the seed: they never last, and are taken only where nothing
    of the table, which has n_table directions, holds.
    """
    table = jnp.arange(valid.shape[1]) < n_table

    def lasts(later: Int[jax.Array, " d"], valid: Bool[jax.Array, " d"]):
        here = jnp.where(valid & table, 2 + later, jnp.where(valid, 1, 0))
        return jnp.where(table, here, 0), here

    # backward: how long each direction lasts from here on; 1 for those of the seed
    _, length = jax.lax.scan(lasts, jnp.zeros(valid.shape[1], int), valid, reverse=True)

    def take(current: Index, item: tuple):
        length, valid = item
        current = jnp.where(valid[current] & table[current], current, jnp.argmax(length))
        return current, current

    return jax.lax.scan(take, jnp.argmax(length[0]), (length, valid))[1]
