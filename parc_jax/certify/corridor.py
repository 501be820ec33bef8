"""A corridor: one separating direction per obstacle and interval. Whoever keeps to it touches nothing. [T14, T16]

A direction w separates where w . p^ > h_O(w) + h_-B(w) + |w| . e at both knots of an interval. That asks nothing of the
region or the bin a plan is in: the same directions serve every cell, and in each of them (the network is affine there,
the error e constant) the plans that keep to a corridor form a convex polytope.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import on_all_cores, x64
from parc_jax.avoid.directions import Multiplier
from parc_jax.avoid.segment import dot2

SMALLEST = 128  # padded number of corridors; it grows by fours, for few compiled shapes
KNOTS = 16  # that a first look sees: who leaves a corridor mostly does so for long
TILES = ((1024, 8), (512, 32))  # plans and corridors of a first look
NEAR_PAIRS = 8192  # (plan, corridor) pairs of a first look, where it is about chosen ones
PAIRS = 1024  # and of a full look
FEW = 8  # corridors that hold most plans, asked before all others


class Run(NamedTuple):
    """A direction that separates one obstacle from interval `first` up to, not including, `end`."""

    first: int
    end: int
    multiplier: Multiplier


class Corridor(NamedTuple):
    """w (o, T, 2): directions. reach (o, T): w . p^ > reach + |w| . e must hold; float slack included, -inf where the
    obstacle is absent. multipliers (o, T): what spells w exactly. p0 (n_p,), k (n_k,): a plan that keeps to it.
    """

    w: np.ndarray
    reach: np.ndarray
    multipliers: np.ndarray
    p0: np.ndarray
    k: np.ndarray

    def need(self, error: np.ndarray) -> np.ndarray:
        """(o, T): what w . p^ must exceed in a bin with the errors (T, 2)."""
        return self.reach + dot2(np.abs(self.w), error[None])

    @property
    def runs(self) -> list[list[Run]]:
        """Per obstacle, the intervals in which it exists as runs of equal directions; none for one that only pads."""
        out = []
        exists = ~np.isneginf(self.reach)
        for spelled, active in zip(self.multipliers, exists, strict=True):
            mine: list[Run] = []
            for t in np.flatnonzero(active):
                if mine and mine[-1].multiplier is spelled[t]:
                    mine[-1] = mine[-1]._replace(end=int(t) + 1)
                else:
                    mine.append(Run(int(t), int(t) + 1, spelled[t]))
            out.append(mine)
        return [runs for runs in out if runs]


class Corridors:
    """Corridors under one tube, and who keeps to which. Plans are given by path (b, T + 1, 2) and bin number (b,).

    interval (n_bins, T, 2): errors of the tube.
    """

    def __init__(self, interval, corridors: Sequence[Corridor] = ()):
        self.interval = np.asarray(interval)
        self.all = list(corridors)
        self.hits = np.zeros(len(self.all), int)  # plans that asked and were found in each
        self._knots = np.unique(np.linspace(0, self.interval.shape[1] - 1, KNOTS).astype(int))
        self._padded: tuple = ()

    def append(self, corridor: Corridor) -> None:
        """One more."""
        self.all.append(corridor)
        self.hits = np.append(self.hits, 0)
        self._padded = ()

    def kept(self, path, number) -> np.ndarray:
        """(b, c) bool: which plans keep to which corridors."""
        kept = self.nearly(path, number)
        at, of = np.nonzero(kept)
        kept[at, of] = self.kept_pairs(path, number, at, of)
        return kept

    def first(self, path, number, allowed=None) -> np.ndarray:
        """(b,) a corridor that each plan keeps to, -1 for none; allowed (b, c) bool: only of these."""
        first, left = np.full(len(path), -1), np.arange(len(path))
        order = np.argsort(-self.hits, kind="stable")
        for some in (order[:FEW], order[FEW:]):
            if allowed is None:
                at, of = np.nonzero(self.nearly(path[left], number[left], some))
            else:
                at, of = np.nonzero(allowed[left[:, None], some])
                near = self._nearly_pairs(path, number, left[at], some[of])
                at, of = at[near], of[near]
            while len(at):
                ranks = np.arange(len(at)) - np.searchsorted(at, at)  # of a plan's own, as they are sorted by plan
                now = ranks < max(1, PAIRS // (1 + (ranks == 0).sum()))  # as many at once as fill a call
                kept = self.kept_pairs(path, number, left[at[now]], some[of[now]])
                yes, which = at[now][kept], of[now][kept]
                first[left[yes[::-1]]] = some[which[::-1]]  # the first of a plan's own is written last
                go_on = ~now & (first[left[at]] < 0)
                at, of = at[go_on], of[go_on]
            left = left[first[left] < 0]
        self.hits += np.bincount(first[first >= 0], minlength=len(self.all))
        return first

    def nearly(self, path, number, some: np.ndarray | None = None) -> np.ndarray:
        """(b, s) bool: False where a plan leaves one of some corridors (s,) at one of a few knots, in float32.

        Rounding may lose a plan at the very border, which then counts as outside.
        """
        some = np.arange(len(self.all)) if some is None else some
        out = np.zeros((len(path), len(some)), bool)
        if not out.size:
            return out
        stacked, t = self._stacked()[2:], self._knots
        path, interval = path[:, t].astype(np.float32), self.interval[:, t].astype(np.float32)
        high, wide = TILES[len(some) > TILES[0][1]]

        def call(part):
            row, first = part
            rows, of = np.arange(row, min(row + high, len(path))), some[first : first + wide]
            padded = np.resize(rows, high)
            found = _nearly_kept(interval, path[padded], number[padded], *stacked, np.resize(of, wide))
            out[rows, first : first + wide] = np.asarray(found)[: len(rows), : len(of)]

        on_all_cores(call, [(row, first) for first in range(0, len(some), wide) for row in range(0, len(path), high)])
        return out

    def _nearly_pairs(self, path, number, at, of) -> np.ndarray:
        """(pairs,) bool: the same for plan at[i] and corridor of[i]."""
        stacked, t = self._stacked()[2:], self._knots
        used, at = np.unique(at, return_inverse=True)
        path, number = path[used][:, t].astype(np.float32), number[used]
        interval = self.interval[:, t].astype(np.float32)

        def call(first):
            rows = np.arange(first, min(first + NEAR_PAIRS, len(at)))
            padded = np.resize(rows, NEAR_PAIRS)
            found = _nearly_kept_pairs(interval, path[at[padded]], number[at[padded]], *stacked, of[padded])
            return np.asarray(found)[: len(rows)]

        return np.concatenate([np.zeros(0, bool), *on_all_cores(call, range(0, len(at), NEAR_PAIRS))])

    def kept_pairs(self, path, number, at: np.ndarray, of: np.ndarray) -> np.ndarray:
        """(pairs,) bool: does plan at[i] keep to corridor of[i]?"""
        if not len(at):
            return np.zeros(0, bool)
        stacked = self._stacked()

        def call(first):
            rows = np.arange(first, min(first + PAIRS, len(at)))
            padded = np.resize(rows, PAIRS)
            with x64():
                found = _kept_pairs(self.interval, path[at[padded]], number[at[padded]], *stacked[:2], of[padded])
                return np.asarray(found)[: len(rows)]

        return np.concatenate(on_all_cores(call, range(0, len(at), PAIRS)))

    def _stacked(self) -> tuple:
        """w and reach of all corridors, and both at a few knots, padded to few sizes, as device arrays."""
        if not self._padded:
            size = SMALLEST
            while size < len(self.all):
                size *= 4
            padded = [self.all[i % len(self.all)] for i in range(size)]
            w, reach = np.stack([c.w for c in padded]), np.stack([c.reach for c in padded])
            few = [x[:, :, self._knots].astype(np.float32) for x in (w, reach)]
            with x64():
                self._padded = jax.device_put((w, reach, *few))
        return self._padded


def keeps(interval, path, number, w, reach):
    """Does the plan with path (T + 1, 2) and this bin number keep to the corridor w (o, T, 2), reach (o, T)? Kernel."""
    need = reach + dot2(jnp.abs(w), interval[number][None])
    return (jnp.minimum(dot2(w, path[None, :-1]), dot2(w, path[None, 1:])) > need).all()


def keeps_knots(interval, path, number, w, reach):
    """The same at the beginning of some intervals only: path (t, 2), and their columns of the others. Kernel."""
    return (dot2(w, path[None]) > reach + dot2(jnp.abs(w), interval[number][None])).all()


@jax.jit
def _kept_pairs(interval, path, number, w, reach, of):
    return jax.vmap(keeps, in_axes=(None, 0, 0, 0, 0))(interval, path, number, w[of], reach[of])


@jax.jit
def _nearly_kept(interval, path, number, w, reach, of):
    corridors = jax.vmap(keeps_knots, in_axes=(None, None, None, 0, 0))
    return jax.vmap(corridors, in_axes=(None, 0, 0, None, None))(interval, path, number, w[of], reach[of])


@jax.jit
def _nearly_kept_pairs(interval, path, number, w, reach, of):
    return jax.vmap(keeps_knots, in_axes=(None, 0, 0, 0, 0))(interval, path, number, w[of], reach[of])
