"""Many corridors, and which plans keep to which: a look at a few knots in float32, then every knot
in float64. [T27]
"""

from collections.abc import Iterable
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import in_chunks, on_all_cores, x64
from parc_jax.cover.corridor import Corridor
from parc_jax.obstacles.segment import dot2

SMALLEST = 128  # padded number of corridors; it grows by fours, for few compiled shapes
KNOTS = 16  # of the quick test: who leaves a corridor mostly does so for long
TILES = ((1024, 8), (512, 32))  # plans and corridors of a call of the quick test
NEAR_PAIRS = 8192  # (plan, corridor) pairs of such a call, where it is about chosen ones
PAIRS = 1024  # and of a call of the full test
FEW = 8  # corridors that are asked before all others


class Corridors:
    """Corridors under one tube. Plans are given by path (b, T + 1, 2) and bin (b,). Nothing that is
    asked changes what the next question answers.

    interval (n_bins, T, 2): errors of the tube. all: the corridors, in the order they were given.
    """

    def __init__(self, interval, corridors: Iterable[Corridor] = ()):
        self.interval = np.asarray(interval)
        self.all = tuple(corridors)
        self._knots = np.unique(np.linspace(0, self.interval.shape[1] - 1, KNOTS).astype(int))

    def __len__(self) -> int:
        return len(self.all)

    def with_more(self, corridors: Iterable[Corridor]) -> "Corridors":
        """These and some more, which come last."""
        return Corridors(self.interval, (*self.all, *corridors))

    def kept(self, path, bins) -> np.ndarray:
        """(b, c) bool: which plans keep to which corridors."""
        kept = self.nearly(path, bins)
        plan, corridor = np.nonzero(kept)
        kept[plan, corridor] = self.kept_pairs(path, bins, plan, corridor)
        return kept

    def first(self, path, bins, order=None, allowed=None) -> np.ndarray:
        """(b,) a corridor that each plan keeps to, -1 for none.

        order (c,): those that hold most plans first is quickest; any order finds the same plans.
        allowed (b, c) bool: only of these.
        """
        order = np.arange(len(self)) if order is None else order
        found = np.full(len(path), -1)
        for some in (order[:FEW], order[FEW:]):
            open_ = np.flatnonzero(found < 0)
            plan, corridor = self._near_pairs(path, bins, open_, some, allowed)
            self._settle(path, bins, plan, corridor, found)
        return found

    def _near_pairs(self, path, bins, plans, some, allowed) -> tuple[np.ndarray, np.ndarray]:
        """Plans and corridors of the pairs that pass the quick test, sorted by plan."""
        if allowed is None:
            row, column = np.nonzero(self.nearly(path[plans], bins[plans], some))
            return plans[row], some[column]
        row, column = np.nonzero(allowed[plans[:, None], some])
        plan, corridor = plans[row], some[column]
        near = self._nearly_pairs(path, bins, plan, corridor)
        return plan[near], corridor[near]

    def _settle(self, path, bins, plan, corridor, found) -> None:
        """Write into found (b,) the first corridor of every plan's pairs that it keeps to. Pairs
        are sorted by plan; a plan's pairs are tried in turn, as many at once as fill a call.
        """
        while len(plan):
            turn = np.arange(len(plan)) - np.searchsorted(plan, plan)
            n_plans = int((turn == 0).sum())
            now = turn < max(1, PAIRS // (1 + n_plans))
            kept = self.kept_pairs(path, bins, plan[now], corridor[now])
            winner, which = plan[now][kept], corridor[now][kept]
            found[winner[::-1]] = which[::-1]  # the first of a plan's own is written last
            left = ~now & (found[plan] < 0)
            plan, corridor = plan[left], corridor[left]

    def nearly(self, path, bins, some: np.ndarray | None = None) -> np.ndarray:
        """(b, s) bool: False where a plan leaves one of some corridors (s,) at one of a few knots,
        in float32.

        Rounding may lose a plan at the very border, which then counts as outside.
        """
        some = np.arange(len(self)) if some is None else some
        out = np.zeros((len(path), len(some)), bool)
        if not out.size:
            return out
        _, _, w, support = self._stacked
        path, interval = self._few_knots(path), self._few_knots(self.interval)
        height, width = TILES[len(some) > TILES[0][1]]

        def tile(corner):
            row = np.arange(corner[0], min(corner[0] + height, len(path)))
            column = np.arange(corner[1], min(corner[1] + width, len(some)))
            at, of = _padded(row, height), some[_padded(column, width)]
            found = np.asarray(_nearly_kept(interval, path[at], bins[at], w, support, of))
            out[row[:, None], column] = found[: len(row), : len(column)]

        columns, rows = range(0, len(some), width), range(0, len(path), height)
        on_all_cores(tile, [(row, column) for column in columns for row in rows])
        return out

    def _nearly_pairs(self, path, bins, plan, corridor) -> np.ndarray:
        """(pairs,) bool: the same for plan[i] and corridor[i]."""
        if not len(plan):
            return np.zeros(0, bool)
        _, _, w, support = self._stacked
        used, at = np.unique(plan, return_inverse=True)
        path, bins = self._few_knots(path[used]), bins[used]
        interval = self._few_knots(self.interval)

        def call(rows):
            i = at[rows]
            found = _nearly_kept_pairs(interval, path[i], bins[i], w, support, corridor[rows])
            return np.asarray(found)

        return in_chunks(len(at), NEAR_PAIRS, call)

    def kept_pairs(self, path, bins, plan: np.ndarray, corridor: np.ndarray) -> np.ndarray:
        """(pairs,) bool: does plan[i] keep to corridor[i]?"""
        if not len(plan):
            return np.zeros(0, bool)
        w, support, _, _ = self._stacked

        def call(rows):
            i = plan[rows]
            with x64():
                found = _kept_pairs(self.interval, path[i], bins[i], w, support, corridor[rows])
                return np.asarray(found)

        return in_chunks(len(plan), PAIRS, call)

    def _few_knots(self, x: np.ndarray) -> np.ndarray:
        """The columns of the quick test, in float32."""
        return x[:, self._knots].astype(np.float32)

    @cached_property
    def _stacked(self) -> tuple:
        """w and support of all corridors, and both at a few knots, padded to few sizes, as device
        arrays.
        """
        size = SMALLEST
        while size < len(self):
            size *= 4
        padded = [self.all[i % len(self)] for i in range(size)]
        w = np.stack([c.w for c in padded])
        support = np.stack([c.support for c in padded])
        few = [x[:, :, self._knots].astype(np.float32) for x in (w, support)]
        with x64():
            return jax.device_put((w, support, *few))


def _padded(rows: np.ndarray, size: int) -> np.ndarray:
    """Rows filled up to a fixed number by repeating the last one."""
    return np.pad(rows, (0, size - len(rows)), mode="edge")


def keeps(interval, path, bin, w, support):
    """Does the plan with path (T + 1, 2) and this bin keep to the corridor w (o, T, 2), support (o,
    T)? Kernel.
    """
    threshold = support + dot2(jnp.abs(w), interval[bin][None])
    return (jnp.minimum(dot2(w, path[None, :-1]), dot2(w, path[None, 1:])) > threshold).all()


def keeps_knots(interval, path, bin, w, support):
    """The same at the beginning of some intervals only: path (t, 2), and their columns of the
    others. Kernel.
    """
    return (dot2(w, path[None]) > support + dot2(jnp.abs(w), interval[bin][None])).all()


@jax.jit
def _kept_pairs(interval, path, bins, w, support, of):
    return jax.vmap(keeps, in_axes=(None, 0, 0, 0, 0))(interval, path, bins, w[of], support[of])


@jax.jit
def _nearly_kept(interval, path, bins, w, support, of):
    corridors = jax.vmap(keeps_knots, in_axes=(None, None, None, 0, 0))
    return jax.vmap(corridors, in_axes=(None, 0, 0, None, None))(
        interval, path, bins, w[of], support[of]
    )


@jax.jit
def _nearly_kept_pairs(interval, path, bins, w, support, of):
    return jax.vmap(keeps_knots, in_axes=(None, 0, 0, 0, 0))(
        interval, path, bins, w[of], support[of]
    )
