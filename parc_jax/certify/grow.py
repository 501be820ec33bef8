"""Grow a safe point into a safe polytope by choosing one separating direction per obstacle and interval. [T14, T16]

With the direction w fixed, w . p^_t is affine in (p0, k) on the region, so all points that keep every inequality form
a convex polytope of safe points. Which directions are chosen decides how much of the safe set the polytope takes. They
are chosen so that as many "mates" as possible stay inside: known safe points of the same cell that no polytope holds
yet, and points drawn in the cell around the seed, which stand for volume. Equal directions are then merged into the
fewest runs over time that keep the same mates, so certificates stay short.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from parc_jax.avoid.segment import dot2, separations
from parc_jax.certify.cell import anchored_rows, cell_map, walk

SWEEPS = 1  # rounds of swapping each interval's direction while all others stay
WALKS, STEPS = 8, 8  # points drawn in the cell around the seed
KNOWN_WEIGHT = 2.0  # a known uncovered safe point counts as much as this many drawn ones


class Growth(NamedTuple):
    """Outcome for one seed. choice (o, T): direction of the table, or the table's length for the seed's own.

    nearest (o, T, 2): the seed's own direction, from the nearest point of the obstacle. kept (): the seed is inside.
    open (): obstacle-interval pairs that asked for a choice among all directions.
    """

    choice: jax.Array
    nearest: jax.Array
    kept: jax.Array
    open: jax.Array


def grow(items: int, net, tube, scene, key, p0, k, pattern, bin_number, bin_lo, bin_hi, known, real) -> Growth:
    """One seed p0 (n_p,), k (n_k,) with its pattern (n_hidden,) and bin. Kernel; vmap over seeds.

    items: most obstacle-interval pairs that get a choice among all directions; the others take a facet normal.
    bin_lo, bin_hi (n_k,): box of the bin. known (m, T + 1, 2): paths of safe points of the same cell; real (m,) bool.
    Chosen in float32: whatever is chosen, what is inside is decided elsewhere, in float64.
    """
    error, final = jnp.asarray(tube.interval)[bin_number], jnp.asarray(tube.final)[bin_number]
    cell = cell_map(net, pattern, *tube.interval.shape[1:])
    A, b = anchored_rows(scene, cell, final, bin_lo, bin_hi)
    seed = jnp.concatenate([p0, k])
    around = walk(key, A, b, seed, WALKS, STEPS)
    drawn = around[:, None, : len(p0)] + cell.offsets(around[:, len(p0) :])
    paths = jnp.concatenate([(p0[None] + cell.offsets(k))[None], known, drawn])
    paths, error, scene = jax.tree.map(_rough, (paths, error, scene))
    weight = jnp.concatenate([KNOWN_WEIGHT * real.astype(error.dtype), jnp.ones(len(drawn), error.dtype)])
    one = jax.vmap(_validity, in_axes=(None, None, 0, 0, 0, 0, None, 0))
    nearest, facets, valid_facets = one(
        scene, error, scene.obstacles.corner, scene.obstacles.sign, scene.directions.w, scene.directions.reach,
        paths, scene.obstacles.active,
    )  # fmt: skip
    settled = valid_facets.any(axis=2)
    item_o, item_t = jnp.nonzero(~settled, size=items, fill_value=-1)
    used = item_o >= 0
    ok = _item_table(scene, error, nearest, paths, item_o, item_t) | ~used[:, None, None]
    allowed, ok_mates = ok[:, 0], ok[:, 1:]
    choice = jnp.argmax(jnp.where(allowed, _weighed(ok_mates, weight[None]), -1.0), axis=1)
    for _ in range(SWEEPS):
        choice = _sweep(choice, allowed, ok_mates, weight)
    inside = _of_choice(choice, ok_mates).all(axis=0)
    valid_items = allowed & (ok_mates | ~inside[None, :, None]).all(axis=1)
    n_w = scene.directions.w.shape[1]
    valid = (
        jnp.zeros((*settled.shape, n_w + 1), bool)
        .at[:, :, : facets.shape[2]]
        .set(jnp.where(settled[:, :, None], valid_facets, facets))
    )
    # an interval beyond `items` falls back to facets that hold for the seed, and at worst to its own direction
    valid = valid.at[:, :, n_w].set(~valid.any(axis=2))
    valid = valid.at[jnp.where(used, item_o, len(valid)), item_t].set(valid_items, mode="drop")
    runs = jax.vmap(_fewest_runs)(valid)
    kept = jnp.take_along_axis(valid, runs[:, :, None], axis=2).all()
    return Growth(runs, nearest, kept, (~settled).sum())


@partial(jax.jit, static_argnums=0)
def grow_batch(items: int, net, tube, scene, *seeds) -> Growth:
    """`grow` of many seeds, everything that belongs to one with a leading axis."""
    return jax.vmap(lambda *seed: grow(items, net, tube, scene, *seed))(*seeds)


def _rough(x):
    x = jnp.asarray(x)
    return x.astype(jnp.float32) if jnp.issubdtype(x.dtype, jnp.floating) else x


def _validity(scene, error, corner, sign, w, reach, paths, active):
    """For one obstacle: the seed's nearest directions (T, 2), and per interval which facet normals separate the seed
    (T, f), and which separate the seed and every mate (T, f). An absent obstacle is separated by anything."""
    facet, reach = w[: scene.directions.n_facets], reach[: scene.directions.n_facets]
    corners = corner[None] + sign[None] * error[:, None]
    _, nearest = separations(paths[0, :-1], paths[0, 1:], corners, scene.obstacles.radius)
    size = jnp.abs(facet)
    need = reach[None] + dot2(size[None], error[:, None]) + scene.slack * size.sum(axis=1)[None]
    along = dot2(paths[:, :, None], facet[None, None])
    gap = jnp.minimum(along[:, :-1], along[:, 1:]) > need[None]
    return nearest, gap[0] | ~active[:, None], gap.all(axis=0) | ~active[:, None]


def _item_table(scene, error, nearest, paths, item_o, item_t):
    """(i, 1 + m, d + 1) bool: does a direction separate the seed (first) and each mate at an item?"""
    table, e = scene.directions, error[item_t]
    own = nearest[item_o, item_t]
    corners = scene.obstacles.corner[item_o] + scene.obstacles.sign[item_o] * e[:, None]
    own_reach = jnp.max(dot2(corners, own[:, None]), axis=1) + scene.obstacles.radius
    w = jnp.concatenate([table.w[item_o], own[:, None]], axis=1)
    reach = table.reach[item_o] + dot2(jnp.abs(table.w[item_o]), e[:, None])
    need = jnp.concatenate([reach, own_reach[:, None]], axis=1) + scene.slack * jnp.abs(w).sum(axis=2)
    knots = paths[:, jnp.stack([item_t, item_t + 1])].transpose(3, 1, 2, 0)  # (xy, both knots, items, points)
    x, y = jax.lax.optimization_barrier((knots[0], knots[1]))  # gathered once, not anew for every direction
    along = w[:, :, 0][None, :, None] * x[..., None] + w[:, :, 1][None, :, None] * y[..., None]
    return jnp.minimum(along[0], along[1]) > need[:, None]


def _sweep(choice, allowed, ok_mates, weight):
    """Swap one item after another: a mate counts weight * 4^-(number of other items that lose it)."""
    lost = (~_of_choice(choice, ok_mates)).sum(axis=0)

    def swap(lost, item):
        choice, allowed, ok = item
        others = lost - (~ok[:, choice]).astype(lost.dtype)
        score = _weighed(ok, weight * jnp.exp2(-2.0 * others.astype(weight.dtype)))
        best = jnp.argmax(jnp.where(allowed, score, -1.0))
        return others + (~ok[:, best]).astype(lost.dtype), best

    return jax.lax.scan(swap, lost, (choice, allowed, ok_mates))[1]


def _weighed(ok, weight):
    """Weight (..., d) of the mates that each direction of ok (..., m, d) keeps."""
    return jnp.where(ok, weight[..., None], 0).sum(axis=-2)


def _of_choice(choice, ok_mates):
    """(i, m): is the mate kept at each item by the direction chosen there?"""
    return jnp.take_along_axis(ok_mates, choice[:, None, None], axis=2)[:, :, 0]


def _fewest_runs(valid):
    """valid (T, d + 1) -> choice (T,): always take the direction that lasts longest.

    The last column is each interval's own nearest direction: it never lasts, and is taken only where nothing else
    holds.
    """
    table = jnp.arange(valid.shape[1]) < valid.shape[1] - 1

    def lasts(later, valid):
        here = jnp.where(valid & table, 2 + later, jnp.where(valid, 1, 0))
        return jnp.where(table, here, 0), here

    _, length = jax.lax.scan(lasts, jnp.zeros(valid.shape[1], int), valid, reverse=True)

    def take(current, item):
        length, valid = item
        current = jnp.where(valid[current] & table[current], current, jnp.argmax(length))
        return current, current

    return jax.lax.scan(take, jnp.argmax(length[0]), (length, valid))[1]
