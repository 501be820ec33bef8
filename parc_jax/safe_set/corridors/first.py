"""The first safe ones of proposed plans, judged in order in one compiled call: of uniform draws
over all plans that may reach the goal, or of a list, sorted by any preference. [T11, T15]

Each is judged as every single plan is, in float64 with the slack of the scene. Safe plans are taken
in the order of the proposals, so that those of draws are uniform over the safe set. Nothing moves
between host and device but the key, or a list and the scene it is asked of.
"""

from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int

from parc_jax.common import struct
from parc_jax.common.arrays import once, x64
from parc_jax.common.backend import Backend, backend, compiled
from parc_jax.common.shapes import Index, Key, ManyParams, Params, Positions, Vector
from parc_jax.learning.bound.bins import closed_bins, open_bin_of
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.corridors.sampling import BinEnds, Draw, ends_of, points
from parc_jax.safe_set.verdict.pointwise import Verdicts, anchored, end_network, prediction
from parc_jax.safe_set.verdict.rounds import (
    NO_LIMIT,
    FirstSafe,
    Judge,
    Limits,
    Proposals,
    no_plans,
    rounds,
)
from parc_jax.safe_set.verdict.scene import ROOM, Scene, SceneArrays, padded

SLOTS = (1, 4, 16)  # capacities of a compiled program, in plans
MOST = SLOTS[-1]


@struct.dataclass
class Placed:
    """A model and a scene on the device, moved there once for all queries about them.

    end: the network with the outputs of the last knot only. scene: padded for more obstacles.
    ends: bins and where their plans may end. at: (n_p,) [m] the start of all plans, None for any.
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
    half = once(scene, _half_placed, device)
    with x64(), jax.transfer_guard_host_to_device("allow"):
        arrays, ends, at = _moved((half.scene, half.ends, half.at))
    return half.replace(scene=arrays, ends=ends, at=at)


def _half_placed(scene: Scene, device: jax.Device | None) -> Placed:
    """The model on the device, the scene on the host: of one question it moves with the call."""
    about = once(scene.model, _of_model, device)
    return Placed(*about, padded(scene, ROOM, 2**scene.model.n_p).arrays, ends_of(scene), scene.at)


@jax.jit
def _moved(tree: tuple):
    """The same arrays on the device, in one call: `device_put` takes three times as long."""
    return tree


def _of_model(model: TrajectoryModel, _device: jax.Device | None):
    with x64():
        return jax.device_put((model.net, end_network(model), model.tube))


def first_safe(scene: Scene, key: Key, n: int) -> tuple[FirstSafe, Verdicts]:
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


def first_draw(scene: Scene, key: Key, n: int) -> Draw:
    """The first n safe plans, at most MOST, as a draw that ends with the last plan needed."""
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

    k: (m, n_k) parameters. n: MOST at most. room: [m] of clearance, which ends the search. looks:
        so many tests of a plan against a pair end it too. p0: (m, n_p) [m] a start of each instead.
    """
    k = np.asarray(k, np.float64)
    p0 = np.tile(scene.at, (len(k), 1)) if p0 is None else np.asarray(p0, np.float64)
    bins = closed_bins(scene.model.tube.edges, k)
    # borders are rare: capacity for all bins that can meet, of which as many are tested as do
    padded = np.zeros((len(k), 2**scene.model.n_k), np.int32)
    padded[:, : bins.shape[1]] = bins
    with x64(), jax.transfer_guard_host_to_device("allow"):
        limits = Limits(n, float(room), min(looks, NO_LIMIT))
        asked = once(scene, _half_placed, jax.config.jax_default_device)
        return _preferred(asked, p0, k, padded, bins.shape[1], limits).fetched()


@lru_cache
def _number(n: int, device: jax.Device | None) -> jax.Array:
    return jax.device_put(np.int32(n), device)


@partial(compiled, static_argnames=("slots", "how"))
def _first_safe(
    asked: Placed, key: Key, n: Index, slots: int, how: Backend
) -> tuple[FirstSafe, Verdicts]:
    judge = Judge(asked.net, asked.tube, asked.scene)
    first = judge.in_turn if how.in_turn else judge.side_by_side
    none = ~(asked.ends.volume.sum() > 0)
    _, safe = rounds(
        lambda i: draw_round(asked, jax.random.fold_in(key, i), how.round),
        partial(first, limits=Limits(n)),
        lambda safe: (safe.count >= n) | none,
        no_plans(asked.scene, slots),
        (0, how.rounds),
    )
    p0, k = jnp.split(safe.plans, [asked.scene.z_lo.shape[0]], axis=1)
    seen = jax.vmap(prediction, in_axes=(None, None, None, 0, 0))
    return safe, seen(*judge, p0, k)


@compiled
def _preferred(
    asked: Placed,
    p0: Positions,
    k: ManyParams,
    bins: Int[ArrayLike, "b c"],
    n_bins: Index,
    limits: Limits,
) -> FirstSafe:
    listed = Proposals(p0, k, bins, n_bins, jnp.ones(len(k), bool))
    judge = Judge(asked.net, asked.tube, asked.scene)
    return judge.in_turn(listed, no_plans(asked.scene, MOST), limits)


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
