"""Where to cut K into bins: where the error changes, learnt from training errors alone."""

from collections.abc import Callable, Iterable
from functools import partial, reduce
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.bins import Bins, Edges
from parc_jax.learning.bound.measure import Errors

_CELLS = 4096  # places for cuts: a grid of about this many cells over K
_GAIN = 0.03  # [1] share by which a cut must shrink the tube: bins cost planning time
_FOLDS = 4  # parts of the runs that take turns
_TIMES = 16  # groups of intervals in the search for cuts
_RUNS_PER_BIN = 20  # on average, at least
_AT_ONCE = 2**18  # numbers of the grids that are compared at once, to fit the cache
_JOINS = (np.maximum, np.add, np.maximum, np.add)  # of the fields of a fold
_TRUSTED = 200  # runs in a bin above which it borrows least from its neighbours


class _Fold(NamedTuple):
    """One part of the runs held out against the rest, by cells of axis 1, axis 2 ... of K.

    fit: (cells, m coordinates) largest errors of the rest, for a profile. runs: (cells) their
    numbers. held: (cells, m) largest errors of the held-out runs, for the scale. share: of K.
    """

    fit: np.ndarray
    runs: np.ndarray
    held: np.ndarray
    share: np.ndarray

    def joined(self, cuts: np.ndarray, axis: int) -> "_Fold":
        """The cells between cuts (c,) of one axis made one."""
        return self._by(lambda x, join: join.reduceat(x, cuts[:-1], axis=axis))

    def cut_at_each(self, cuts: np.ndarray, axis: int, places: np.ndarray) -> "_Fold":
        """The same with one more cut at each of places (p,) in turn: p grids, by a leading axis."""

        def cut(x: np.ndarray, join: np.ufunc) -> np.ndarray:
            grids = _cut_at_each(np.moveaxis(x, axis, 0), cuts, places, join)
            return np.moveaxis(grids, 1, axis + 1)

        return self._by(cut)

    def _by(self, work: Callable[[np.ndarray, np.ufunc], np.ndarray]) -> "_Fold":
        return _Fold(*(work(x, join) for x, join in zip(self, _JOINS, strict=True)))


class _Option(NamedTuple):
    """One more cut: logarithm of the resulting tube size, number of new bins, axis and place."""

    size: float
    more: int
    axis: int
    place: int


def choose_edges(k: np.ndarray, errors: Errors, domain: Box) -> tuple[np.ndarray, ...]:
    """Edges per axis of K that make the tube small, cut one by one where it helps most.

    k (n, n_k) and errors of training runs, in four-fold cross-validation: the fold gives the scale,
    the rest the profile. Size is the geometric mean half width over K, time and axes, so that most
    of K decides and not a few bad bins. Stops when no cut shrinks the tube by _GAIN.
    Raises InputError for fewer than four runs.
    """
    # any edges are valid that are fixed before the calibration set is drawn
    if len(k) < _FOLDS:
        raise InputError(
            f"choose_edges: expected at least {_FOLDS} finite training runs to cut K; got "
            f"{len(k)}. Collect more, or say the bins: bins=({', '.join(['1'] * domain.n)},)."
        )
    per_axis = max(2, round(_CELLS ** (1 / domain.n)))
    thinned = _join_times(np.asarray(errors.interval))
    flat = np.concatenate([thinned, np.asarray(errors.final)], axis=1)
    places = edges_of(domain, (per_axis,) * domain.n)
    folds = _folds(k, flat, places)
    most_bins = max(1, len(k) // _RUNS_PER_BIN)
    log_size = partial(_log_size, n_interval=thinned.shape[1])

    def best_of(cuts: list[np.ndarray], axis: int) -> _Option | None:
        """The best place for one more cut of this axis, if there is room for one."""
        more = _bins(cuts) // (len(cuts[axis]) - 1)
        free = np.setdiff1d(np.arange(per_axis), cuts[axis])
        if not len(free) or _bins(cuts) + more > most_bins:
            return None
        partly = [_joined(fold, cuts, set(range(domain.n)) - {axis}) for fold in folds]
        rows = (_bins(cuts) + more) * flat.shape[1]
        sizes = [
            np.mean([log_size(fold.cut_at_each(cuts[axis], axis, some)) for fold in partly], axis=0)
            for some in np.array_split(free, 1 + len(free) * rows // _AT_ONCE)
        ]
        sizes = np.concatenate(sizes)
        best = int(np.argmin(sizes))
        return _Option(float(sizes[best]), more, axis, int(free[best]))

    cuts = [np.array([0, per_axis])] * domain.n
    whole = [_joined(fold, cuts, range(domain.n)) for fold in folds]
    size = np.mean([log_size(_Fold(*(x[None] for x in fold))) for fold in whole])
    while True:
        options = [best_of(cuts, axis) for axis in range(domain.n)]
        helpful = [one for one in options if one is not None and size - one.size > _GAIN]
        if not helpful:
            return tuple(along[c] for along, c in zip(places, cuts, strict=True))
        # the cut that gains most per bin it adds
        best = max(helpful, key=lambda one: (size - one.size) / one.more)
        size = best.size
        cuts[best.axis] = np.union1d(cuts[best.axis], best.place)


def edges_of(domain: Box, bins: Bins) -> tuple[np.ndarray, ...]:
    """Edges per axis of K, the outer ones exactly those of the domain, from numbers of equal bins
    per axis, or from edges. Raises InputError.
    """
    bins = tuple(bins) if isinstance(bins, tuple | list) else tuple(np.atleast_1d(bins))
    if len(bins) != domain.n or any(np.ndim(b) == 0 and int(b) < 1 for b in bins):
        raise InputError(
            f"bins: expected {domain.n} numbers >= 1 or lists of edges, one per axis of K; got "
            f"{bins}."
        )
    edges = []
    for axis, (lo, hi, given) in enumerate(zip(domain.lo, domain.hi, bins, strict=True)):
        if np.ndim(given) == 0:
            edge = np.linspace(lo, hi, int(given) + 1)
            edge[0], edge[-1] = lo, hi
        else:
            edge = np.array(given, np.float64)
            if edge[0] != lo or edge[-1] != hi:
                raise InputError(
                    f"bins: expected edges of axis {axis} from {lo} to {hi}; got {edge[0]} to "
                    f"{edge[-1]}."
                )
        edges.append(edge)
    return tuple(edges)


def _folds(k: np.ndarray, flat: np.ndarray, places: Edges) -> list[_Fold]:
    """Every _FOLDS-th run held out in turn; flat (n, m) errors of runs k (n, n_k)."""
    parts = [_cell_maxima(k[first::_FOLDS], flat[first::_FOLDS], places) for first in range(_FOLDS)]
    folds = []
    for number, (held, _) in enumerate(parts):
        rest = [part for other, part in enumerate(parts) if other != number]
        fit = np.maximum.reduce([largest for largest, _ in rest])
        runs = sum(runs for _, runs in rest)
        folds.append(_Fold(fit, runs, held, np.full(runs.shape, 1 / runs.size)))
    return folds


def _joined(fold: _Fold, cuts: list[np.ndarray], axes: Iterable[int]) -> _Fold:
    """The cells between the cuts of some axes made one."""
    return reduce(lambda one, axis: one.joined(cuts[axis], axis), axes, fold)


def _cut_at_each(x: np.ndarray, cuts: np.ndarray, places: np.ndarray, join: np.ufunc) -> np.ndarray:
    """Cells x (cells, ...) joined between cuts (c,) and one of places (p,) each: (p, c, ...)."""
    at = np.searchsorted(cuts, places) - 1  # the cut below each place
    parts = [x[begin:end] for begin, end in pairwise(cuts)]
    before = np.concatenate([join.accumulate(part) for part in parts])
    behind = np.concatenate([join.accumulate(part[::-1])[::-1] for part in parts])
    column = np.arange(len(cuts))
    out = join.reduceat(x, cuts[:-1])[column - (column > at[:, None])]
    row = np.arange(len(places))
    out[row, at] = before[places - 1]
    out[row, at + 1] = behind[places]
    return out


def _log_size(fold: _Fold, n_interval: int) -> np.ndarray:
    """(p,) logarithms of the geometric mean half widths of several grids, joined on all axes."""
    profile = smoothed(fold.fit, fold.runs, sets=1) + TOLERANCES.profile_floor
    cells = tuple(range(1, fold.runs.ndim))
    scale = (fold.held / profile).max(axis=(*cells, -1))
    width = np.log(profile[..., :n_interval]).mean(axis=-1)
    return np.log(np.maximum(scale, 1e-300)) + (width * fold.share).sum(axis=cells)


def smoothed(
    maxima: np.ndarray, counts: np.ndarray, least: float = 0.5, sets: int = 0
) -> np.ndarray:
    """Each bin at least a share of its largest neighbour: `least` where well filled, 1 if empty.

    maxima: (bins of axis 1, ..., bins of axis n_k, m). counts: the same without m. sets: number of
        leading batch axes.
    """
    axes = tuple(range(sets, counts.ndim))
    around = maxima
    for axis in axes:
        narrower, around = around, around.copy()
        for to, off in ((slice(1, None), slice(-1)), (slice(-1), slice(1, None))):
            before = (slice(None),) * axis
            wider = around[(*before, to)]
            np.maximum(wider, narrower[(*before, off)], out=wider)
    nothing_near = around.max(axis=-1, keepdims=True) == 0
    around = np.where(nothing_near, maxima.max(axis=axes, keepdims=True), around)
    trust = np.minimum(1.0, counts / _TRUSTED)[..., None]
    return np.maximum(maxima, around * (1.0 - (1.0 - least) * trust))


def _cell_maxima(
    k: Float[np.ndarray, "n n_k"], flat: Float[np.ndarray, "n m"], places: Edges
) -> tuple[np.ndarray, np.ndarray]:
    """Largest errors (cells of axis 1, ..., m) and runs (cells of axis 1, ...) by cell of K."""
    number = np.zeros(len(k), int)
    grid = tuple(len(along) - 1 for along in places)
    for axis, along in enumerate(places):
        number = number * grid[axis] + np.searchsorted(along[1:-1], k[:, axis], side="right")
    out = np.zeros((np.prod(grid), flat.shape[1]))
    order = np.argsort(number, kind="stable")
    present, first = np.unique(number[order], return_index=True)
    out[present] = np.maximum.reduceat(flat[order], first, axis=0)
    return out.reshape(*grid, -1), np.bincount(number, minlength=len(out)).reshape(grid)


def _join_times(interval: np.ndarray) -> np.ndarray:
    """Errors (n, T, n_c) -> (n, m), neighbouring intervals joined, to see where to cut K."""
    first = np.unique(np.linspace(0, interval.shape[1], _TIMES, endpoint=False).astype(int))
    return np.maximum.reduceat(interval, first, axis=1).reshape(len(interval), -1)


def _bins(cuts: list[np.ndarray]) -> int:
    return int(np.prod([len(c) - 1 for c in cuts]))
