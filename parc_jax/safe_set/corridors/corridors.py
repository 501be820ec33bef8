"""Many corridors, and which plans keep to which: a look at a few knots in float32, then every knot
in float64. [T27]
"""

from collections.abc import Iterable
from functools import cached_property

import jax
import numpy as np
from jaxtyping import ArrayLike, Int

from parc_jax.common.arrays import in_chunks, on_all_cores, once, x64
from parc_jax.common.shapes import Numbers, Paths
from parc_jax.learning.bound.error_set import ErrorSet
from parc_jax.learning.bound.tube import Tube
from parc_jax.safe_set.corridors.corridor import Corridor, stacked
from parc_jax.safe_set.corridors.keeping import Computed, Conditions, keeps
from parc_jax.safe_set.corridors.nearly import nearly_kept
from parc_jax.safe_set.corridors.thresholds import Thresholds, padded_size

KNOTS = 16  # of the quick test: who leaves a corridor mostly does so for long
TILES = ((1024, 8), (512, 32))  # plans and corridors of a call of the quick test
NEAR_PAIRS = 8192  # (plan, corridor) pairs of such a call, where it is about chosen ones
PAIRS = 512  # and of a call of the full test
FEW = 8  # corridors that are asked before all others


class Corridors:
    """Corridors under one tube. Plans are given by path (b, T + 1, n_c) and bin (b,). Nothing that
    is asked changes what the next question answers.

    tube: whose errors the plans have to allow for. all: the corridors, in the order they were
        given.
    """

    def __init__(self, tube: Tube, corridors: Iterable[Corridor] = ()):
        self.tube = tube
        self.all = tuple(corridors)
        self._knots = _knots_of(tube)
        # of errors between fitted faces thresholds are looked up: at all intervals, and at a few
        self._tables: tuple[Thresholds, ...] = ()
        if tube.templates is not None:
            few = Thresholds(tube.errors, self._knots, np.float32)
            self._tables = Thresholds(tube.errors), few

    def __len__(self) -> int:
        return len(self.all)

    def with_more(self, corridors: Iterable[Corridor]) -> "Corridors":
        """These and some more, which come last."""
        more = Corridors(self.tube, (*self.all, *corridors))
        more._tables = self._tables
        return more

    def kept(self, path: Paths, bins: Numbers) -> np.ndarray:
        """(b, c) bool: which plans keep to which corridors."""
        kept = self.nearly(path, bins)
        plan, corridor = np.nonzero(kept)
        kept[plan, corridor] = self.kept_pairs(path, bins, plan, corridor)
        return kept

    def first(
        self,
        path: Paths,
        bins: Numbers,
        order: np.ndarray | None = None,
        allowed: np.ndarray | None = None,
    ) -> np.ndarray:
        """(b,) a corridor that each plan keeps to, -1 for none.

        order (c,): those that hold most plans first is quickest; any order finds the same plans.
        allowed (b, c) bool: only of these.
        """
        order = np.arange(len(self)) if order is None else order
        found, few = np.full(len(path), -1), self._few_knots(path)
        for some in (order[:FEW], order[FEW:]):
            open_ = np.flatnonzero(found < 0)
            plan, corridor = self._near_pairs(few, bins, open_, some, allowed)
            self._settle(path, bins, plan, corridor, found)
        return found

    def _near_pairs(
        self,
        few: Paths,
        bins: Numbers,
        plans: np.ndarray,
        some: np.ndarray,
        allowed: np.ndarray | None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Plans and corridors of the pairs that pass the quick test, sorted by plan."""
        if allowed is None:
            row, column = np.nonzero(self._nearly(few[plans], bins[plans], some))
            return plans[row], some[column]
        row, column = np.nonzero(allowed[plans[:, None], some])
        plan, corridor = plans[row], some[column]
        near = self._nearly_pairs(few, bins, plan, corridor)
        return plan[near], corridor[near]

    def _settle(
        self, path: Paths, bins: Numbers, plan: np.ndarray, corridor: np.ndarray, found: Numbers
    ) -> None:
        """Write into found the first corridor of every plan's pairs that it keeps to. Pairs
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

    def nearly(self, path: Paths, bins: Numbers, some: np.ndarray | None = None) -> np.ndarray:
        """(b, s) bool: False where a plan leaves one of some corridors (s,) at one of a few knots,
        in float32.

        Rounding may lose a plan at the very border, which then counts as outside.
        """
        some = np.arange(len(self)) if some is None else some
        return self._nearly(self._few_knots(path), bins, some)

    def _nearly(self, path: Paths, bins: Numbers, some: np.ndarray) -> np.ndarray:
        """The same; path: at the few knots."""
        out = np.zeros((len(path), len(some)), bool)
        if not out.size:
            return out
        few = self._at_few
        height, width = TILES[len(some) > TILES[0][1]]

        def tile(corner: tuple[int, int]):
            row = np.arange(corner[0], min(corner[0] + height, len(path)))
            column = np.arange(corner[1], min(corner[1] + width, len(some)))
            at, of = _padded(row, height), some[_padded(column, width)]
            found = np.asarray(_tile(few, path[at], bins[at], of))
            out[row[:, None], column] = found[: len(row), : len(column)]

        columns, rows = range(0, len(some), width), range(0, len(path), height)
        on_all_cores(tile, [(row, column) for column in columns for row in rows])
        return out

    def _nearly_pairs(
        self, path: Paths, bins: Numbers, plan: np.ndarray, corridor: np.ndarray
    ) -> np.ndarray:
        """(pairs,) bool: the same for plan[i] and corridor[i]; path: at the few knots."""
        if not len(plan):
            return np.zeros(0, bool)
        few = self._at_few

        def call(rows: np.ndarray):
            i = plan[rows]
            return np.asarray(_pairs(few, path[i], bins[i], corridor[rows]))

        return in_chunks(len(plan), NEAR_PAIRS, call)

    def kept_pairs(
        self, path: Paths, bins: Numbers, plan: np.ndarray, corridor: np.ndarray
    ) -> np.ndarray:
        """(pairs,) bool: does plan[i] keep to corridor[i]?"""
        if not len(plan):
            return np.zeros(0, bool)
        asked, _ = self._stacked
        if self._tables:
            asked = asked._replace(least=self._tables[0].of(self.all, corridor, bins[plan]))

        def call(rows: np.ndarray):
            i = plan[rows]
            with x64():
                return np.asarray(_pairs(asked, path[i], bins[i], corridor[rows]))

        return in_chunks(len(plan), PAIRS, call)

    def _few_knots(self, x: np.ndarray) -> np.ndarray:
        """The columns of the quick test, in float32."""
        return x[:, self._knots].astype(np.float32)

    @cached_property
    def _at_few(self) -> Conditions:
        """At a few intervals, of which a look up knows all bins."""
        _, few = self._stacked
        if not self._tables:
            return few
        n_bins = self.tube.n_bins
        every = divmod(np.arange(len(self) * n_bins), n_bins)
        return few._replace(least=self._tables[1].of(self.all, *every))

    @cached_property
    def _stacked(self) -> tuple[Conditions, Conditions]:
        """All corridors as device arrays, padded to few sizes, at all intervals in float64, and at
        a few in float32.
        """
        w, support, points, count = stacked(self.all, padded_size(len(self)))
        with x64():
            at_all = Conditions(*jax.device_put((w, points, count)), None)
            at_few = at_all._replace(w=jax.device_put(self._few(w)))
            if self._tables:
                return at_all, at_few
            errors = once(self.tube, _errors_of)
            beyond = jax.device_put((support, self._few(support)))
        every, few = (Computed(*x) for x in zip(beyond, errors, strict=True))
        return at_all._replace(least=every), at_few._replace(least=few)

    def _few(self, x: np.ndarray) -> np.ndarray:
        """Of (..., T), as `_few_knots`."""
        return np.ascontiguousarray(x[..., self._knots], np.float32)


def _knots_of(tube: Tube) -> np.ndarray:
    """Of the quick test."""
    return np.unique(np.linspace(0, tube.n_steps - 1, KNOTS).astype(int))


def _errors_of(tube: Tube) -> tuple[ErrorSet, ErrorSet]:
    """At all intervals, and at a few in float32, where kernels find them."""
    few = jax.tree.map(lambda x: np.asarray(x[:, _knots_of(tube)], np.float32), tube.errors)
    with x64():
        return jax.device_put((tube.errors, few))


def _padded(rows: np.ndarray, size: int) -> np.ndarray:
    """Rows filled up to a fixed number by repeating the last one."""
    return np.pad(rows, (0, size - len(rows)), mode="edge")


_pairs = jax.jit(jax.vmap(keeps, in_axes=(None, 0, 0, 0)))


@jax.jit
def _tile(conditions: Conditions, path: Paths, bins: Numbers, of: Int[ArrayLike, " c"]):
    """(b, c) bool: all plans against some corridors."""
    if isinstance(conditions.least, Computed) and conditions.points.shape[1] > 1:
        return nearly_kept(conditions, path, bins, of)
    corridors = jax.vmap(keeps, in_axes=(None, None, None, 0))
    return jax.vmap(corridors, in_axes=(None, 0, 0, None))(conditions, path, bins, of)
