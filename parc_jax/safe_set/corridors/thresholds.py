"""What plans must exceed to keep to corridors where errors lie between fitted faces: one number per
corridor, bin, interval and point, worked out once and then looked up. [T26, T27]

The support of such errors takes many products, of a box one per axis, and a plan asks for it at
every knot. Plans are many; the corridors and bins that meet are few.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int
from numpy.typing import DTypeLike

from parc_jax.common.arrays import in_chunks, x64
from parc_jax.common.shapes import Index, Numbers
from parc_jax.learning.bound.error_set import ErrorSet, at
from parc_jax.safe_set.corridors.corridor import Corridor, Stacked, stacked
from parc_jax.safe_set.corridors.keeping import Looked

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
