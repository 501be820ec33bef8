"""Choose a corridor around a safe plan. [T14, T16]

Whatever is chosen, plans that keep to it are safe (`corridor`); the choice decides how many they are. It keeps as many
"mates" as it can: safe plans with similar paths that no corridor holds yet, in whatever cell. Equal directions are then
merged into the fewest runs over time that keep the same mates, so certificates stay short.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from parc_jax.avoid.segment import dot2, separations

POINTS = 64  # the seed and its mates: which of them a direction separates is one machine word
SWEEPS = 1  # rounds of swapping each interval's direction while all others stay
LEVELS = 4  # a mate that l other intervals lose counts 4^-l, but no less than 4^-(LEVELS - 1)


class Growth(NamedTuple):
    """Outcome for one seed. choice (o, T): direction of the table, or the table's length for the seed's own.

    nearest (o, T, 2): the seed's own direction, from the nearest point of the obstacle. kept (): the seed is inside.
    """

    choice: jax.Array
    nearest: jax.Array
    kept: jax.Array


def grow(scene, paths, error) -> Growth:
    """One seed and its mates: paths (POINTS, T + 1, 2), the seed first, error (POINTS, T, 2) of their bins. Kernel.

    Chosen in float32: whatever is chosen, who is inside is decided elsewhere, in float64.
    """
    paths, error, scene = jax.tree.map(_rough, (paths, error, scene))
    obstacles, table = scene.obstacles, scene.directions
    nearest, words = jax.vmap(_words, in_axes=(0, 0, 0, 0, 0, None, None, None, None))(
        obstacles.corner, obstacles.sign, obstacles.active, table.w, table.reach, obstacles.radius, scene.slack,
        paths, error,
    )  # fmt: skip
    items = words.reshape(-1, words.shape[2])
    allowed = _count(items & jnp.uint64(1)) > 0
    choice = jnp.argmax(jnp.where(allowed, _count(items), -1), axis=1)
    for _ in range(SWEEPS):
        choice = _sweep(choice, allowed, items)
    inside = jax.lax.reduce_and(_of_choice(choice, items), (0,))
    valid = (items & inside == inside).reshape(words.shape)
    runs = jax.vmap(_fewest_runs)(valid)
    kept = jnp.take_along_axis(valid, runs[:, :, None], axis=2).all() & (_count(inside & jnp.uint64(1)) > 0)
    return Growth(runs, nearest, kept)


grow_batch = jax.jit(jax.vmap(grow, in_axes=(None, 0, 0)))  # of many seeds


def _rough(x):
    x = jnp.asarray(x)
    return x.astype(jnp.float32) if jnp.issubdtype(x.dtype, jnp.floating) else x


def _words(corner, sign, active, w, reach, radius, slack, paths, error):
    """For one obstacle: the seed's nearest directions (T, 2), and which plans each direction separates, as the bits of
    words (T, d + 1), the seed's own direction last. An absent obstacle is separated by anything."""
    _, nearest = separations(paths[0, :-1], paths[0, 1:], corner[None] + sign[None] * error[0][:, None], radius)
    own_reach = dot2(corner[None], nearest[:, None]).max(axis=1) + radius
    w = jnp.concatenate([jnp.broadcast_to(w, (len(nearest), *w.shape)), nearest[:, None]], axis=1)
    reach = jnp.concatenate([jnp.broadcast_to(reach, (len(nearest), len(reach))), own_reach[:, None]], axis=1)
    size = jnp.abs(w)
    reach = reach + slack * size.sum(axis=2)

    def bit(number, path, error):
        along = jnp.minimum(dot2(w, path[:-1, None]), dot2(w, path[1:, None]))
        apart = along > reach + dot2(size, error[:, None])
        return jnp.where(apart | ~active[:, None], jnp.uint64(1) << number, jnp.uint64(0))

    return nearest, jax.vmap(bit)(_bits(), paths, error).sum(axis=0)


def _sweep(choice, allowed, words):
    """Swap one item after another: a mate that l other items lose counts 4^-l."""
    lost = _loses(_of_choice(choice, words)).sum(axis=0, dtype=jnp.int32)

    def swap(lost, item):
        choice, allowed, words = item
        others = lost - _loses(words[choice])
        level = jnp.minimum(others, LEVELS - 1)
        score = sum(
            4 ** (LEVELS - 1 - n) * _count(words & jnp.where(level == n, jnp.uint64(1) << _bits(), jnp.uint64(0)).sum())
            for n in range(LEVELS)
        )
        best = jnp.argmax(jnp.where(allowed, score, -1))
        return others + _loses(words[best]), best

    return jax.lax.scan(swap, lost, (choice, allowed, words))[1]


def _bits():
    return jnp.arange(POINTS, dtype=jnp.uint64)


def _count(words):
    return jax.lax.population_count(words).astype(jnp.int32)


def _loses(words):
    """(..., POINTS) 1 for each plan whose bit is not set."""
    bits = jnp.broadcast_to(_bits(), (*words.shape, POINTS))
    return 1 - (words[..., None] >> bits & jnp.uint64(1)).astype(jnp.int32)


def _of_choice(choice, words):
    """(i,) the word of the direction chosen at each item."""
    return jnp.take_along_axis(words, choice[:, None], axis=1)[:, 0]


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
