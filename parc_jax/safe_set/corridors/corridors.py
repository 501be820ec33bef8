"""Many corridors, and which plans keep to which: a look at a few knots in float32, then every knot
in float64. [T27]
"""

from collections.abc import Iterable
from functools import cached_property, partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int
from numpy.typing import DTypeLike

from parc_jax.common.arrays import in_chunks, on_all_cores, once, x64
from parc_jax.common.shapes import Index, Numbers, Paths
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.learning.bound.tube import Tube
from parc_jax.safe_set.corridors.corridor import (
    Computed,
    Conditions,
    Corridor,
    Looked,
    Stacked,
    keeps,
    nearly_kept,
    stacked,
)

AT_ONCE = {True: 512, False: 64}  # (corridor, bin) pairs per compiled call: at a few knots, at all
LEAST_ROWS = 512  # of a table; it grows by fours, for few compiled shapes
MOST_BYTES = 2**29  # of the table, before it is begun anew
SMALLEST = 128  # padded number of corridors, which grows by fours too


class Thresholds:
    """Thresholds of the (corridor, bin) pairs that were asked for, at some intervals. What is kept
    is only ever added to.
    """

    def __init__(
        self, errors: ErrorSet, knots: np.ndarray | slice = np.s_[:], dtype: DTypeLike = np.float64
    ):
        self._errors = jax.tree.map(lambda x: x[:, knots], errors)
        self._knots, self._dtype = knots, dtype
        self._few = not isinstance(knots, slice)
        self._row = np.full((0, len(jax.tree.leaves(errors)[0])), -1, np.int32)
        self._table = np.zeros(0)

    def of(self, corridors: tuple[Corridor, ...], corridor: np.ndarray, bins: np.ndarray) -> Looked:
        """Those of pairs (pairs,), numbers of corridors, which stay theirs, and bins, where kernels
        find them: of these alone, since to move all that is known costs more than to ask.
        """
        n_bins = self._row.shape[1]
        if self._table.nbytes > MOST_BYTES:
            self._row[:] = -1
            self._table = np.zeros(0)
        more = padded_size(len(corridors)) - len(self._row)
        self._row = np.pad(self._row, ((0, max(more, 0)), (0, 0)), constant_values=-1)
        asked = np.unique(corridor * n_bins + bins % n_bins)
        new = asked[self._row.ravel()[asked] < 0]
        if len(new):
            self._add(corridors, new)
        # the last row, which stands for all others, stays free
        size = padded_size(len(asked) + 1, LEAST_ROWS)
        row, table = np.full_like(self._row, -1), _nothing_exceeds(size, self._table)
        row.ravel()[asked] = np.arange(len(asked))
        table[: len(asked)] = self._table[self._row.ravel()[asked]]
        with x64():
            return jax.device_put(Looked(row, table))

    def _add(self, corridors: tuple[Corridor, ...], new: np.ndarray) -> None:
        n_bins = self._row.shape[1]
        used, of = np.unique(new // n_bins, return_inverse=True)
        roomy = stacked([corridors[c] for c in used])
        w, support = (x[..., self._knots].swapaxes(0, 1) for x in (roomy.w, roomy.support))

        def call(rows: np.ndarray):
            own = roomy._replace(w=w[of[rows]], support=support[of[rows]])
            with x64():
                found = _thresholds(self._errors, own, new[rows] % n_bins, self._few)
                return np.asarray(found, self._dtype)

        found = in_chunks(len(new), AT_ONCE[self._few], call)
        first = int(self._row.max(initial=-1)) + 1
        size = padded_size(first + len(new), LEAST_ROWS)
        if size > len(self._table):
            table = _nothing_exceeds(size, found)
            table[:first] = self._table[:first].reshape(first, *found.shape[1:])
            self._table = table
        self._table[first : first + len(new)] = found
        self._row.ravel()[new] = first + np.arange(len(new))


def _nothing_exceeds(size: int, like: np.ndarray) -> np.ndarray:
    """A table of so many infinite rows."""
    return np.full((size, *like.shape[1:]), np.inf, like.dtype)


def padded_size(n: int, least: int = SMALLEST) -> int:
    """Of n corridors, or of others of which there are few sizes too."""
    size = least
    while size < n:
        size *= 4
    return size


def _of_one(
    errors: ErrorSet,
    points: Int[ArrayLike, "o i"],
    count: Index,
    w: Float[ArrayLike, "o n_p t"],
    support: Float[ArrayLike, "o t"],
    bin: Index,
):
    """(o, i, T) thresholds of one corridor in one bin, as `Corridor.threshold`. Kernel.

    Interval by interval innermost: errors of a point in a bin stay in cache.
    """
    mine = at(errors, bin)

    def look(o: Index, found: Float[ArrayLike, "o i t"]):
        back = tuple(-x for x in w[o])
        slots = [
            support[o] + at(mine, (slice(None), point)).support_by_axis(back) for point in points[o]
        ]
        return found.at[o].set(jnp.stack(slots))

    nothing = jnp.zeros((*points.shape, support.shape[1]), support.dtype)
    return jax.lax.fori_loop(0, count, look, nothing)


@partial(jax.jit, static_argnames="few")
def _thresholds(errors: ErrorSet, some: Stacked, bins: Numbers, few: bool):
    points = jnp.asarray(some.points)
    one = lambda x: _of_one(errors, points, some.count, *x)  # noqa: E731
    pairs = some.w, some.support, bins
    return jax.vmap(one)(pairs) if few else jax.lax.map(one, pairs)


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
