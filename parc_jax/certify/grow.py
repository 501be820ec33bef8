"""Grow a safe point into a safe polytope by choosing one separating direction per obstacle and interval. [T14, T16]

With the direction w fixed, w . p^_t is affine in (p0, k) on the region, so all points that keep every inequality form
a convex polytope of safe points. Which directions are chosen decides how much of the safe set the polytope takes: they
are chosen so that as many other known safe points of the same region ("mates") as possible stay inside, then merged
into the fewest runs over time that keep the same mates, which keeps the certificate short.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from parc_jax.avoid.segment import dot2, separation

SWEEPS = 2  # rounds of swapping each interval's direction while all others stay


class Items(NamedTuple):
    """The obstacle-interval pairs that need a choice; the others are settled once for the whole scene. Padded.

    obstacle (i,), interval (i,): sorted by obstacle, then time. used (i,) bool.
    """

    obstacle: jax.Array
    interval: jax.Array
    used: jax.Array


class Growth(NamedTuple):
    """Outcome for one seed. choice (i,): direction index per item; the last index is the seed's own nearest direction.

    nearest (i, 2): that direction. inside (m,): mates inside the polytope. kept (): the seed itself is inside.
    """

    choice: jax.Array
    nearest: jax.Array
    inside: jax.Array
    kept: jax.Array


def grow(scene, items: Items, paths, mates, error) -> Growth:
    """One seed. paths (1 + m, T + 1, 2): the seed's path first, then its mates'. mates (m,) bool: real, not padding.

    error (T, 2): the tube of the bin they share. Kernel; vmap over seeds.
    """
    grown, table = scene.obstacles, scene.directions
    e = error[items.interval]
    corners = grown.corner[items.obstacle] + grown.sign[items.obstacle] * e[:, None]
    start, end = paths[:, items.interval], paths[:, items.interval + 1]
    _, nearest = jax.vmap(separation, in_axes=(0, 0, 0, None))(start[0], end[0], corners, grown.radius)
    own_reach = jnp.max(dot2(corners, nearest[:, None]), axis=1) + grown.radius
    w = jnp.concatenate([table.w[items.obstacle], nearest[:, None]], axis=1)
    reach = table.reach[items.obstacle] + dot2(jnp.abs(table.w[items.obstacle]), e[:, None])
    reach = jnp.concatenate([reach, own_reach[:, None]], axis=1) + scene.slack * jnp.abs(w).sum(axis=2)
    clear = jnp.minimum(
        dot2(w[:, :, None], start.swapaxes(0, 1)[:, None]), dot2(w[:, :, None], end.swapaxes(0, 1)[:, None])
    )
    ok = (clear > reach[:, :, None]) | ~items.used[:, None, None]  # (i, d, 1 + m)
    allowed = ok[:, :, 0]
    ok_mates = ok[:, :, 1:] & mates
    choice = jnp.argmax(jnp.where(allowed, ok_mates.sum(axis=2), -1), axis=1)
    for _ in range(SWEEPS):
        choice = _sweep(choice, allowed, ok_mates)
    inside = _all_kept(choice, ok_mates) & mates
    choice = _fewest_runs(items, allowed & (ok_mates | ~inside).all(axis=2))
    kept = jnp.take_along_axis(allowed, choice[:, None], axis=1).all()
    return Growth(choice, nearest, _all_kept(choice, ok_mates) & mates, kept)


grow_batch = jax.jit(jax.vmap(grow, in_axes=(None, None, 0, 0, 0)))


def _sweep(choice, allowed, ok_mates):
    """Swap one item after another: a mate counts 4^-(number of other items that lose it)."""
    lost = (~jnp.take_along_axis(ok_mates, choice[:, None, None], axis=1)[:, 0]).sum(axis=0)

    def swap(lost, item):
        choice, allowed, ok = item
        others = lost - ~ok[choice]
        score = jnp.where(ok, jnp.exp2(-2.0 * others), 0.0).sum(axis=1)
        best = jnp.argmax(jnp.where(allowed, score, -1.0))
        return others + ~ok[best], best

    return jax.lax.scan(swap, lost, (choice, allowed, ok_mates))[1]


def _all_kept(choice, ok_mates):
    return jnp.take_along_axis(ok_mates, choice[:, None, None], axis=1)[:, 0].all(axis=0)


def _fewest_runs(items: Items, valid):
    """Cover the items of each obstacle by the fewest constant runs: always take the direction that lasts longest."""
    follows = (items.obstacle[1:] == items.obstacle[:-1]) & (items.interval[1:] == items.interval[:-1] + 1)
    follows = jnp.concatenate([follows, jnp.array([False])])

    def lasts(later, item):
        valid, follows = item
        here = jnp.where(valid, 1 + jnp.where(follows, later, 0), 0)
        return here, here

    _, length = jax.lax.scan(lasts, jnp.zeros(valid.shape[1], jnp.int32), (valid, follows), reverse=True)

    def walk(current, item):
        length, valid = item
        current = jnp.where(valid[current], current, jnp.argmax(length))
        return current, current

    return jax.lax.scan(walk, jnp.argmax(length[0]), (length, valid))[1]
