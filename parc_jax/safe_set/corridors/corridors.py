"""Many corridors, and which plans satisfy which: a coarse test in float32, then every knot in
float64. [T27]

Where errors lie between fitted faces the thresholds of a corridor take many products per bin,
interval and point, of a box one per axis. They are computed once per corridor and bin: plans are
many, the corridors and bins that meet are few. [T26]
"""

from collections.abc import Iterable
from functools import cached_property, partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int
from numpy.typing import DTypeLike

from parc_jax.common.arrays import in_chunks, on_all_cores, once, x64
from parc_jax.common.backend import compiled
from parc_jax.common.shapes import Index, Items, Numbers, Paths
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.learning.bound.reach import in_room
from parc_jax.learning.bound.tube import Tube
from parc_jax.safe_set.corridors.corridor import (
    Computed,
    Conditions,
    Corridor,
    Looked,
    Stacked,
    satisfies,
    stacked,
)

# (corridor, bin) pairs per compiled call of thresholds: on the coarse grid, at all intervals
AT_ONCE = {True: 512, False: 64}
LEAST_ROWS = 512  # of a table of thresholds; it grows by fours, for few compiled shapes
MOST_BYTES = 2**29  # of that table, before it is begun anew
SMALLEST = 128  # padded number of corridors, which grows by fours too
BLOCK = 512  # corridors whose thresholds of all bins are one table, which stays once it is full
KNOTS = 16  # of the coarse grid, every second at most: who leaves a corridor mostly does for long
TILES = ((1024, 8), (512, 32))  # plans and corridors of a call of the coarse test
PAIRS = 512  # (plan, corridor) pairs of a call of the full test
FEW = 8  # corridors that are tried before all others


class Thresholds:
    """Thresholds of (corridor, bin) pairs at some intervals, computed when first needed and cached.

    errors: of a tube, (n_bins, T, n_points). knots: numbers of the intervals, None for all.
    """

    def __init__(
        self, errors: ErrorSet, knots: np.ndarray | None = None, dtype: DTypeLike = np.float64
    ):
        self._coarse = knots is not None
        self._knots = knots if self._coarse else np.s_[:]
        self._errors = jax.tree.map(lambda x: x[:, self._knots], errors)
        self._dtype = dtype
        self._row = np.full((0, len(jax.tree.leaves(errors)[0])), -1, np.int32)
        self._table = np.zeros(0)
        self._blocks: dict[int, tuple[int, Looked]] = {}

    def lookup(self, corridors: tuple[Corridor, ...], corridor: Items, bins: Items) -> Looked:
        """Thresholds of (corridor, bin) pairs, on the device.

        corridors: all corridors; a number stays that of its corridor.
        corridor, bins: (pairs,) int.
        Returns a table of these pairs alone: to move all of the cache costs more than to select.
            Other pairs are infinite, and no plan exceeds that.
        """
        n_bins = self._row.shape[1]
        if self._table.nbytes > MOST_BYTES:
            self._row[:] = -1
            self._table = np.zeros(0)
        more = padded_size(len(corridors)) - len(self._row)
        self._row = np.pad(self._row, ((0, max(more, 0)), (0, 0)), constant_values=-1)
        needed = np.unique(corridor * n_bins + bins % n_bins)
        new = needed[self._row.ravel()[needed] < 0]
        if len(new):
            self._add(corridors, new)
        # row -1 is every pair that is not needed: the last one stays free, and infinite
        size = padded_size(len(needed) + 1, LEAST_ROWS)
        row, table = np.full_like(self._row, -1), _nothing_exceeds(size, self._table)
        row.ravel()[needed] = np.arange(len(needed))
        table[: len(needed)] = self._table[self._row.ravel()[needed]]
        with x64():
            return jax.device_put(Looked(row, table))

    def block(self, corridors: tuple[Corridor, ...], number: int) -> Looked:
        """Thresholds of the corridors from BLOCK * number on, in all bins, as of `lookup`."""
        of = np.arange(BLOCK * number, min(BLOCK * (number + 1), len(corridors)))
        known, looked = self._blocks.get(number, (0, None))
        if looked is None or known < len(of):
            n_bins = self._row.shape[1]
            every = np.repeat(of, n_bins), np.tile(np.arange(n_bins), len(of))
            looked = self.lookup(corridors, *every)
            self._blocks[number] = len(of), looked
        return looked

    def _add(self, corridors: tuple[Corridor, ...], new: np.ndarray) -> None:
        """Compute pairs that are not in the cache, numbered corridor * n_bins + bin."""
        n_bins = self._row.shape[1]
        used, of = np.unique(new // n_bins, return_inverse=True)
        padded = stacked([corridors[c] for c in used])
        w, support = (x[..., self._knots].swapaxes(0, 1) for x in (padded.w, padded.support))

        def call(rows: np.ndarray):
            some = padded._replace(w=w[of[rows]], support=support[of[rows]])
            with x64():
                result = _thresholds(self._errors, some, new[rows] % n_bins, self._coarse)
                return np.asarray(result, self._dtype)

        # padding has none: of two obstacles it would be three quarters of what is moved
        result = in_chunks(len(new), AT_ONCE[self._coarse], call)[:, : max(1, padded.count)]
        first = int(self._row.max(initial=-1)) + 1
        size = padded_size(first + len(new), LEAST_ROWS)
        if size > len(self._table):
            table = _nothing_exceeds(size, result)
            table[:first] = self._table[:first].reshape(first, *result.shape[1:])
            self._table = table
        self._table[first : first + len(new)] = result
        self._row.ravel()[new] = first + np.arange(len(new))


def _nothing_exceeds(size: int, like: np.ndarray) -> np.ndarray:
    """A table of so many infinite rows."""
    return np.full((size, *like.shape[1:]), np.inf, like.dtype)


def padded_size(n: int, least: int = SMALLEST) -> int:
    """Padded size for n corridors or rows: few compiled shapes."""
    size = least
    while size < n:
        size *= 4
    return size


@partial(jax.jit, static_argnames="coarse")
def _thresholds(errors: ErrorSet, some: Stacked, bins: Numbers, coarse: bool):
    """(b, o, i, T) thresholds of corridors, each in a bin, as `Corridor.threshold`. Kernel.

    Intervals innermost: the errors of a point in a bin stay in cache.
    """
    points = jnp.asarray(some.points)

    def one(pair: tuple):
        w, support, bin = pair
        in_bin = at(errors, bin)

        def add(o: Index, thresholds: Float[ArrayLike, "o i t"]):
            back = tuple(-x for x in w[o])
            of_points = [at(in_bin, (slice(None), point)) for point in points[o]]
            slots = [support[o] + own.support_by_axis(back) for own in of_points]
            return thresholds.at[o].set(jnp.stack(slots))

        nothing = jnp.zeros((*points.shape, support.shape[1]), support.dtype)
        return jax.lax.fori_loop(0, some.count, add, nothing)

    pairs = some.w, some.support, bins
    return jax.vmap(one)(pairs) if coarse else jax.lax.map(one, pairs)


class Corridors:
    """Corridors under one tube. Plans are given by path (b, T + 1, n_c) and bin (b,). No query
    changes the result of the next one.

    tube: of the errors that plans must allow for. all: the corridors, in the order given.
    """

    def __init__(self, tube: Tube, corridors: Iterable[Corridor] = ()):
        self.tube = tube
        self.all = tuple(corridors)
        self._knots = _knots_of(tube)
        # of fitted errors, at all intervals and on the coarse grid; of boxes they are computed
        self._tables: tuple[Thresholds, ...] = ()
        if tube.templates is not None:
            coarse = Thresholds(tube.errors, self._knots, np.float32)
            self._tables = Thresholds(tube.errors), coarse

    def __len__(self) -> int:
        return len(self.all)

    def with_more(self, corridors: Iterable[Corridor]) -> "Corridors":
        """These and some more, which come last."""
        more = Corridors(self.tube, (*self.all, *corridors))
        more._tables = self._tables  # numbers of corridors stay, so do their thresholds
        return more

    def kept(self, path: Paths, bins: Numbers) -> np.ndarray:
        """(b, c) bool: which plans satisfy which corridors."""
        kept = self.coarse(path, bins)
        plan, corridor = np.nonzero(kept)
        kept[plan, corridor] = self.kept_pairs(path, bins, plan, corridor)
        return kept

    def first(self, path: Paths, bins: Numbers, order: np.ndarray | None = None) -> np.ndarray:
        """(b,) number of a corridor that each plan satisfies, -1 for none.

        order: (c,) in which they are tried; most plans first is fastest, any holds the same plans.
        """
        order = np.arange(len(self)) if order is None else order
        result = np.full(len(path), -1)
        # most plans satisfy one of the popular corridors and never meet the others
        for some in (order[:FEW], order[FEW:]):
            rows = np.flatnonzero(result < 0)
            plan, corridor = np.nonzero(self.coarse(path, bins, rows, some))
            self._settle(path, bins, rows[plan], some[corridor], result)
        return result

    def _settle(
        self, path: Paths, bins: Numbers, plan: np.ndarray, corridor: np.ndarray, result: Numbers
    ) -> None:
        """Write into `result` the first corridor of every plan's pairs that it satisfies.

        plan, corridor: (pairs,) int, sorted by plan. A plan's pairs are tried in turn, as many at
        once as fill a call.
        """
        turn = np.arange(len(plan)) - np.searchsorted(plan, plan)  # of a pair among its plan's
        while len(plan):
            n_plans = int((turn == 0).sum())
            # the fewer plans are left, the more of their pairs fit into one call
            n_turns = max(1, PAIRS // (1 + n_plans))
            now = turn < n_turns
            kept = self.kept_pairs(path, bins, plan[now], corridor[now])
            winner, which = plan[now][kept], corridor[now][kept]
            result[winner[::-1]] = which[::-1]  # the first one of each plan is written last
            left = ~now & (result[plan] < 0)
            plan, corridor, turn = plan[left], corridor[left], turn[left] - n_turns

    def coarse(
        self,
        path: Paths,
        bins: Numbers,
        rows: np.ndarray | None = None,
        some: np.ndarray | None = None,
    ) -> np.ndarray:
        """(r, s) bool: False where a plan leaves a corridor at a coarse-grid knot, in float32.

        It saves a quarter of a cover of rectangles, and nothing of one of discs. Rounding may lose
        a plan at the very border, which then counts as outside.
        rows: (r,) numbers of plans, some: (s,) of corridors; None for all.
        """
        rows = np.arange(len(path)) if rows is None else rows
        some = np.arange(len(self)) if some is None else some
        out = np.zeros((len(rows), len(some)), bool)
        if not out.size:
            return out
        path = path[rows[:, None], self._knots].astype(np.float32)
        bins = bins[rows]
        height, width = TILES[len(some) > TILES[0][1]]

        def tile(part: tuple[Conditions, np.ndarray, int]):
            conditions, column, first = part
            row = np.arange(first, min(first + height, len(path)))
            at, of = _padded(row, height), some[_padded(column, width)]
            result = np.asarray(_tile(conditions, path[at], bins[at], of))
            out[row[:, None], column] = result[: len(row), : len(column)]

        parts = [
            (conditions, columns[at : at + width], first)
            for conditions, columns in self._at_few(some)
            for at in range(0, len(columns), width)
            for first in range(0, len(path), height)
        ]
        on_all_cores(tile, parts)
        return out

    def kept_pairs(self, path: Paths, bins: Numbers, plan: Items, corridor: Items) -> np.ndarray:
        """(pairs,) bool: does plan[i] satisfy corridor[i] at every knot, in float64?"""
        if not len(plan):
            return np.zeros(0, bool)
        conditions, _ = self._stacked
        if self._tables:
            least = self._tables[0].lookup(self.all, corridor, bins[plan])
            conditions = conditions._replace(least=least)

        def call(rows: np.ndarray):
            i = plan[rows]
            with x64():
                return np.asarray(_pairs(conditions, path[i], bins[i], corridor[rows]))

        return in_chunks(len(plan), PAIRS, call)

    def _at_few(self, some: np.ndarray) -> list[tuple[Conditions, np.ndarray]]:
        """Of the coarse grid, for which of some corridors; looked up thresholds by block."""
        _, few = self._stacked
        if not self._tables:
            return [(few, np.arange(len(some)))]
        table, block = self._tables[1], some // BLOCK
        return [
            (few._replace(least=table.block(self.all, b)), np.flatnonzero(block == b))
            for b in np.unique(block).tolist()
        ]

    @cached_property
    def _stacked(self) -> tuple[Conditions, Conditions]:
        """All corridors on the device, padded to few sizes; on a coarse grid also in float32."""
        w, support, points, count = stacked(self.all, padded_size(len(self)))
        few = lambda x: np.ascontiguousarray(x[..., self._knots], np.float32)  # noqa: E731
        with x64():
            at_all = Conditions(*jax.device_put((w, points, count)), None)
            at_few = at_all._replace(w=jax.device_put(few(w)))
            if self._tables:
                return at_all, at_few
            errors = once(self.tube, _errors_of)
            supports = jax.device_put((support, few(support)))
        at_all, at_few = (
            conditions._replace(least=Computed(*least))
            for conditions, *least in zip((at_all, at_few), supports, errors, strict=True)
        )
        return at_all, at_few


def _knots_of(tube: Tube) -> np.ndarray:
    """Numbers of the intervals of the coarse grid."""
    few = min(KNOTS, (tube.n_steps + 1) // 2)
    return np.unique(np.linspace(0, tube.n_steps - 1, few).astype(int))


def _errors_of(tube: Tube) -> tuple[ErrorSet, ErrorSet]:
    """At all intervals, and on the coarse grid in float32, on the device."""
    every = in_room(tube)
    few = jax.tree.map(lambda x: np.asarray(x[:, _knots_of(tube)], np.float32), every)
    with x64():
        return jax.device_put((every, few))


def _padded(rows: np.ndarray, size: int) -> np.ndarray:
    """Rows filled up to a fixed number by repeating the last one."""
    return np.pad(rows, (0, size - len(rows)), mode="edge")


_pairs = compiled(jax.vmap(satisfies, in_axes=(None, 0, 0, 0)))


@compiled
def _tile(conditions: Conditions, path: Paths, bins: Numbers, of: Int[ArrayLike, " c"]):
    """(b, c) bool: all plans against some corridors."""
    corridors = jax.vmap(satisfies, in_axes=(None, None, None, 0))
    return jax.vmap(corridors, in_axes=(None, 0, 0, None))(conditions, path, bins, of)
