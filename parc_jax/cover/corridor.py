"""A corridor: one separating direction per obstacle and interval. Whoever keeps to it touches
nothing. [T14, T27]

A direction w separates where w . p^ > h_O(w) + h_-B(w) + h_E(-w) at both knots of an interval, for
every reference point of a part of the body. That asks nothing of the region or the bin a plan is
in: the same directions serve every cell, and in each of them (the network is affine there, the set
of errors E the same) the plans that keep to a corridor form a convex polytope.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from parc_jax.claim.error_set import ErrorSet, at
from parc_jax.obstacles.directions import Multiplier


def lost(w, errors: ErrorSet, points):
    """(o, T, i) how far the errors (T, n_points) reach against directions w (o, T, n_p), for the
    points (o, i) of each obstacle. NumPy or JAX.
    """
    of_points = at(errors, np.s_[:, points])  # (T, o, i)
    return of_points.support(-w.swapaxes(0, 1)[:, :, None]).swapaxes(0, 1)


class Run(NamedTuple):
    """A direction that separates one obstacle from interval `first` up to, not including, `end`."""

    first: int
    end: int
    multiplier: Multiplier


class Corridor(NamedTuple):
    """w (o, T, n_p): directions. support (o, T): w . p^ > support + h_E(-w) must hold; float slack
    included, -inf where the obstacle is absent. multipliers (o, T): what spells w exactly. points
    (o, i): the reference points for which it must hold. p0 (n_p,), k (n_k,): a plan that keeps to
    it.
    """

    w: np.ndarray
    support: np.ndarray
    multipliers: np.ndarray
    points: np.ndarray
    p0: np.ndarray
    k: np.ndarray

    def threshold(self, errors: ErrorSet) -> np.ndarray:
        """(o, T, i): what w . p^ of each point must exceed in a bin with the errors (T,
        n_points).
        """
        return self.support[..., None] + lost(self.w, errors, self.points)

    @property
    def runs(self) -> list[list[Run]]:
        """Per obstacle, the intervals in which it exists as runs of equal directions; none for one
        that only pads.
        """
        exists = ~np.isneginf(self.support)
        return [
            merged_runs(spelled[active], np.flatnonzero(active))
            for spelled, active in zip(self.multipliers, exists, strict=True)
            if active.any()
        ]


def merged_runs(multipliers: Iterable[Multiplier], intervals: Iterable[int]) -> list[Run]:
    """Runs of one and the same multiplier over consecutive intervals."""
    runs: list[Run] = []
    for m, t in zip(multipliers, intervals, strict=True):
        if runs and runs[-1].multiplier is m:
            runs[-1] = runs[-1]._replace(end=int(t) + 1)
        else:
            runs.append(Run(int(t), int(t) + 1, m))
    return runs


def longest_lasting(holds: np.ndarray) -> np.ndarray:
    """holds (d, T) -> (T,): a direction kept until it fails, then the one that lasts longest; -1
    where none holds. So few runs as can be.
    """
    n_steps = holds.shape[1]
    length = np.zeros((len(holds), n_steps + 1), int)
    for t in range(n_steps - 1, -1, -1):
        length[:, t] = np.where(holds[:, t], 1 + length[:, t + 1], 0)
    out = np.full(n_steps, -1)
    current = -1
    for t in range(n_steps):
        if current < 0 or not holds[current, t]:
            current = int(np.argmax(length[:, t])) if holds[:, t].any() else -1
        out[t] = current
    return out
