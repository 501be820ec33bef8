"""The first safe ones of proposed plans, judged in order in one compiled call: of uniform draws
over all plans that may reach the goal, or of a list, sorted by any preference. [T11, T15]

Each is judged as every single plan is, in float64 with the slack of the scene. Safe plans are taken
in the order of the proposals, so that those of draws are uniform over the safe set. Nothing moves
between host and device but the key or the list.
"""

from functools import lru_cache, partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int

from parc_jax.common import struct
from parc_jax.common.arrays import once, x64
from parc_jax.common.backend import Backend, backend
from parc_jax.common.errors import InputError
from parc_jax.common.shapes import Index, ManyParams, Params, Positions, Vector
from parc_jax.learning.bound.bins import closed_bins, open_bin_of
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.corridors.sampling import BinEnds, Draw, ends_of, points
from parc_jax.safe_set.verdict.pointwise import (
    Verdicts,
    anchored,
    end_network,
    prediction,
    verdict,
    verdict_in_turn,
)
from parc_jax.safe_set.verdict.scene import ROOM, Scene, SceneArrays, padded

SLOTS = (1, 4, 16)  # capacities of a compiled program, in plans
MOST = SLOTS[-1]
NO_LIMIT = 2**31 - 1  # of separation tests
# without its emitters of fused loops XLA compiles this program for a CPU in half the time, and it
# runs as fast; the option says nothing to other devices, and later lines of XLA do not have it
COMPILER = {"xla_cpu_use_fusion_emitters": False} if jax.__version_info__ < (0, 10) else None


@struct.dataclass
class Placed:
    """A model and a scene on the device, moved there once for all queries about them.

    end: the network with the outputs of the last knot only. scene: padded for more obstacles.
    ends: the bins and where their plans may end. at: (n_p,) [m] the one start of all plans, None
        for any.
    """

    net: ReLUNetwork
    end: ReLUNetwork
    tube: Tube
    scene: SceneArrays
    ends: BinEnds
    at: jax.Array | None


def placed(scene: Scene) -> Placed:
    """The scene on the device that JAX is set to; moved there once while the scene lives."""
    return once(scene, _placed, jax.config.jax_default_device)


def _placed(scene: Scene, device: jax.Device | None) -> Placed:
    about = once(scene.model, _of_model, device)
    corners_of_a_box = 2**scene.model.n_p
    own = (padded(scene, ROOM, corners_of_a_box).arrays, ends_of(scene), scene.at)
    with x64(), jax.transfer_guard_host_to_device("allow"):
        return Placed(*about, *_moved(own))


@jax.jit
def _moved(tree: tuple):
    """The same arrays on the device, in one call: `device_put` takes three times as long."""
    return tree


def _of_model(model: TrajectoryModel, _device: jax.Device | None):
    with x64():
        return jax.device_put((model.net, end_network(model), model.tube))


class Proposals(NamedTuple):
    """Plans p0 (r, n_p), k (r, n_k). bins (r, c): those that contain k, of which the first n_bins
    count; a plan must be safe in all of them. worth (r,) bool: the others do not reach the goal.
    """

    p0: jax.Array
    k: jax.Array
    bins: jax.Array
    n_bins: jax.Array | int
    worth: jax.Array


class Limits(NamedTuple):
    """Ends of a search: n safe plans, one with a clearance of room [m], or so many tests of one
    plan against one pair of an obstacle and a part, which are nearly all of the work.
    """

    n: jax.Array | int
    room: jax.Array | float = jnp.inf
    tests: jax.Array | int = NO_LIMIT


class FirstSafe(NamedTuple):
    """Safe plans in the order of the proposals; the first `count` entries of the arrays are valid.

    rows (n,): numbers among the proposals of their round. plans (n, n_p + n_k). clearance (n,) [m]:
    least over every run inside the tube. judged: proposals up to the last one needed, reaching: of
    these, looks: tests of a plan against a pair. touched: a pair that the last plan touches, -1 for
    none.
    """

    rows: jax.Array
    plans: jax.Array
    clearance: jax.Array
    count: jax.Array
    judged: jax.Array
    reaching: jax.Array
    looks: jax.Array
    touched: jax.Array

    def fetched(self) -> "FirstSafe":
        """The valid plans, on the host."""
        # one by one: `device_get` of all takes 0.2 ms, a third of a prepared query
        with jax.transfer_guard_device_to_host("allow"):
            host = [np.asarray(x) for x in self]
        counts = [int(x) for x in host[3:]]
        return FirstSafe(*(x[: counts[0]] for x in host[:3]), *counts)


def first_safe(scene: Scene, key: jax.Array, n: int) -> tuple[FirstSafe, Verdicts]:
    """The first n safe plans of uniform draws, n at most MOST, on the host, and the network's
    prediction of them, on the device, padded. Fewer where more rounds would be slow.

    key: of `jax.random`, consumed.
    """
    asked = placed(scene)
    slots = next(size for size in SLOTS if size >= n)
    (device,) = asked.scene.count.devices()
    with x64():
        safe, seen = _first_safe(asked, key, _number(n, device), slots, backend(device))
    return safe.fetched(), seen


def first_draw(scene: Scene, key: jax.Array, n: int) -> Draw:
    """The first n safe plans as a draw, n at most MOST. Its size depends on the result: the draw
    ends with the last plan needed.
    """
    safe, seen = first_safe(scene, key, n)
    seen = jax.tree.map(lambda x: np.asarray(x)[: safe.count], seen)
    p0, k = np.split(safe.plans, [scene.model.n_p], axis=1)
    whole = ends_of(scene).volume.sum() if scene.at is None else scene.model.domain.volume
    return Draw(safe.judged, safe.reaching, points(p0, k, seen), float(whole))


def preferred(
    scene: Scene,
    k: np.ndarray,
    n: int = 1,
    room: float = np.inf,
    looks: int = NO_LIMIT,
    p0: np.ndarray | None = None,
) -> FirstSafe:
    """The first n safe plans of a list in its order, from the one start of a scene, on the host.

    k: (m, n_k) parameters. n: 16 at most. room: [m] of clearance, which ends the search. looks: so
        many tests of a plan against a pair end it too. p0: (m, n_p) [m] a start of each instead.
    Raises InputError.
    """
    if scene.at is None and p0 is None:
        raise InputError("preferred: expected a question with one start; ask it with `at`.")
    if not 1 <= n <= MOST:
        raise InputError(f"preferred: expected 1 to {MOST} plans; got {n}.")
    k = np.asarray(k, np.float64)
    if k.ndim != 2 or k.shape[1] != scene.model.n_k:
        raise InputError(f"preferred: expected k of shape (m, {scene.model.n_k}); got {k.shape}.")
    p0 = np.tile(scene.at, (len(k), 1)) if p0 is None else np.asarray(p0, np.float64)
    bins = closed_bins(scene.model.tube.edges, k)
    # borders are rare: capacity for all bins that can meet, of which as many are tested as do
    padded = np.zeros((len(k), 2**scene.model.n_k), np.int32)
    padded[:, : bins.shape[1]] = bins
    with x64(), jax.transfer_guard_host_to_device("allow"):
        limits = Limits(n, float(room), min(looks, NO_LIMIT))
        return _preferred(placed(scene), p0, k, padded, bins.shape[1], limits).fetched()


@lru_cache
def _number(n: int, device: jax.Device | None) -> jax.Array:
    return jax.device_put(np.int32(n), device)


@partial(jax.jit, static_argnames=("slots", "how"), compiler_options=COMPILER)
def _first_safe(
    asked: Placed, key: jax.Array, n: Index, slots: int, how: Backend
) -> tuple[FirstSafe, Verdicts]:
    judge = _in_turn if how.in_turn else _side_by_side

    def round_of(state: tuple):
        i, safe = state
        drawn = draw_round(asked, jax.random.fold_in(key, i), how.round)
        return i + 1, judge(asked, drawn, safe, Limits(n))

    def unfinished(state: tuple):
        i, safe = state
        some = asked.ends.volume.sum() > 0
        return (i < how.rounds) & (safe.count < n) & some

    begin = jnp.zeros((), jnp.int32), _nothing(asked, slots)
    safe = jax.lax.while_loop(unfinished, round_of, begin)[1]
    p0, k = jnp.split(safe.plans, [asked.scene.z_lo.shape[0]], axis=1)
    seen = jax.vmap(prediction, in_axes=(None, None, None, 0, 0))
    return safe, seen(asked.net, asked.tube, asked.scene, p0, k)


@partial(jax.jit, compiler_options=COMPILER)
def _preferred(
    asked: Placed,
    p0: Positions,
    k: ManyParams,
    bins: Int[ArrayLike, "b c"],
    n_bins: Index,
    limits: Limits,
) -> FirstSafe:
    listed = Proposals(p0, k, bins, n_bins, jnp.ones(len(k), bool))
    return _in_turn(asked, listed, _nothing(asked, MOST), limits)


def _nothing(asked: Placed, slots: int) -> FirstSafe:
    """No plan yet, and capacity for some."""
    scene, zero = asked.scene, jnp.zeros((), jnp.int32)
    n = scene.z_lo.shape[0] + scene.k_lo.shape[0]
    plans = jnp.zeros((slots, n), scene.k_lo.dtype)
    rows = jnp.zeros(slots, jnp.int32)
    return FirstSafe(rows, plans, plans[:, 0], zero, zero, zero, zero, zero - 1)


def draw_round(asked: Placed, key: jax.Array, size: int) -> Proposals:
    """Plans drawn uniformly by bins and ends, or by parameters from the one start. Kernel. [T15]"""
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
        return p0, k, open_bin_of(asked.tube.edges, k)[None], reaches

    p0, k, bins, reaches = jax.vmap(plan)(z, k)
    return Proposals(p0, k, bins, 1, reaches)


def _between(
    lo: Float[jax.Array, "#b n"], hi: Float[jax.Array, "#b n"], share: Float[jax.Array, "b n"]
):
    return lo + share * (hi - lo)


def _in_turn(asked: Placed, proposals: Proposals, safe: FirstSafe, limits: Limits) -> FirstSafe:
    """With the safe ones of the proposals, each judged by itself until a limit ends it."""
    p0, k, bins, n_bins, worth = proposals

    def clearance_of(i: Index, touched: Index, looks: Index):
        """The least over all bins of plan i, the pair that it touches, and the tests so far."""

        def in_bin(c: Index, state: tuple):
            least, touched, looks = state
            seen, touched, more = verdict_in_turn(
                asked.net, asked.tube, asked.scene, p0[i], k[i], bins[i, c], touched
            )
            own = jnp.where(seen.reaches, seen.clearance, -jnp.inf)
            return jnp.minimum(least, own), touched, looks + more

        begin = jnp.asarray(jnp.inf, k.dtype), touched, looks
        return jax.lax.fori_loop(0, n_bins, in_bin, begin)

    def judge(state: tuple):
        left, safe, _ = state
        i = jnp.argmax(left).astype(jnp.int32)
        clearance, touched, looks = clearance_of(i, safe.touched, safe.looks)
        at = safe.count  # written whether safe or not; the next one overwrites it where not
        safe = safe._replace(
            rows=safe.rows.at[at].set(i),
            plans=safe.plans.at[at].set(jnp.concatenate([p0[i], k[i]])),
            clearance=safe.clearance.at[at].set(clearance),
            count=at + (clearance > 0).astype(at.dtype),
            looks=looks,
            touched=touched,
        )
        return left.at[i].set(False), safe, i

    def unfinished(state: tuple):
        left, safe, _ = state
        roomy = (safe.count > 0) & (safe.clearance[safe.count - 1] >= limits.room)
        return left.any() & (safe.count < limits.n) & ~roomy & (safe.looks < limits.tests)

    begin = worth, safe, jnp.zeros((), jnp.int32)
    left, safe, last = jax.lax.while_loop(unfinished, judge, begin)
    whole = (safe.count < limits.n) & ~left.any()
    return _counted(safe, worth, jnp.where(whole, len(k), last + 1))


def _side_by_side(
    asked: Placed, proposals: Proposals, safe: FirstSafe, limits: Limits
) -> FirstSafe:
    """The same up to n safe plans, with all plans of a round judged at once, in their first bin."""
    p0, k, bins, _, worth = proposals
    judge = jax.vmap(verdict, in_axes=(None, None, None, 0, 0, 0))
    seen = judge(asked.net, asked.tube, asked.scene, p0, k, bins[:, 0])
    good = seen.safe & worth
    place = safe.count + jnp.cumsum(good, dtype=jnp.int32) - 1
    to = jnp.where(good & (place < limits.n), place, len(safe.rows))  # beyond the slots: dropped
    new = jnp.arange(len(k), dtype=jnp.int32), jnp.concatenate([p0, k], axis=1), seen.clearance
    kept = (x.at[to].set(y, mode="drop") for x, y in zip(safe[:3], new, strict=True))
    count = jnp.minimum(safe.count + good.sum(dtype=jnp.int32), limits.n)
    last = jnp.argmax(good & (place == limits.n - 1)).astype(jnp.int32)
    safe = FirstSafe(*kept, count, *safe[4:])
    return _counted(safe, worth, jnp.where(count < limits.n, len(k), last + 1))


def _counted(safe: FirstSafe, worth: jax.Array, judged: Index) -> FirstSafe:
    """With the first so many plans of a round counted."""
    counts = jnp.arange(len(worth), dtype=jnp.int32) < judged
    reaching = (worth & counts).sum(dtype=jnp.int32)
    return safe._replace(
        judged=safe.judged + judged.astype(jnp.int32), reaching=safe.reaching + reaching
    )
