"""A corridor: one separating direction per obstacle and interval. Whoever keeps to it touches
nothing. [T14, T27]

A direction w separates where w . p^ > h_O(w) + h_-B(w) + h_E(-w) at both knots of an interval, for
every reference point of a part of the body. That asks nothing of the region or the bin a plan is
in: the same directions serve every cell, and in each of them (the network is affine there, the set
of errors E the same) the plans that keep to a corridor form a convex polytope.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Float, Int

from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.safe_set.separation.apart import Apart
from parc_jax.safe_set.separation.runs import Run, merged_runs
from parc_jax.safe_set.verdict.scene import LEAST_OBSTACLES, size_class


def lost(w: Float[ArrayLike, "o t n_p"], errors: ErrorSet, points: Int[ArrayLike, "o i"]):
    """(o, T, i) how far the errors (T, n_points) reach against directions w, for the points of each
    obstacle. NumPy or JAX.
    """
    of_points = at(errors, np.s_[:, points])  # (T, o, i)
    return of_points.support(-w.swapaxes(0, 1)[:, :, None]).swapaxes(0, 1)


class Corridor(NamedTuple):
    """w (o, T, n_p): directions. support (o, T): w . p^ > support + h_E(-w) must hold; float slack
    included, -inf where the obstacle is absent. multipliers (o, T): what spells w exactly. points
    (o, i): the reference points for which it must hold. p0 (n_p,), k (n_k,): a plan that keeps to
    it. apart: what is not among the obstacles, because it is proved apart from every plan.
    """

    w: np.ndarray
    support: np.ndarray
    multipliers: np.ndarray
    points: np.ndarray
    p0: np.ndarray
    k: np.ndarray
    apart: Apart | None = None

    def threshold(self, errors: ErrorSet) -> np.ndarray:
        """(o, T, i): what w . p^ of each point must exceed in a bin with the errors (T,
        n_points).
        """
        return self.support[..., None] + lost(self.w, errors, self.points)

    @property
    def runs(self) -> list[list[Run]]:
        """Per obstacle, those that are apart included, the intervals in which it exists as runs of
        equal directions; none for one that only pads.
        """
        exists = ~np.isneginf(self.support)
        own = [
            merged_runs(spelled[active], np.flatnonzero(active))
            for spelled, active in zip(self.multipliers, exists, strict=True)
            if active.any()
        ]
        return own if self.apart is None else self.apart.with_runs(own)


class Stacked(NamedTuple):
    """Corridors with room for more, and for more obstacles, the first `count` of which are there: w
    (o, c, n_p, T), support (o, c, T), points (o, i). Nobody keeps to one that only pads.
    """

    w: np.ndarray
    support: np.ndarray
    points: np.ndarray
    count: np.ndarray


def stacked(corridors: Sequence[Corridor], room: int = 0) -> Stacked:
    """At least one, all about the same obstacles. room: for so many corridors."""
    n, n_t, n_p = corridors[0].w.shape
    size, room = size_class(n, LEAST_OBSTACLES), max(room, len(corridors))
    w = np.zeros((size, room, n_p, n_t))
    support = np.full((size, room, n_t), np.inf)
    for i, one in enumerate(corridors):
        w[:n, i], support[:n, i] = one.w.swapaxes(1, 2), one.support
    points = np.pad(corridors[0].points, ((0, size - n), (0, 0)))
    return Stacked(w, support, points, np.int32(n))
