"""The one search for safe plans: plans are proposed, a coarse test leaves some of them, the verdict
decides. Kernels. [T11, T15]

Three callers: uniform draws and a list in its order (`corridors/first.py`), of which the first safe
ones are taken; the scenes of a batch (`batch/proposals.py`), of which the clearest are. Each plan
is judged as every single one is, in float64 with the rounding tolerance of its scene; what the
coarse test gets wrong costs a plan or time. Thousands of draws at once go the same way on the host,
where what a stage leaves is put together for the next (`screen`).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common import struct
from parc_jax.common.shapes import Index, ManyParams, Numbers, Positions
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.verdict.pointwise import Verdicts, verdict, verdict_in_turn
from parc_jax.safe_set.verdict.scene import SceneArrays

NO_LIMIT = 2**31 - 1  # of separation tests


class Proposals(NamedTuple):
    """Plans p0 (r, n_p), k (r, n_k). bins (r, c): those that contain k, of which the first n_bins
    count; a plan must be safe for the errors of all. worth (r,) bool: others failed a coarse test.
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
    least over every run in the tube. judged: proposals up to the last needed, reaching: of these,
    looks: tests of a plan against a pair. touched: a pair that the last plan touches, -1 for none.
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


def no_plans(scene: SceneArrays, slots: int) -> FirstSafe:
    """No plan yet, and capacity for some. Kernel."""
    zero = jnp.zeros((), jnp.int32)
    n = scene.z_lo.shape[0] + scene.k_lo.shape[0]
    plans = jnp.zeros((slots, n), scene.k_lo.dtype)
    rows = jnp.zeros(slots, jnp.int32)
    return FirstSafe(rows, plans, plans[:, 0], zero, zero, zero, zero, zero - 1)


@struct.dataclass
class Best:
    """The best safe plans so far, best first: (n, n_p + n_k), clearance (n,) [m], -inf for none."""

    plans: jax.Array
    clearance: jax.Array


def rounds(
    propose: Callable[[Index], Proposals],
    judge: Callable[[Proposals, Any], Any],
    enough: Callable[[Any], jax.Array],
    kept: Any,
    span: tuple[Index | int, Index | int],
) -> tuple[jax.Array, Any]:
    """The next round's number, and plans kept after a span (first, end) or enough. Kernel."""
    first, last = span

    def unfinished(state: tuple):
        i, kept = state
        return (i < last) & ~enough(kept)

    def one(state: tuple):
        i, kept = state
        return i + 1, judge(propose(i), kept)

    return jax.lax.while_loop(unfinished, one, (jnp.asarray(first, jnp.int32), kept))


class Judge(NamedTuple):
    """The verdict on proposals: the network, tube and scene that it is about. Kernels."""

    net: ReLUNetwork
    tube: Tube
    scene: SceneArrays

    def _verdicts(self, p0: Positions, k: ManyParams, bins: Numbers) -> Verdicts:
        return jax.vmap(verdict, (None, None, None, 0, 0, 0))(*self, p0, k, bins)

    def clearest(self, proposals: Proposals, best: Best) -> Best:
        """The best plans so far and of a round, all of which is judged, in the first bin."""
        p0, k, bins, *_ = proposals
        seen = self._verdicts(p0, k, bins[:, 0])
        clearance = jnp.where(seen.safe, seen.clearance, -jnp.inf)
        plans = jnp.concatenate([best.plans, jnp.concatenate([p0, k], axis=1)])
        clearance = jnp.concatenate([best.clearance, clearance])
        clearance, kept = jax.lax.top_k(clearance, len(best.clearance))
        return Best(plans[kept], clearance)

    def in_turn(self, proposals: Proposals, safe: FirstSafe, limits: Limits) -> FirstSafe:
        """With the safe ones of the proposals, each judged by itself until a limit ends it."""
        p0, k, bins, n_bins, worth = proposals

        def judge(state: tuple):
            left, safe, _ = state
            i = jnp.argmax(left).astype(jnp.int32)
            plan = p0[i], k[i], bins[i], n_bins
            seen, touched, looks = verdict_in_turn(*self, *plan, safe.touched)
            clearance = jnp.where(seen.reaches, seen.clearance, -jnp.inf)
            at = safe.count  # written whether safe or not; the next one overwrites it where not
            safe = safe._replace(
                rows=safe.rows.at[at].set(i),
                plans=safe.plans.at[at].set(jnp.concatenate([p0[i], k[i]])),
                clearance=safe.clearance.at[at].set(clearance),
                count=at + (clearance > 0).astype(at.dtype),
                looks=safe.looks + looks,
                touched=touched,
            )
            return left.at[i].set(False), safe, i

        def unfinished(state: tuple):
            left, safe, _ = state
            # among no obstacles every clearance is infinite: as room that asks for nothing
            wide = (limits.room < jnp.inf) & (safe.clearance[safe.count - 1] >= limits.room)
            roomy = (safe.count > 0) & wide
            return left.any() & (safe.count < limits.n) & ~roomy & (safe.looks < limits.tests)

        begin = worth, safe, jnp.zeros((), jnp.int32)
        left, safe, last = jax.lax.while_loop(unfinished, judge, begin)
        whole = (safe.count < limits.n) & ~left.any()
        return _counted(safe, worth, jnp.where(whole, len(k), last + 1))

    def side_by_side(self, proposals: Proposals, safe: FirstSafe, limits: Limits) -> FirstSafe:
        """The same up to n safe plans, all of a round judged at once, in their first bin."""
        p0, k, bins, _, worth = proposals
        seen = self._verdicts(p0, k, bins[:, 0])
        good = seen.safe & worth
        place = safe.count + jnp.cumsum(good, dtype=jnp.int32) - 1
        # beyond the slots they are dropped
        to = jnp.where(good & (place < limits.n), place, len(safe.rows))
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
