"""What errors take from the plans for which a corridor is chosen. [T26, T27]"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.shapes import Index
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.learning.bound.reach import errors_of, numbered, reach
from parc_jax.safe_set.verdict.scene import Scene, size_class

MOST_BYTES = 2**29  # along a scene's table: what is more is worked out wherever it is asked
LEAST_KNOWN = 256  # directions that are told, if that is not much more
MUCH = 2**26  # [bytes]


class Allowed(NamedTuple):
    """What errors take from some plans, in float32.

    errors (n_bins, T, n_points). bins (b,): of the plans. known (u, n_bins, n_points, T): against u
    directions, where errors lie between fitted faces; which (o, d): the table's directions among
    them. Both None where nothing is looked up.
    """

    errors: ErrorSet
    bins: jax.Array
    known: jax.Array | None = None
    which: jax.Array | None = None

    def of_first(self, n: int) -> ErrorSet:
        """The errors of the first plans, (n, T, n_points)."""
        return at(self.errors, self.bins[:n])

    def lost(self, plan: Index, point: Index, back: tuple[jax.Array, ...]):
        """(T, d) how far the errors of a plan reach along `back`, axes of directions. Kernel."""
        return at(self.errors, (self.bins[plan], slice(None), point, None)).support_by_axis(back)

    def lost_along_table(self, o: Index, plan: Index, point: Index, back: tuple[jax.Array, ...]):
        """The same against all directions of the table for pair o. Kernel."""
        if self.known is None:
            return self.lost(plan, point, back)
        return self.known[self.which[o], self.bins[plan], point].T


def allowed_of(scene: Scene) -> Allowed:
    """Of plans of a scene, whose bins are still to be told."""
    tube, table = scene.model.tube, scene.directions
    allowed = Allowed(errors_of(tube, np.float32), np.zeros(0, int))
    if tube.templates is None:
        return allowed
    unique, which = numbered(table.w[: int(scene.count)], len(table.w))
    n, bytes_each = len(unique), 4 * int(np.prod(tube.errors.half.shape[:-2]))
    if bytes_each * n > MOST_BYTES:
        return allowed
    size = size_class(n, LEAST_KNOWN if bytes_each * LEAST_KNOWN <= MUCH else 1)
    return allowed._replace(known=reach(tube, unique, size, np.float32).lost, which=which)
