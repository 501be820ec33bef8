"""The first safe ones of given plans, in the order in which they are given, in one compiled call:
who wants the best of many by any measure of one's own sorts them by it. [T11]

A plan is judged as every single plan is, in float64 with the slack of the scene; where bins of K
meet it has to be safe in all of them.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Int

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.common.shapes import Index, ManyParams, Scalar
from parc_jax.learning.bound.bins import closed_bins
from parc_jax.safe_set.corridors.placed import Placed, placed
from parc_jax.safe_set.verdict.pointwise import verdict_in_turn
from parc_jax.safe_set.verdict.scene import Scene

MOST = 16  # plans that are found in one call
LOOKS = 2**31 - 1  # at pairs: as many as it takes


class Preferred(NamedTuple):
    """rows (n,): numbers of safe plans, in the order in which they were given. clearance (n,) [m]:
    kept from every obstacle by every run inside the tube. judged: plans that were looked at, looks:
    at how many pairs of an obstacle and a part for them.
    """

    rows: np.ndarray
    clearance: np.ndarray
    judged: int
    looks: int


def preferred(
    scene: Scene, k: np.ndarray, n: int = 1, room: float = np.inf, looks: int = LOOKS
) -> Preferred:
    """The first n safe plans, 16 at most, of k (m, n_k) from the one start of a scene; none after
    the first that has so much room [m], and none after so many looks at a pair of an obstacle and a
    part, which are nearly all of the work. Fewer, or none, where there are not so many. Raises
    InputError.
    """
    if scene.at is None:
        raise InputError("preferred: expected a question with one start; ask it with `at`.")
    if not 1 <= n <= MOST:
        raise InputError(f"preferred: expected 1 to {MOST} plans; got {n}.")
    k = np.asarray(k, np.float64)
    if k.ndim != 2 or k.shape[1] != scene.model.n_k:
        raise InputError(f"preferred: expected k of shape (m, {scene.model.n_k}); got {k.shape}.")
    bins = closed_bins(scene.model.tube.edges, k)
    # borders are rare: room for all bins that can meet, of which as many are looked at as do
    padded = np.zeros((len(k), 2**scene.model.n_k), np.int32)
    padded[:, : bins.shape[1]] = bins
    with x64(), jax.transfer_guard_host_to_device("allow"):
        limits = bins.shape[1], n, float(room), min(looks, LOOKS)
        told, found = jax.device_get(_preferred(placed(scene), k, padded, *limits))
    counts = int(told.judged), int(told.looks)
    return Preferred(told.rows[:found], told.clearance[:found], *counts)


@jax.jit
def _preferred(
    asked: Placed,
    k: ManyParams,
    bins: Int[ArrayLike, "b c"],
    n_bins: Index,
    n: Index,
    room: Scalar,
    most_looks: Index,
) -> tuple[Preferred, jax.Array]:
    def room_of(i: Index, touched: Index, looks: Index):
        """The least that any bin leaves to a plan, what it touches, and all looks so far."""

        def in_bin(c: Index, state: tuple):
            least, touched, looks = state
            seen, touched, more = verdict_in_turn(
                asked.net, asked.tube, asked.scene, asked.at, k[i], bins[i, c], touched
            )
            own = jnp.where(seen.reaches, seen.clearance, -jnp.inf)
            return jnp.minimum(least, own), touched, looks + more

        begin = jnp.asarray(jnp.inf, k.dtype), touched, looks
        return jax.lax.fori_loop(0, n_bins, in_bin, begin)

    def judge(state: tuple):
        i, found, rows, clearance, touched, looks = state
        own, touched, looks = room_of(i, touched, looks)
        rows, clearance = rows.at[found].set(i), clearance.at[found].set(own)
        return i + 1, found + (own > 0).astype(found.dtype), rows, clearance, touched, looks

    def unfinished(state: tuple):
        i, found, _, clearance, _, looks = state
        roomy = (found > 0) & (clearance[found - 1] >= room)
        return (i < len(k)) & (found < n) & ~roomy & (looks < most_looks)

    zero = jnp.zeros((), jnp.int32)
    begin = zero, zero, jnp.zeros(MOST, jnp.int32), jnp.zeros(MOST, k.dtype), zero, zero
    judged, found, rows, clearance, _, looks = jax.lax.while_loop(unfinished, judge, begin)
    return Preferred(rows, clearance, judged, looks), found
