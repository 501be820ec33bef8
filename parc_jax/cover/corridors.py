"""Many corridors, and which plans keep to which: a look at a few knots in float32, then every knot
in float64. [T27]
"""

from collections.abc import Iterable
from functools import cached_property
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.base.arrays import in_chunks, on_all_cores, x64
from parc_jax.claim.error_set import ErrorSet, ErrorTemplate, at
from parc_jax.claim.tube import Tube
from parc_jax.cover.corridor import Corridor
from parc_jax.cover.nearly import nearly_kept
from parc_jax.cover.thresholds import Looked, Thresholds, at_few_knots, columns_of, stacked

SMALLEST = 128  # padded number of corridors; it grows by fours, for few compiled shapes
KNOTS = 16  # of the quick test: who leaves a corridor mostly does so for long
TILES = ((1024, 8), (512, 32))  # plans and corridors of a call of the quick test
NEAR_PAIRS = 8192  # (plan, corridor) pairs of such a call, where it is about chosen ones
PAIRS = 1024  # and of a call of the full test
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
        self._knots = np.unique(np.linspace(0, tube.n_steps - 1, KNOTS).astype(int))
        # of errors between fitted faces thresholds are looked up
        fitted = isinstance(tube.errors, ErrorTemplate)
        self._thresholds = Thresholds(tube.errors) if fitted else None
        self._at_few: list = []

    def __len__(self) -> int:
        return len(self.all)

    def with_more(self, corridors: Iterable[Corridor]) -> "Corridors":
        """These and some more, which come last."""
        more = Corridors(self.tube, (*self.all, *corridors))
        more._thresholds = self._thresholds
        more._at_few = self._at_few
        return more

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
        few = self._stacked.at_few
        path = self._few_knots(path)
        height, width = TILES[len(some) > TILES[0][1]]

        def tile(corner):
            row = np.arange(corner[0], min(corner[0] + height, len(path)))
            column = np.arange(corner[1], min(corner[1] + width, len(some)))
            at, of = _padded(row, height), some[_padded(column, width)]
            found = np.asarray(_nearly_kept(few, path[at], bins[at], of))
            out[row[:, None], column] = found[: len(row), : len(column)]

        columns, rows = range(0, len(some), width), range(0, len(path), height)
        on_all_cores(tile, [(row, column) for column in columns for row in rows])
        return out

    def _nearly_pairs(self, path, bins, plan, corridor) -> np.ndarray:
        """(pairs,) bool: the same for plan[i] and corridor[i]."""
        if not len(plan):
            return np.zeros(0, bool)
        few = self._stacked.at_few
        used, at = np.unique(plan, return_inverse=True)
        path, bins = self._few_knots(path[used]), bins[used]

        def call(rows):
            i = at[rows]
            return np.asarray(_nearly_kept_pairs(few, path[i], bins[i], corridor[rows]))

        return in_chunks(len(at), NEAR_PAIRS, call)

    def kept_pairs(self, path, bins, plan: np.ndarray, corridor: np.ndarray) -> np.ndarray:
        """(pairs,) bool: does plan[i] keep to corridor[i]?"""
        if not len(plan):
            return np.zeros(0, bool)
        at_all = self._stacked.at_all
        if self._thresholds is not None:
            return self._kept_by_threshold(path, bins, plan, corridor)

        def call(rows):
            i = plan[rows]
            kept = np.ones(len(i), bool)
            with x64():
                asked = jax.device_put((path[i], bins[i], corridor[rows]))
                for one in at_all:
                    kept &= np.asarray(_kept_pairs(one, *asked))
                    if not kept.any():
                        break
            return kept

        return in_chunks(len(plan), PAIRS, call)

    def _kept_by_threshold(self, path, bins, plan, corridor) -> np.ndarray:
        """The same with thresholds that are looked up."""
        row, table = self._thresholds.of(self.all, corridor, bins[plan])
        with x64():
            looked = Looked(*self._stacked.at_all, jnp.asarray(table))

        def call(rows):
            with x64():
                return np.asarray(
                    _kept_by_threshold(looked, path[plan[rows]], row[rows], corridor[rows])
                )

        return in_chunks(len(plan), PAIRS, call)

    def _few_knots(self, x: np.ndarray) -> np.ndarray:
        """The columns of the quick test, in float32."""
        return x[:, self._knots].astype(np.float32)

    @cached_property
    def _stacked(self) -> "_Stacked":
        """All corridors as device arrays, padded to few sizes, at all intervals and at a few."""
        size = SMALLEST
        while size < len(self):
            size *= 4
        roomy = stacked([self.all[i % len(self)] for i in range(size)])
        w, support, points, count = roomy
        w, support = w.transpose(1, 0, 3, 2), support.transpose(1, 0, 2)
        own = [np.ascontiguousarray(x[:count]) for x in (w, points, support)]
        some = [x[..., self._knots].astype(np.float32) for x in (w, support)]
        at_few = _Conditions(some[0], points, count, some[1], self._errors_at_few())
        if self._thresholds is not None:
            new = self.all[len(self._at_few) :]
            self._at_few += at_few_knots(self.tube.errors, list(new), self._knots)
            looked_up = np.stack([self._at_few[i % len(self)] for i in range(size)])
            at_few = Looked(*at_few.about, looked_up)
        with x64():
            if self._thresholds is not None:
                return jax.device_put(_Stacked(_Directions(w, points, count), at_few))
            errors, at_few = jax.device_put((self.tube.errors, at_few))
            at_all = jax.device_put(tuple(zip(*own, strict=True)))
            return _Stacked(tuple(_OfOne(*one, errors) for one in at_all), at_few)

    def _errors_at_few(self) -> ErrorSet:
        return jax.tree.map(self._few_knots, self.tube.errors)


class _Conditions(NamedTuple):
    """What keeping to corridors asks. w (o, c, n_p, t): axis by axis, so that no array is read with
    a stride. points (o, i), count: as of `Stacked`. support (o, c, t). errors (n_bins, t,
    n_points).
    """

    w: jax.Array
    points: jax.Array
    count: jax.Array
    support: jax.Array
    errors: ErrorSet

    @property
    def about(self) -> tuple:
        """w, points and count."""
        return self[:3]

    def met(self, bin, corridor, *paths):
        """Is every condition of a corridor met in one bin, on all of some paths (t, n_c)?

        Kernel.
        """
        points = jnp.asarray(self.points)
        errors = at(self.errors, bin)

        def look(o, met):
            return met & _clear(
                self.w[o][corridor], self.support[o][corridor], points[o], errors, paths
            )

        return jax.lax.fori_loop(0, self.count, look, jnp.ones((), bool))


class _OfOne(NamedTuple):
    """What keeping clear of one obstacle asks. w (c, n_p, t), points (i,), support (c, t), errors
    (n_bins, t, n_points).
    """

    w: jax.Array
    points: jax.Array
    support: jax.Array
    errors: ErrorSet

    def met(self, bin, corridor, *paths):
        """As of all obstacles. Kernel."""
        points, errors = jnp.asarray(self.points), at(self.errors, bin)
        return _clear(self.w[corridor], self.support[corridor], points, errors, paths)


def _clear(w, support, points, errors: ErrorSet, paths):
    """Are all conditions of one corridor about one obstacle met: w (n_p, t), support (t,), points
    (i,), errors (t, n_points), paths (t, n_c)? Kernel.

    Point by point: a few arrays (t,) stay in cache.
    """
    back = tuple(-x for x in w)
    clear = jnp.ones(support.shape, bool)
    alone = paths[0].shape[1] == len(w)
    for point in (0,) if alone else points:
        threshold = support + at(errors, (slice(None), point)).support_by_axis(back)
        for path in paths:
            columns = columns_of(path, point, len(w))
            clear &= sum(x * y for x, y in zip(w, columns, strict=True)) > threshold
    return clear.all()


class _Directions(NamedTuple):
    """What corridors ask where thresholds are looked up: w, points, count, as of `_Conditions`."""

    w: jax.Array
    points: jax.Array
    count: jax.Array


class _Stacked(NamedTuple):
    """Conditions at all intervals, in float64, obstacle by obstacle where nothing is looked up; and
    at a few, in float32.
    """

    at_all: tuple[_OfOne, ...] | _Directions
    at_few: _Conditions | Looked


def _padded(rows: np.ndarray, size: int) -> np.ndarray:
    """Rows filled up to a fixed number by repeating the last one."""
    return np.pad(rows, (0, size - len(rows)), mode="edge")


def keeps(conditions: _OfOne, path, bin, corridor):
    """Does the plan with path (T + 1, n_c) and this bin keep clear of an obstacle, as a corridor
    asks? Kernel.
    """
    return conditions.met(bin, corridor, path[:-1], path[1:])


def keeps_knots(conditions: _Conditions | Looked, path, bin, corridor):
    """The same at the beginning of some intervals only: path (t, n_c), and their conditions.
    Kernel.
    """
    if isinstance(conditions, Looked):
        return conditions.met(conditions.threshold[corridor, bin], corridor, path)
    return conditions.met(bin, corridor, path)


@jax.jit
def _kept_pairs(conditions, path, bins, of):
    return jax.vmap(keeps, in_axes=(None, 0, 0, 0))(conditions, path, bins, of)


@jax.jit
def _kept_by_threshold(conditions: Looked, path, row, of):
    def one(path, row, corridor):
        return conditions.met(conditions.threshold[row], corridor, path[:-1], path[1:])

    return jax.vmap(one)(path, row, of)


@jax.jit
def _nearly_kept(conditions, path, bins, of):
    if isinstance(conditions, _Conditions) and conditions.points.shape[1] > 1:
        return nearly_kept(conditions, path, bins, of)
    corridors = jax.vmap(keeps_knots, in_axes=(None, None, None, 0))
    return jax.vmap(corridors, in_axes=(None, 0, 0, None))(conditions, path, bins, of)


@jax.jit
def _nearly_kept_pairs(conditions, path, bins, of):
    return jax.vmap(keeps_knots, in_axes=(None, 0, 0, 0))(conditions, path, bins, of)
