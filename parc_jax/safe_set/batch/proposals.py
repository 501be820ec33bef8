"""One scene of a batch: plans proposed in float32 from a pool that all scenes share, checked in
float64. Kernels. [T15]

The network is evaluated once for the pool, so a scene costs separation tests only. Estimated
clearances decide which proposals are checked. A plan that is returned has passed the point test in
float64, with the rounding tolerance of [T11], like the samples of a single query.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from parc_jax.common import struct
from parc_jax.common.arrays import least_over, product
from parc_jax.common.shapes import Index, Params
from parc_jax.learning.bound.bins import open_bin_of
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.learning.bound.reach import Reach
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import moved_to, predict
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.batch.estimate import estimate_clearance, estimate_roughly
from parc_jax.safe_set.verdict.rounds import Best, Judge, Proposals, rounds
from parc_jax.safe_set.verdict.scene import SceneArrays

PROPOSED = 24  # plans proposed per scene and round; nearly all scenes end with the first round
LOOKED = 3 / 16  # of which, for bodies of hulls, this share remains after a rough look
VARIED = 64  # plans around earlier ones, which a warm start begins with
CHECKED = 4  # of all, at most so many, of the largest estimated clearance, are checked in float64
# shares of K by which a warm start varies k, from the first to the last proposal
NARROW = 0.003
WIDE = 0.3


class About(NamedTuple):
    """The model of a batch: network, tube, and its error support table of `along_fan`."""

    net: ReLUNetwork
    tube: Tube
    fan: Reach


@struct.dataclass
class Pool:
    """n values of k with the model's predictions.

    k (n, n_k), end (n, n_c) from p0, q (n, n_q): float64.
    final (n,): errors at the end. least, most (n, n_p): their extent at the first point.
    known: (n,) bool, k has one bin, with an error bound. bin: (n,) its number.
    way: (n, n_c, T + 1) relative to the end of the first point, float32; only for proposals.
    """

    k: jax.Array
    end: jax.Array
    q: jax.Array
    final: ErrorSet
    least: jax.Array
    most: jax.Array
    known: jax.Array
    bin: jax.Array
    way: jax.Array


def pool_of(net: ReLUNetwork, tube: Tube, k: Float[jax.Array, "n n_k"]) -> Pool:
    """The pool of given k."""
    least, most = (jnp.asarray(x) for x in tube.end_extent)

    def one(k):
        offsets, q, _ = predict(net, tube.layout, k)
        bin = open_bin_of(tube.edges, k)
        back = moved_to(-offsets[-1, : tube.n_p], offsets)
        return Pool(
            k=k,
            end=offsets[-1],
            q=q,
            final=tube.at_end(bin),
            least=least[bin],
            most=most[bin],
            known=(bin >= 0) & jnp.isfinite(least[bin]).all() & jnp.isfinite(most[bin]).all(),
            bin=bin,
            way=back.T.astype(jnp.float32),
        )

    return jax.vmap(one)(k)


def pool_at_random(
    net: ReLUNetwork, tube: Tube, key: jax.Array, lo: Params, hi: Params, n: int
) -> Pool:
    """A pool of n values of k, uniform on the box [lo, hi] (n_k,) of floats."""
    share = jax.random.uniform(key, (n, len(lo)), lo.dtype)
    return pool_of(net, tube, jnp.clip(lo[None] + share * (hi - lo)[None], lo[None], hi[None]))


class Ends(NamedTuple):
    """Where plans may end with each of n values of k: boxes lo, hi (n, n_p) of z, any (n,) bool.

    Everything outside of a box misses the goal or the start set. Inside, rows that mix axes are
    still to be tested.
    """

    lo: jax.Array
    hi: jax.Array
    any: jax.Array


def allowed_ends(pool: Pool, scene: SceneArrays) -> Ends:
    """The ends that reach the goal from the start set."""
    n_p, n_c = scene.z_lo.shape[0], pool.end.shape[1]
    first, pad = pool.end[:, :n_p], 4 * scene.slack
    goal_c = scene.goal_A[:, :n_c]
    goal_p = goal_c.reshape(len(goal_c), -1, n_p).sum(axis=1)  # every point moves with the first
    around = pool.end - jnp.concatenate([first] * (n_c // n_p), axis=1)
    lost = at(pool.final, np.s_[:, None]).support(scene.goal_A[None])
    bounds = scene.goal_b[None] - product(pool.q, scene.goal_A[:, n_c:].T) - lost
    bounds = bounds - product(around, goal_c.T)
    goal_lo, goal_hi = jax.vmap(_sides, in_axes=(None, 0))(goal_p, bounds)
    start_lo, start_hi = _sides(scene.start_A, scene.start_b)
    lo = jnp.maximum(scene.z_lo[None] - pool.least, start_lo[None] + first)
    hi = jnp.minimum(scene.z_hi[None] - pool.most, start_hi[None] + first)
    lo = jnp.maximum(lo, goal_lo) + pad
    hi = jnp.minimum(hi, goal_hi) - pad
    goal = (bounds - least_over(goal_p, lo, hi) >= 0).all(axis=1)
    left = scene.start_b[None] - least_over(scene.start_A, lo - first, hi - first)
    return Ends(lo, hi, pool.known & (lo <= hi).all(axis=1) & goal & (left >= 0).all(axis=1))


def promising(
    about: About,
    scene: SceneArrays,
    pool: Pool,
    chosen: Int[jax.Array, " c"],
    z: Float[jax.Array, "c n_p"],
    worth: Bool[jax.Array, " c"],
    kept: int,
) -> Proposals:
    """The coarse test: proposals of the largest estimated clearance, those to be judged.

    chosen: (c,) items of the pool, which give k. z: (c, n_p) [m] ends.
    worth: (c,) bool, the others come last. kept: number of plans that are looked for.
    """
    checked = CHECKED
    # (c, n_c, T + 1) float32, which end in z
    end = jnp.concatenate([z.astype(jnp.float32)] * (pool.way.shape[1] // z.shape[1]), axis=1)
    path = end[:, :, None] + pool.way[chosen]
    taken = about.fan.of(pool.bin[chosen])
    if not scene.obstacles.closed:  # a check costs much, and estimates are nearly right
        checked = min(CHECKED, kept)
        rough = jnp.where(worth, estimate_roughly(scene.obstacles, path, taken), -jnp.inf)
        _, few = jax.lax.top_k(rough, max(1, int(LOOKED * len(z))))
        z, chosen, worth, path = z[few], chosen[few], worth[few], path[few]
        taken = about.fan.of(pool.bin[chosen])
    estimate = jnp.where(worth, estimate_clearance(scene.obstacles, path, taken), -jnp.inf)
    _, most = jax.lax.top_k(estimate, min(checked, len(z)))
    of = chosen[most]
    p0 = z[most] - pool.end[of, : z.shape[1]]
    return Proposals(p0, pool.k[of], pool.bin[of][:, None], 1, worth[most])


def search(row: tuple, best: Best, shared: tuple) -> tuple[Best, jax.Array]:
    """Rounds first ... last - 1 of one scene, until each place of `best` holds a safe plan. Kernel.

    row: scene and its number, folded into the key. shared: (about, pool, key, order, first, last),
        with order (c,) the numbers of the proposals of a round.
    Returns the best plans and the number of rounds.
    """
    scene, number = row
    about, pool, key, order, first, last = shared
    ends = allowed_ends(pool, scene)
    rank = jnp.cumsum(ends.any, dtype=jnp.int32)
    n = rank[-1]  # items of the pool with an end
    key = jax.random.fold_in(key, number)

    def propose(number: Index) -> Proposals:
        item = (number * len(order) + order) % jnp.maximum(n, 1)
        chosen = jnp.minimum(jnp.searchsorted(rank, item + 1), len(rank) - 1)
        round_key = jax.random.fold_in(key, number)
        share = jax.random.uniform(round_key, (len(order), ends.lo.shape[1]), ends.lo.dtype)
        z = ends.lo[chosen] + share * (ends.hi - ends.lo)[chosen]
        worth = jnp.broadcast_to(n > 0, order.shape)
        return promising(about, scene, pool, chosen, z, worth, len(best.clearance))

    last, best = rounds(
        propose,
        Judge(about.net, about.tube, scene).clearest,
        lambda best: (n == 0) | (best.clearance > 0).all(),
        best,
        (first, last),
    )
    return best, last - first


def rewarm(row: tuple, best: Best, shared: tuple) -> Best:
    """Begin from earlier plans (w, n_p + n_k), NaN where there is none: the same k and ends, then
    farther and farther away. Kernel.

    row: scene, its number, earlier plans. shared: (about, key). Proposal i < w is plan i itself,
    moved as little as goal and start require; the others vary k and have the same end.
    """
    scene, number, plans = row
    about, key = shared
    n_p = scene.z_lo.shape[0]
    usable = jnp.isfinite(plans).all(axis=1)
    source = jnp.arange(VARIED) % len(plans)
    old = jnp.where(usable[:, None], plans, 0.0)[source]
    spread = NARROW * (WIDE / NARROW) ** (jnp.arange(VARIED, dtype=old.dtype) / VARIED)
    spread = jnp.where(jnp.arange(VARIED) < len(plans), 0.0, spread)
    sizes = spread[:, None] * (scene.k_hi - scene.k_lo)[None]
    noise = jax.random.normal(jax.random.fold_in(key, number), (VARIED, len(scene.k_lo)), old.dtype)
    near = jnp.clip(old[:, n_p:] + sizes * noise, scene.k_lo[None], scene.k_hi[None])
    pool = pool_of(about.net, about.tube, near)
    before = pool_of(about.net, about.tube, old[:, n_p:])
    ends = allowed_ends(pool, scene)
    z = jnp.clip(old[:, :n_p] + before.end[:, :n_p], ends.lo, jnp.maximum(ends.lo, ends.hi))
    worth = ends.any & usable[source]
    asked = promising(about, scene, pool, jnp.arange(VARIED), z, worth, len(best.clearance))
    return Judge(about.net, about.tube, scene).clearest(asked, best)


def _sides(A: Float[jax.Array, "h n"], b: Float[jax.Array, " h"]):
    """Bounding box lo, hi (n,) by the rows that bound one axis alone; infinite where none is."""
    alone = (A != 0) & ((A != 0).sum(axis=1) == 1)[:, None]
    at = b[:, None] / jnp.where(alone, A, 1)
    lo = jnp.where(alone & (A < 0), at, -jnp.inf).max(axis=0)
    hi = jnp.where(alone & (A > 0), at, jnp.inf).min(axis=0)
    return lo, hi
