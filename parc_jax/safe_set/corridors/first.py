"""The first safe plans of a question in one compiled call: draw, keep what reaches the goal, judge
one after another until as many as asked are safe. [T11, T15]

Plans are drawn as by `sampling.draw`, uniform over all that may reach, and judged as every single
plan is, in float64 with the slack of the scene. Those that are safe are taken in the order in which
they were drawn, so they are uniform over the safe set. Nothing moves between host and device but
the key.
"""

from functools import lru_cache, partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import x64
from parc_jax.common.backend import Backend, backend
from parc_jax.common.shapes import Index, Params, Vector
from parc_jax.safe_set.corridors.placed import Placed, placed
from parc_jax.safe_set.corridors.sampling import Draw, ends_of, points
from parc_jax.safe_set.verdict.pointwise import (
    Verdicts,
    anchored,
    prediction,
    verdict,
    verdict_in_turn,
)
from parc_jax.safe_set.verdict.scene import Scene

SLOTS = (1, 4, 16)  # plans that a program has room for
MOST = SLOTS[-1]
# without its emitters of fused loops XLA compiles this program for a CPU in half the time, and it
# runs as fast; the option says nothing to other devices
COMPILER = {"xla_cpu_use_fusion_emitters": False}


class First(NamedTuple):
    """Safe plans (n, ...) in the order in which they were drawn, the first `found` of which count.

    p0 (n, n_p), k (n, n_k), seen: their verdicts. drawn, reaching: plans looked at, up to the last
    one found where there are enough, and how many of them reach the goal. told: as of
    `in_one_array`, with `found` and `drawn` in one row more.
    """

    p0: jax.Array
    k: jax.Array
    seen: Verdicts
    found: jax.Array
    drawn: jax.Array
    reaching: jax.Array
    told: jax.Array | None = None


class Drawn(NamedTuple):
    """A round of plans (r, ...), and whether they reach the goal."""

    p0: jax.Array
    k: jax.Array
    reaches: jax.Array


def first_safe(asked: Placed, key: jax.Array, n: int) -> First:
    """The first n safe plans, n at most MOST; arrays on the device of the question. Fewer where
    looking on would be slow. key: of `jax.random`; it is consumed.
    """
    slots = next(size for size in SLOTS if size >= n)
    (device,) = asked.scene.count.devices()
    with x64():
        return _first_safe(asked, key, _number(n, device), slots, backend(device))


def first_draw(scene: Scene, key: jax.Array, n: int) -> Draw:
    """The first n safe plans as a draw, n at most MOST. Its size depends on what was found: draws
    end with the last plan that was asked for.
    """
    first = first_safe(placed(scene), key, n)
    found, drawn, reaching = (int(x) for x in (first.found, first.drawn, first.reaching))
    p0, k, seen = jax.tree.map(lambda x: np.asarray(x)[:found], (first.p0, first.k, first.seen))
    safe = points(p0, k, seen)
    whole = ends_of(scene).volume.sum() if scene.at is None else scene.model.domain.volume
    return Draw(drawn, reaching, safe, float(whole))


def in_one_array(asked: Placed, key: jax.Array, n: int) -> tuple[np.ndarray, int]:
    """The same plans with their clearances, rows (found, n_p + n_k + 1), and how many were drawn,
    fetched at once.
    """
    told = jax.device_get(first_safe(asked, key, n).told)
    found, drawn = told[-1, :2].astype(int)
    return told[:found], int(drawn)


@lru_cache
def _number(n: int, device: jax.Device | None) -> jax.Array:
    return jax.device_put(np.int32(n), device)


@partial(jax.jit, static_argnames=("slots", "how"), compiler_options=COMPILER)
def _first_safe(asked: Placed, key: jax.Array, n: Index, slots: int, how: Backend) -> First:
    judge = _in_turn if how.in_turn else _side_by_side

    def round_of(state: tuple):
        i, first = state
        drawn = draw_round(asked, jax.random.fold_in(key, i), how.round)
        return i + 1, judge(asked, drawn, n, first)

    def unfinished(state: tuple):
        i, first = state
        some = asked.ends.volume.sum() > 0
        return (i < how.rounds) & (first.found < n) & some

    nothing = _nothing(asked, slots)
    zero = jnp.zeros((), jnp.int32)
    first = jax.lax.while_loop(unfinished, round_of, (zero, nothing))[1]
    told = jnp.concatenate([first.p0, first.k, first.seen.clearance[:, None]], axis=1)
    counts = jnp.zeros((1, told.shape[1]), told.dtype)
    counts = counts.at[0, 0].set(first.found.astype(told.dtype))
    counts = counts.at[0, 1].set(first.drawn.astype(told.dtype))
    return first._replace(told=jnp.concatenate([told, counts]))


def _nothing(asked: Placed, slots: int) -> First:
    """No plan yet, and room for so many. Gaps are not traced for the sizes of a verdict."""
    scene = asked.scene
    lo = scene.z_lo, scene.k_lo
    seen = jax.eval_shape(lambda: prediction(asked.net, asked.tube, scene, *lo))
    one = *lo, Verdicts(*seen, seen.goal)
    room = jax.tree.map(lambda x: jnp.zeros((slots, *x.shape), x.dtype), one)
    return First(*room, *[jnp.zeros((), jnp.int32)] * 3)


def draw_round(asked: Placed, key: jax.Array, size: int) -> Drawn:
    """Plans drawn by their bins and ends, or from the one start; kernel."""
    ends, scene, n_k = asked.ends, asked.scene, asked.scene.k_lo.shape[0]
    n_z = scene.z_lo.shape[0]
    share = jax.random.uniform(key, (size, 1 + n_k + n_z), scene.z_lo.dtype)
    below = jnp.cumsum(ends.volume)
    bin = jnp.searchsorted(below, share[:, 0] * below[-1], side="right")
    bin = jnp.minimum(bin, len(below) - 1)
    if asked.at is None:
        k = _between(ends.k_lo[bin], ends.k_hi[bin], share[:, 1 : 1 + n_k])
        z = _between(ends.z_lo[bin], ends.z_hi[bin], share[:, 1 + n_k :])
    else:
        k = _between(scene.k_lo[None], scene.k_hi[None], share[:, 1 : 1 + n_k])
        z = None

    def plan(z: Vector | None, k: Params):
        p0, reaches = anchored(asked.end, asked.tube, scene, z, k, asked.at)
        return Drawn(p0, k, reaches)

    return jax.vmap(plan)(z, k)


def _between(
    lo: Float[jax.Array, "#b n"], hi: Float[jax.Array, "#b n"], share: Float[jax.Array, "b n"]
):
    return lo + share * (hi - lo)


def _in_turn(asked: Placed, drawn: Drawn, n: Index, first: First) -> First:
    """With the safe plans of a round, each judged by itself until there are enough."""

    def judge(state: tuple):
        left, first, _ = state
        i = jnp.argmax(left)
        p0, k = drawn.p0[i], drawn.k[i]
        seen, *_ = verdict_in_turn(asked.net, asked.tube, asked.scene, p0, k)
        put = partial(jax.tree.map, lambda whole, x: whole.at[first.found].set(x))
        p0, k, kept = put((first.p0, first.k, first.seen), (p0, k, seen))
        found = first.found + seen.safe.astype(jnp.int32)
        first = first._replace(p0=p0, k=k, seen=kept, found=found)
        return left.at[i].set(False), first, i

    def unfinished(state: tuple):
        left, first, _ = state
        return left.any() & (first.found < n)

    start = (drawn.reaches, first, jnp.argmax(drawn.reaches))
    left, first, last = jax.lax.while_loop(unfinished, judge, start)
    whole = (first.found < n) & ~left.any()
    return _counted(first, drawn, jnp.where(whole, len(drawn.k), last.astype(jnp.int32) + 1))


def _side_by_side(asked: Placed, drawn: Drawn, n: Index, first: First) -> First:
    """The same, with all plans of a round judged at once."""
    judge = jax.vmap(verdict, in_axes=(None, None, None, 0, 0))
    seen = judge(asked.net, asked.tube, asked.scene, drawn.p0, drawn.k)
    safe = seen.safe & drawn.reaches
    place = first.found + jnp.cumsum(safe, dtype=jnp.int32) - 1
    to = jnp.where(safe & (place < n), place, len(first.p0))  # beyond the slots: dropped
    put = partial(jax.tree.map, lambda whole, x: whole.at[to].set(x, mode="drop"))
    p0, k, kept = put((first.p0, first.k, first.seen), (drawn.p0, drawn.k, seen))
    found = jnp.minimum(first.found + safe.sum(dtype=jnp.int32), n)
    last = jnp.argmax(safe & (place == n - 1)).astype(jnp.int32)
    first = first._replace(p0=p0, k=k, seen=kept, found=found)
    return _counted(first, drawn, jnp.where(found < n, len(safe), last + 1))


def _counted(first: First, drawn: Drawn, looked_at: Index) -> First:
    """With the first so many plans of a round counted."""
    counts = jnp.arange(len(drawn.reaches), dtype=jnp.int32) < looked_at
    return first._replace(
        drawn=first.drawn + looked_at,
        reaching=first.reaching + (drawn.reaches & counts).sum(dtype=jnp.int32),
    )
