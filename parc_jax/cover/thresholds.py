"""What plans must exceed to keep to corridors where errors lie between fitted faces: one number per
corridor, bin, interval and point, worked out once and then looked up. [T26, T27]

The support of such errors takes many products, of a box one per axis, and a plan asks for it at
every knot. Plans are many; the corridors and bins that meet are few.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.base.arrays import in_chunks, x64
from parc_jax.claim.error_set import ErrorSet, at
from parc_jax.cover.corridor import Corridor
from parc_jax.verdict.sized import LEAST_OBSTACLES, size_class

AT_ONCE = 64  # (corridor, bin) pairs per compiled call
CORRIDORS = 4  # corridors per compiled call, of which all bins are asked at a few knots
LEAST_ROWS = 512  # of the table; it grows by fours, for few compiled shapes
MOST_BYTES = 2**29  # of the table, before it is begun anew


class Thresholds:
    """Thresholds at all intervals of the (corridor, bin) pairs that were asked for. What is kept is
    only ever added to.
    """

    def __init__(self, errors: ErrorSet):
        self._errors = errors
        self._row: dict[int, int] = {}
        self._table = np.zeros((0, 0))

    def of(self, corridors: tuple[Corridor, ...], corridor: np.ndarray, bins: np.ndarray):
        """Row (pairs,) of each pair in a table (rows, o, T, i) with room for more obstacles, and
        the table; corridor (pairs,) numbers of corridors, which stay theirs, bins (pairs,).
        """
        n_bins = len(jax.tree.leaves(self._errors)[0])
        name = corridor * n_bins + bins % n_bins
        asked, place = np.unique(name, return_inverse=True)
        if self._table.nbytes > MOST_BYTES:
            self._row.clear()
        new = np.array([n for n in asked.tolist() if n not in self._row], int)
        if len(new):
            self._add(corridors, new, n_bins)
        return np.array([self._row[n] for n in asked.tolist()], int)[place], self._table

    def _add(self, corridors, new: np.ndarray, n_bins: int) -> None:
        used, of = np.unique(new // n_bins, return_inverse=True)
        roomy = stacked([corridors[c] for c in used])

        def call(rows):
            own = roomy._replace(w=roomy.w[of[rows]], support=roomy.support[of[rows]])
            with x64():
                return np.asarray(_thresholds(self._errors, own, new[rows] % n_bins))

        found = in_chunks(len(new), AT_ONCE, call)
        first = len(self._row)
        size = max(LEAST_ROWS, len(self._table))
        while size < first + len(new):
            size *= 4
        if size > len(self._table):
            table = np.zeros((size, *found.shape[1:]))
            table[:first] = self._table[:first].reshape(first, *found.shape[1:])
            self._table = table
        self._table[first : first + len(new)] = found
        self._row.update((n, first + i) for i, n in enumerate(new.tolist()))


def at_few_knots(errors: ErrorSet, corridors: list[Corridor], knots: np.ndarray) -> list:
    """Per corridor the thresholds (n_bins, o, t, i) of all bins at a few intervals, in float32."""
    if not corridors:
        return []
    few = jax.tree.map(lambda x: x[:, knots], errors)
    roomy = stacked(corridors)
    w, support = roomy.w[:, :, knots], roomy.support[:, :, knots]

    def call(rows):
        own = roomy._replace(w=w[rows], support=support[rows])
        with x64():
            return np.asarray(_in_all_bins(few, own), np.float32)

    return list(in_chunks(len(corridors), CORRIDORS, call))


class Stacked(NamedTuple):
    """Corridors (c, ...) with room for more obstacles, the first `count` of which are there: w (c,
    o, T, n_p), support (c, o, T), points (o, i).
    """

    w: np.ndarray
    support: np.ndarray
    points: np.ndarray
    count: np.ndarray


def stacked(corridors: Sequence[Corridor]) -> Stacked:
    """At least one, all about the same obstacles."""
    n, *_ = corridors[0].w.shape
    size = size_class(n, LEAST_OBSTACLES)
    w = np.zeros((len(corridors), size, *corridors[0].w.shape[1:]))
    support = np.full(w.shape[:-1], -np.inf)
    for i, one in enumerate(corridors):
        w[i, :n], support[i, :n] = one.w, one.support
    points = np.pad(corridors[0].points, ((0, size - n), (0, 0)))
    return Stacked(w, support, points, np.int32(n))


def _of_one(errors: ErrorSet, points, count, w, support, bin):
    """(o, T, i) thresholds of one corridor in one bin, as `Corridor.threshold`. Kernel.

    Interval by interval innermost: errors of a point in a bin stay in cache.
    """
    mine = at(errors, bin)

    def look(o, found):
        back = tuple(-w[o, :, axis] for axis in range(w.shape[-1]))
        slots = [
            support[o] + at(mine, (slice(None), point)).support_by_axis(back) for point in points[o]
        ]
        return found.at[o].set(jnp.stack(slots, axis=-1))

    nothing = jnp.zeros((*support.shape, points.shape[1]), support.dtype)
    return jax.lax.fori_loop(0, count, look, nothing)


@jax.jit
def _thresholds(errors, some: Stacked, bins):
    points = jnp.asarray(some.points)
    one = lambda x: _of_one(errors, points, some.count, *x)  # noqa: E731
    return jax.lax.map(one, (some.w, some.support, bins))


@jax.jit
def _in_all_bins(errors, some: Stacked):
    points = jnp.asarray(some.points)
    bins = jnp.arange(len(jax.tree.leaves(errors)[0]))

    def one(corridor):
        of_bin = lambda b: _of_one(errors, points, some.count, *corridor, b)  # noqa: E731
        return jax.lax.map(of_bin, bins)

    return jax.lax.map(one, (some.w, some.support))


def columns_of(path, point, n_p: int) -> list:
    """The coordinates (t,) of a point on its path (t, n_c), an array each. Kernel.

    Where there is one point it is known which, and its columns are read in place.
    """
    point = 0 if path.shape[1] == n_p else point
    return [path[:, point * n_p + axis] for axis in range(n_p)]


class Looked(NamedTuple):
    """Conditions of which thresholds are looked up. w (o, c, n_p, t). points (o, i), count: as of
    `Stacked`. threshold: (c, n_bins, o, t, i) or (rows, o, t, i).
    """

    w: jax.Array
    points: jax.Array
    count: jax.Array
    threshold: jax.Array

    def met(self, threshold, corridor, *paths):
        """Are all conditions of a corridor met on all of some paths (t, n_c)? threshold (o, t, i).
        Kernel.
        """
        points, n_p = jnp.asarray(self.points), self.w.shape[2]

        def look(o, met):
            w = self.w[o][corridor]
            clear = jnp.ones(w.shape[1], bool)
            for slot, point in enumerate(points[o]):
                for path in paths:
                    columns = columns_of(path, point, n_p)
                    along = sum(x * y for x, y in zip(w, columns, strict=True))
                    clear &= along > threshold[o, :, slot]
            return met & clear.all()

        return jax.lax.fori_loop(0, self.count, look, jnp.ones((), bool))
