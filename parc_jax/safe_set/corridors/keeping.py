"""Who keeps to a corridor: one kernel, at all intervals in float64 or at a few in float32. [T14,
T27]
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Bool, Float

from parc_jax.common.shapes import Index, Path
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.safe_set.separation.inequality import height, separates


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
