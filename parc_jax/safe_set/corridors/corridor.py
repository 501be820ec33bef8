"""A corridor: one separating direction per obstacle and interval. Whoever keeps to it touches
nothing. [T14, T27]

A direction w separates where w . p^ > h_O(w) + h_-B(w) + h_E(-w) at both knots of an interval, for
every reference point of a part of the body. That asks nothing of the region or the bin a plan is
in: the same directions serve every cell, and in each of them (the network is affine there, the set
of errors E the same) the plans that keep to a corridor form a convex polytope.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool, Float, Int

from parc_jax.common.shapes import Index, Numbers, Path, Paths
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.safe_set.separation.directions import Run, merged_runs
from parc_jax.safe_set.separation.inequality import height, separates
from parc_jax.safe_set.separation.pruning import Apart
from parc_jax.safe_set.verdict.sized import LEAST_OBSTACLES, size_class


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


class Computed(NamedTuple):
    """What plans must exceed, worked out wherever it is asked: support (o, c, t) of corridors, and
    errors (n_bins, t, n_points).
    """

    support: jax.Array
    errors: ErrorSet

    def of(self, bin: Index, corridor: Index):
        """(t,) in one bin for one corridor: a function of obstacle, point, where it stands among
        the obstacle's own, and direction, axis by axis. Kernel.
        """
        errors = at(self.errors, bin)

        def least(o: Index, point: int, _: Index, w: Float[ArrayLike, "n_p t"]):
            lost = at(errors, (slice(None), point)).support_by_axis(tuple(-x for x in w))
            return self.support[o, corridor] + lost

        return least


class Looked(NamedTuple):
    """The same, looked up: table (rows, o, i, t), of which row (c, n_bins) is that of a corridor in
    a bin. What was not asked for is infinite, which no plan exceeds.
    """

    row: jax.Array
    table: jax.Array

    def of(self, bin: Index, corridor: Index):
        """As of `Computed`. Kernel."""
        row = self.row[corridor, bin]
        return lambda o, _, slot, __: self.table[row, o, slot]


class Conditions(NamedTuple):
    """What keeping to corridors asks at t intervals. w (o, c, n_p, t): axis by axis, so that no
    array is read with a stride. points (o, i), count: as of `Stacked`. least: what w . p^ must
    exceed.
    """

    w: jax.Array
    points: jax.Array
    count: jax.Array
    least: Computed | Looked


def keeps(conditions: Conditions, path: Path, bin: Index, corridor: Index):
    """Does a plan in this bin meet all conditions of a corridor? path: at the beginning of each
    interval, or with one knot more at both its knots. Kernel.

    Obstacle by obstacle, a few arrays (t,) stay in cache; and by every point, so that it is known
    which and read in place: to gather an obstacle's own costs more than the others do.
    """
    points, (n_p, n) = jnp.asarray(conditions.points), conditions.w.shape[2:]
    knots = [path[first : first + n] for first in range(len(path) - n + 1)]
    least = conditions.least.of(bin, corridor)

    def look(o: Index, met: Bool[ArrayLike, ""]):
        w = conditions.w[o, corridor]
        clear = jnp.ones(n, bool)
        for point in range(path.shape[1] // n_p):
            own = points[o] == point
            threshold = least(o, point, jnp.argmax(own), w)
            axes = range(point * n_p, (point + 1) * n_p)
            heights = [height(w, [places[:, axis] for axis in axes]) for places in knots]
            clear &= separates(heights, threshold) | ~own.any()
        return met & clear.all()

    return jax.lax.fori_loop(0, conditions.count, look, jnp.ones((), bool))


def nearly_kept(conditions: Conditions, path: Paths, bins: Numbers, of: Int[ArrayLike, " c"]):
    """(b, c) bool: do plans meet the conditions of corridors at the beginning of some intervals,
    which are the knots of their paths? Kernel.
    """
    w = conditions.w[:, of].transpose(0, 3, 2, 1)  # (o, t, n_p, c)
    _, n_t, n_p, _ = w.shape
    support = conditions.least.support[:, of].transpose(0, 2, 1)  # (o, t, c)
    places = path.reshape(len(path), n_t, -1, n_p).transpose(1, 2, 3, 0)  # (t, n_points, n_p, b)
    # (t, n_points, ..., b)
    errors = jax.tree.map(lambda x: jnp.moveaxis(x[bins], 0, -1), conditions.least.errors)
    points = jnp.asarray(conditions.points)

    def at_knot(i: Index, met: Bool[ArrayLike, "b c"]):
        o, t = i // n_t, i % n_t
        own = jax.tree.map(lambda x: x[t][points[o]], (places, errors))
        # read before the loop over points, which would read it anew for each plan and corridor
        read = jax.lax.optimization_barrier((w[o, t][:, :, None], support[o, t][:, None], own))
        axes, least, (place, allowed) = read
        back = tuple(-x for x in axes)
        for slot in range(points.shape[1]):
            heights = height(axes, place[slot][:, None])
            mine = jax.tree.map(lambda x: jnp.moveaxis(x[slot], -1, 0)[None], allowed)  # noqa: B023
            met &= separates([heights], least + mine.support_by_axis(back))
        return met

    everywhere = jnp.ones((len(of), len(path)), bool)
    return jax.lax.fori_loop(0, conditions.count * n_t, at_knot, everywhere).T
