"""What plans must exceed to keep to corridors where errors lie between fitted faces: one number per
corridor, bin, interval and point, worked out once and then looked up. [T26, T27]

The support of such errors takes many products, of a box one per axis, and a plan asks for it at
every knot. Plans are many; the corridors and bins that meet are few.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import in_chunks, remembered, x64
from parc_jax.claim.error_set import ErrorSet, ErrorTemplate, at
from parc_jax.cover.choose import ByBin
from parc_jax.cover.corridor import Corridor
from parc_jax.obstacles.grown import bucket

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
        """Row (pairs,) of each pair in a table (rows, o, T, i), and the table; corridor (pairs,)
        numbers of corridors, which stay theirs, bins (pairs,).
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
        w = np.stack([corridors[c].w for c in np.unique(new // n_bins)])
        support = np.stack([corridors[c].support for c in np.unique(new // n_bins)])
        of = np.searchsorted(np.unique(new // n_bins), new // n_bins)
        points = corridors[0].points

        def call(rows):
            i = of[rows]
            with x64():
                return np.asarray(
                    _thresholds(self._errors, points, w[i], support[i], new[rows] % n_bins)
                )

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
    w = np.stack([c.w[:, knots] for c in corridors])
    support = np.stack([c.support[:, knots] for c in corridors])
    points = corridors[0].points

    def call(rows):
        with x64():
            return np.asarray(_in_all_bins(few, points, w[rows], support[rows]), np.float32)

    return list(in_chunks(len(corridors), CORRIDORS, call))


def _of_one(errors: ErrorSet, points, w, support, bin):
    """(o, T, i) thresholds of one corridor in one bin, as `Corridor.threshold`. Kernel.

    Interval by interval and point by point innermost: errors of a bin stay in cache.
    """
    mine = at(errors, bin)
    slots = []
    for slot in range(points.shape[1]):
        allowed = jax.tree.map(lambda x: x.swapaxes(0, 1), at(mine, np.s_[:, points[:, slot]]))
        back = tuple(-w[..., axis] for axis in range(w.shape[-1]))
        slots.append(support + allowed.support_by_axis(back))
    return jnp.stack(slots, axis=-1)


@jax.jit
def _thresholds(errors, points, w, support, bins):
    points = jnp.asarray(points)
    one = lambda x: _of_one(errors, points, *x)  # noqa: E731
    return jax.lax.map(one, (w, support, bins))


@jax.jit
def _in_all_bins(errors, points, w, support):
    points = jnp.asarray(points)
    bins = jnp.arange(len(jax.tree.leaves(errors)[0]))

    def one(corridor):
        return jax.lax.map(lambda b: _of_one(errors, points, *corridor, b), bins)

    return jax.lax.map(one, (w, support))


def by_bin(scene, errors: ErrorSet) -> ByBin | None:
    """What errors between fitted faces take along the directions of a scene's table, in all bins;
    worked out once per tube and set of directions. None for boxes, and where it would be too large.
    """
    if not isinstance(errors, ErrorTemplate):
        return None
    w = scene.directions.w
    unique, which = np.unique(w.reshape(-1, w.shape[2]), axis=0, return_inverse=True)
    sets = int(np.prod(errors.half.shape[:-2]))
    if 4 * sets * len(unique) > MOST_BYTES:
        return None
    unique = np.pad(unique, ((0, bucket(len(unique)) - len(unique)), (0, 0)), mode="edge")

    def make():
        with x64():
            rough = jax.device_put(jax.tree.map(np.float32, errors))
            return rough, _along(rough, unique.astype(np.float32))

    name = ("fan", unique.shape, unique.tobytes())
    rough, lost = remembered(errors.half, name, make)
    return ByBin(rough, np.zeros(0, int), lost, which.reshape(w.shape[:2]))


@jax.jit
def _along(errors, w):
    """(n_bins, n_points, T, u) how far errors (n_bins, T, n_points) reach along -w (u, n_p)."""
    lost = jax.lax.map(lambda one: errors.support(-one), w)
    return lost.transpose(1, 3, 2, 0)


class Looked(NamedTuple):
    """Conditions of which thresholds are looked up. w (c, n_p, o, t). points (o, i). threshold:
    (c, n_bins, o, t, i) or (rows, o, t, i).
    """

    w: jax.Array
    points: jax.Array
    threshold: jax.Array

    def met(self, threshold, corridor, *paths):
        """Are all conditions of a corridor met on all of some paths (t, n_c)? threshold (o, t, i).
        Kernel.
        """
        w = self.w[corridor]
        met = jnp.ones(w.shape[1:], bool)
        for slot in range(self.points.shape[1]):
            own = self.points[:, slot]
            for path in paths:
                columns = [path.T[own * len(w) + axis] for axis in range(len(w))]
                along = sum(x * y for x, y in zip(w, columns, strict=True))
                met &= along > threshold[..., slot]
        return met.all()
