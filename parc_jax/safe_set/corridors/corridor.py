"""A corridor: one separating direction per obstacle and interval, and the kernels that test plans
against it. A plan that satisfies it touches nothing. [T14, T27]

A direction w separates where w . p^ > h_O(w) + h_-B(w) + h_E(-w) at both knots of an interval, for
every reference point of a part of the body. No region and no bin enters: the same directions serve
every cell, and in each of them (the network is affine there, the set of errors E the same) the
plans that satisfy a corridor form a convex polytope.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool, Float, Int

from parc_jax.common.shapes import Index, Path
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.safe_set.separation.directions import Run, merged_runs
from parc_jax.safe_set.separation.inequality import height, separates
from parc_jax.safe_set.separation.pruning import Apart
from parc_jax.safe_set.verdict.scene import LEAST_OBSTACLES, size_class


def lost(w: Float[ArrayLike, "o t n_p"], errors: ErrorSet, points: Int[ArrayLike, "o i"]):
    """(o, T, i) support of errors (T, n_points) against w, at obstacles' points. NumPy or JAX."""
    of_points = at(errors, np.s_[:, points])  # (T, o, i)
    return of_points.support(-w.swapaxes(0, 1)[:, :, None]).swapaxes(0, 1)


class Corridor(NamedTuple):
    """Directions that hold a plan clear of every obstacle.

    w: (o, T, n_p) directions.
    support: (o, T) [m * |w|], w . p^ > support + h_E(-w) must hold; rounding tolerance included,
        -inf where the obstacle is absent.
    multipliers: (o, T), exact w.
    points: (o, i) reference points for which it must hold.
    p0, k: (n_p,), (n_k,) a plan that satisfies it.
    apart: the pruned pairs, which every plan clears; None where none was pruned.
    """

    w: np.ndarray
    support: np.ndarray
    multipliers: np.ndarray
    points: np.ndarray
    p0: np.ndarray
    k: np.ndarray
    apart: Apart | None = None

    def threshold(self, errors: ErrorSet) -> np.ndarray:
        """(o, T, i) [m * |w|] that w . p^ of each point must exceed, with errors (T, n_points)."""
        return self.support[..., None] + lost(self.w, errors, self.points)

    @property
    def own_runs(self) -> list[list[Run]]:
        """The intervals of each pair as runs of equal directions; padding has none."""
        exists = ~np.isneginf(self.support)
        pairs = zip(self.multipliers, exists, strict=True)
        return [merged_runs(m[on], np.flatnonzero(on)) for m, on in pairs if on.any()]

    @property
    def runs(self) -> list[list[Run]]:
        """`own_runs`, and those of the pruned pairs."""
        return self.own_runs if self.apart is None else self.apart.with_runs(self.own_runs)


class Stacked(NamedTuple):
    """Corridors padded to a capacity of corridors and of pairs, the first `count` of which exist.

    w (o, c, n_p, T), support (o, c, T), points (o, i). No plan satisfies padding.
    """

    w: np.ndarray
    support: np.ndarray
    points: np.ndarray
    count: np.ndarray


def stacked(corridors: Sequence[Corridor], capacity: int = 0) -> Stacked:
    """Stack corridors about the same obstacles, one at least. capacity: of corridors."""
    n, n_t, n_p = corridors[0].w.shape
    size, capacity = size_class(n, LEAST_OBSTACLES), max(capacity, len(corridors))
    w = np.zeros((size, capacity, n_p, n_t))
    support = np.full((size, capacity, n_t), np.inf)
    for i, one in enumerate(corridors):
        w[:n, i], support[:n, i] = one.w.swapaxes(1, 2), one.support
    points = np.pad(corridors[0].points, ((0, size - n), (0, 0)))
    return Stacked(w, support, points, np.int32(n))


class Computed(NamedTuple):
    """Thresholds computed in the kernel: support (o, c, t), errors (n_bins, t, n_points)."""

    support: jax.Array
    errors: ErrorSet

    def of(self, bin: Index, corridor: Index):
        """(t,) thresholds in one bin of one corridor: a function of obstacle, point, place of the
        point among the obstacle's points, and direction, axis by axis. Kernel.
        """
        errors = at(self.errors, bin)

        def least(o: Index, point: int, _: Index, w: Float[ArrayLike, "n_p t"]):
            lost = at(errors, (slice(None), point)).support_by_axis(tuple(-x for x in w))
            return self.support[o, corridor] + lost

        return least


class Looked(NamedTuple):
    """Thresholds from a table (rows, o, i, t), of which row (c, n_bins) is that of a corridor in a
    bin. Pairs that are not in it are infinite, and no plan exceeds that.
    """

    row: jax.Array
    table: jax.Array

    def of(self, bin: Index, corridor: Index):
        """As of `Computed`. Kernel."""
        row = self.row[corridor, bin]
        return lambda o, _, slot, __: self.table[row, o, slot]


class Conditions(NamedTuple):
    """Conditions of corridors at t intervals.

    w: (o, c, n_p, t), axis by axis, so that no array is read with a stride. points (o, i), count:
    as of `Stacked`. least: thresholds of w . p^.
    """

    w: jax.Array
    points: jax.Array
    count: jax.Array
    least: Computed | Looked


def satisfies(conditions: Conditions, path: Path, bin: Index, corridor: Index):
    """Does a plan in this bin meet all conditions of a corridor? Kernel.

    path: at the beginning of each interval, or with one knot more at both its knots.
    """
    points, (n_p, n) = jnp.asarray(conditions.points), conditions.w.shape[2:]
    knots = [path[first : first + n] for first in range(len(path) - n + 1)]
    least = conditions.least.of(bin, corridor)

    def add(o: Index, met: Bool[ArrayLike, ""]):
        w = conditions.w[o, corridor]
        clear = jnp.ones(n, bool)
        # by every point of the robot, so that its columns are fixed and read in place: to gather
        # the points of the pair costs more than the products of the others
        for point in range(path.shape[1] // n_p):
            belongs = points[o] == point
            threshold = least(o, point, jnp.argmax(belongs), w)
            axes = range(point * n_p, (point + 1) * n_p)
            heights = [height(w, [places[:, axis] for axis in axes]) for places in knots]
            clear &= separates(heights, threshold) | ~belongs.any()
        return met & clear.all()

    return jax.lax.fori_loop(0, conditions.count, add, jnp.ones((), bool))
