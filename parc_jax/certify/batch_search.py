"""One scene of a batch: plans proposed in float32 from a pool that all scenes share, judged in float64. Kernels. [T15]

The network is evaluated once for the pool, so a scene costs segment tests only. A proposal is never an answer: what
is returned has passed `evaluate.verdict` in float64, with the slack of T11, like the samples of a single query.
"""

import jax
import jax.numpy as jnp
from flax import struct

from parc_jax.certify.evaluate import HIGHEST, bin_of, predict, verdict
from parc_jax.certify.scene import Scene
from parc_jax.error.tube import Tube
from parc_jax.network.relu import ReLUNetwork

PROPOSED = 64  # plans proposed per scene and round
JUDGED = 4  # of which so many, those of the largest estimated clearance, are judged in float64
NARROW, WIDE = 0.003, 0.3  # shares of K by which a warm start varies k


@struct.dataclass
class Pool:
    """n values of k with what the model says of them, relative to the predicted end.

    k (n, n_k), end (n, n_p), q (n, n_q), final (n, n_p + n_q) float64; known (n,) bool: k has one bin, with a claim.
    way (n, n_p, T + 1), error (n, n_p, T): float32, time last; only proposals are made from them.
    """

    k: jax.Array
    end: jax.Array
    q: jax.Array
    final: jax.Array
    known: jax.Array
    way: jax.Array
    error: jax.Array


@struct.dataclass
class Best:
    """The safe plans found so far, best first: plans (n, n_p + n_k), clearance (n,) [m], -inf where there is none."""

    plans: jax.Array
    clearance: jax.Array


def pool_of(net: ReLUNetwork, tube: Tube, k) -> Pool:
    """The pool of given k (n, n_k)."""

    def one(k):
        offsets, q, _ = predict(net, *tube.interval.shape[1:], k)
        number = bin_of(tube, k)
        error, final = jnp.asarray(tube.interval)[number], jnp.asarray(tube.final)[number]
        way = (offsets - offsets[-1][None]).T.astype(jnp.float32)
        known = (number >= 0) & jnp.isfinite(final).all()
        return Pool(k, offsets[-1], q, final, known, way, error.T.astype(jnp.float32))

    return jax.vmap(one)(k)


def pool_at_random(net: ReLUNetwork, tube: Tube, key, lo, hi, n: int) -> Pool:
    """A pool of n values of k, uniform on the box [lo, hi] (n_k,) of floats."""
    share = jax.random.uniform(key, (n, len(lo)), lo.dtype)
    return pool_of(net, tube, jnp.clip(lo[None] + share * (hi - lo)[None], lo[None], hi[None]))


def room(pool: Pool, scene: Scene) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Box lo, hi (n, n_p) of the ends z that reach the goal from the start with each k, and whether there are any (n,).

    Everything outside of the box fails. Inside, rows that mix axes are still to be tested.
    """
    n_p, pad = pool.end.shape[1], 4 * scene.slack
    start_lo, start_hi = _sides(scene.start_A, scene.start_b)
    lo = jnp.maximum(scene.z_lo[None] + pool.final[:, :n_p], start_lo[None] + pool.end) + pad
    hi = jnp.minimum(scene.z_hi[None] - pool.final[:, :n_p], start_hi[None] + pool.end) - pad
    goal_p, goal_q = scene.goal_A[:, :n_p], scene.goal_A[:, n_p:]
    left = scene.goal_b[None] - _dot(pool.q, goal_q.T) - _dot(pool.final, jnp.abs(scene.goal_A).T)
    goal = (left - _least(goal_p, lo, hi) >= 0).all(axis=1)
    start = (scene.start_b[None] - _least(scene.start_A, lo - pool.end, hi - pool.end) >= 0).all(axis=1)
    return lo, hi, pool.known & (lo <= hi).all(axis=1) & goal & start


def propose(pool: Pool, scene: Scene, chosen, z):
    """Estimated clearance [m] (c,) of plans that end in z (c, n_p) with k of the chosen items (c,). Unsound by purpose.

    The largest gap along edge normals of the grown obstacle: exact beside an edge, too small around a corner of a disc.
    """
    path = z.astype(jnp.float32)[:, :, None] + pool.way[chosen]
    e, grown = pool.error[chosen], jax.tree.map(_single, scene.obstacles)

    def obstacle(j, clearance):
        corner, sign = grown.corner[j], grown.sign[j]
        along = jnp.roll(corner, -1, axis=0) - corner + jnp.roll(sign, -1, axis=0) - sign  # an edge for some e > 0
        length = jnp.sqrt((along * along).sum(axis=1))
        w = jnp.stack([along[:, 1], -along[:, 0]], axis=1) / jnp.where(length > 0, length, 1)[:, None]
        reach = _dot(corner, w.T).max(axis=0)

        def facet(i, gap):
            out = w[i, 0] * path[:, 0] + w[i, 1] * path[:, 1] - reach[i]
            grow = jnp.abs(w[i, 0]) * e[:, 0] + jnp.abs(w[i, 1]) * e[:, 1]
            here = jnp.minimum(out[:, :-1], out[:, 1:]) - grow
            return jnp.where(length[i] > 0, jnp.maximum(gap, here), gap)

        gap = jax.lax.fori_loop(0, len(corner), facet, jnp.full(e.shape[::2], -jnp.inf, jnp.float32))
        return jnp.minimum(clearance, jnp.where(grown.active[j][None], gap, jnp.inf).min(axis=1))

    far = jnp.full(len(z), jnp.inf, jnp.float32)
    return jax.lax.fori_loop(0, len(grown.corner), obstacle, far) - grown.radius


def judge(net, tube, scene: Scene, pool: Pool, chosen, z, allowed, best: Best) -> Best:
    """Propose plans, judge the most promising ones in float64, keep the best. allowed (c,): worth looking at."""
    estimate = jnp.where(allowed, propose(pool, scene, chosen, z), -jnp.inf)
    _, most = jax.lax.top_k(estimate, min(JUDGED, len(z)))
    k = pool.k[chosen[most]]
    p0 = z[most] - pool.end[chosen[most]]
    seen = jax.vmap(verdict, in_axes=(None, None, None, 0, 0))(net, tube, scene, p0, k)
    clearance = jnp.where(seen.safe, seen.clearance, -jnp.inf)
    plans = jnp.concatenate([best.plans, jnp.concatenate([p0, k], axis=1)])
    clearance, kept = jax.lax.top_k(jnp.concatenate([best.clearance, clearance]), len(best.clearance))
    return Best(plans[kept], clearance)


def search(net, tube, scene: Scene, number, best: Best, pool: Pool, key, first, last) -> tuple[Best, jax.Array]:
    """Rounds first..last - 1 of one scene; ends when every place of `best` holds a safe plan.

    number (): the scene's own number, folded into the key. Returns the best plans and the rounds that were run.
    """
    lo, hi, feasible = room(pool, scene)
    rank = jnp.cumsum(feasible, dtype=jnp.int32)
    key, n = jax.random.fold_in(key, number), rank[-1]
    order = jnp.arange(PROPOSED, dtype=jnp.int32)

    def one_round(state):
        turn, best = state
        item = (turn * PROPOSED + order) % jnp.maximum(n, 1)
        chosen = jnp.minimum(jnp.searchsorted(rank, item + 1), len(rank) - 1)
        share = jax.random.uniform(jax.random.fold_in(key, turn), (PROPOSED, lo.shape[1]), lo.dtype)
        z = lo[chosen] + share * (hi - lo)[chosen]
        return turn + 1, judge(net, tube, scene, pool, chosen, z, jnp.broadcast_to(n > 0, order.shape), best)

    def unfinished(state):
        turn, best = state
        return (turn < last) & (n > 0) & ~(best.clearance > 0).all()

    turn, best = jax.lax.while_loop(unfinished, one_round, (first, best))
    return best, turn - first


def rewarm(net, tube, scene: Scene, number, best: Best, plans, key) -> Best:
    """Begin from earlier plans (w, n_p + n_k), NaN where there is none: the same k and ends, then more and more apart.

    Proposal i < w is plan i itself, moved as little as goal and start ask for; the others vary k and keep the end.
    """
    n_p = scene.z_lo.shape[0]
    usable = jnp.isfinite(plans).all(axis=1)
    source = jnp.arange(PROPOSED) % len(plans)
    old = jnp.where(usable[:, None], plans, 0.0)[source]
    spread = NARROW * (WIDE / NARROW) ** (jnp.arange(PROPOSED, dtype=old.dtype) / PROPOSED)
    spread = jnp.where(jnp.arange(PROPOSED) < len(plans), 0.0, spread)[:, None] * (scene.k_hi - scene.k_lo)[None]
    noise = jax.random.normal(jax.random.fold_in(key, number), (PROPOSED, len(scene.k_lo)), old.dtype)
    near = jnp.clip(old[:, n_p:] + spread * noise, scene.k_lo[None], scene.k_hi[None])
    pool, before = pool_of(net, tube, near), pool_of(net, tube, old[:, n_p:])
    lo, hi, feasible = room(pool, scene)
    z = jnp.clip(old[:, :n_p] + before.end, lo, jnp.maximum(lo, hi))
    return judge(net, tube, scene, pool, jnp.arange(PROPOSED), z, feasible & usable[source], best)


def _sides(A, b):
    """Bounding box lo, hi (n,) by the rows that bound one axis alone; infinite where there is none."""
    alone = (A != 0) & ((A != 0).sum(axis=1) == 1)[:, None]
    at = b[:, None] / jnp.where(alone, A, 1)
    return (
        jnp.where(alone & (A < 0), at, -jnp.inf).max(axis=0),
        jnp.where(alone & (A > 0), at, jnp.inf).min(axis=0),
    )


def _least(A, lo, hi):
    """Least value (n, h) of each row of A (h, n_p) over the boxes [lo, hi] (n, n_p)."""
    return jnp.minimum(A[None] * lo[:, None], A[None] * hi[:, None]).sum(axis=2)


def _dot(a, b):
    return jnp.matmul(a, b, precision=HIGHEST)


def _single(x):
    x = jnp.asarray(x)
    return x.astype(jnp.float32) if jnp.issubdtype(x.dtype, jnp.floating) else x
