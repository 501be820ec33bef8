"""Where to cut K into bins: where the error changes, learnt from training errors alone."""

from collections.abc import Iterable
from functools import reduce
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.bins import Binned, Bins, Edges
from parc_jax.learning.bound.measure import Errors

_CELLS = 4096  # places for cuts: a grid of about this many cells over K
_PLACES = 256  # along one axis, at most
_GAIN = 0.03  # [1] share by which a cut must shrink the tube: bins cost planning time
_FOLDS = 4  # parts of the runs that take turns
_TIMES = 16  # groups of intervals in the search for cuts
_RUNS_PER_BIN = 20  # on average, at least
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
        pairs = zip(self, _JOINS, strict=True)
        return _Fold(*(join.reduceat(x, cuts[:-1], axis=axis) for x, join in pairs))


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
    per_axis = min(max(2, round(_CELLS ** (1 / domain.n))), _PLACES)
    interval = np.asarray(errors.interval)
    # neighbouring intervals joined, to see where to cut K
    first = np.unique(np.linspace(0, interval.shape[1], _TIMES, endpoint=False).astype(int))
    thinned = np.maximum.reduceat(interval, first, axis=1).reshape(len(interval), -1)
    flat = np.concatenate([thinned, np.asarray(errors.final)], axis=1)
    places = edges_of(domain, (per_axis,) * domain.n)
    folds = _folds(k, flat, places)
    most_bins = max(1, len(k) // _RUNS_PER_BIN)

    def mean_size(grids: list[_Fold]) -> float:
        return float(np.mean([_log_size(grid, thinned.shape[1]) for grid in grids]))

    def best_of(cuts: list[np.ndarray], axis: int) -> _Option | None:
        """The best place for one more cut of this axis, if there is room for one."""
        more = _bins(cuts) // (len(cuts[axis]) - 1)
        free = np.setdiff1d(np.arange(per_axis), cuts[axis])
        if not len(free) or _bins(cuts) + more > most_bins:
            return None
        partly = [_joined(fold, cuts, set(range(domain.n)) - {axis}) for fold in folds]
        finer = [np.union1d(cuts[axis], place) for place in free]
        sizes = [mean_size([fold.joined(some, axis) for fold in partly]) for some in finer]
        best = int(np.argmin(sizes))
        return _Option(sizes[best], more, axis, int(free[best]))

    cuts = [np.array([0, per_axis])] * domain.n
    size = mean_size([_joined(fold, cuts, range(domain.n)) for fold in folds])
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
            f"bins: expected {domain.n} numbers >= 1 or lists of edges, one per axis; got {bins}."
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
                    f"bins: expected axis {axis} from {lo} to {hi}; got {edge[0]} to {edge[-1]}."
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


def _log_size(fold: _Fold, n_interval: int) -> float:
    """Logarithm of the geometric mean half width of a grid, joined on all axes."""
    profile = smoothed(fold.fit, fold.runs) + TOLERANCES.profile_floor
    scale = (fold.held / profile).max()
    width = np.log(profile[..., :n_interval]).mean(axis=-1)
    return float(np.log(max(scale, 1e-300)) + (width * fold.share).sum())


def smoothed(maxima: np.ndarray, counts: np.ndarray, least: float = 0.5) -> np.ndarray:
    """Each bin at least a share of its largest neighbour: `least` where well filled, 1 if empty.

    maxima: (bins of axis 1, ..., bins of axis n_k, m). counts: the same without m.
    """
    from scipy.ndimage import maximum_filter  # heavy to load, and only learning needs it

    around = maximum_filter(maxima, (*[3] * counts.ndim, 1), mode="nearest")
    nothing_near = around.max(axis=-1, keepdims=True) == 0
    everywhere = maxima.max(axis=tuple(range(counts.ndim)), keepdims=True)
    around = np.where(nothing_near, everywhere, around)
    trust = np.minimum(1.0, counts / _TRUSTED)[..., None]
    return np.maximum(maxima, around * (1.0 - (1.0 - least) * trust))


def _cell_maxima(
    k: Float[np.ndarray, "n n_k"], flat: Float[np.ndarray, "n m"], places: Edges
) -> tuple[np.ndarray, np.ndarray]:
    """Largest errors (cells of axis 1, ..., m) and runs (cells of axis 1, ...) by cell of K."""
    cells = Binned(places)
    number, grid = cells.bin_of(k), cells.grid
    out = np.zeros((np.prod(grid), flat.shape[1]))
    order = np.argsort(number, kind="stable")
    present, first = np.unique(number[order], return_index=True)
    out[present] = np.maximum.reduceat(flat[order], first, axis=0)
    return out.reshape(*grid, -1), np.bincount(number, minlength=len(out)).reshape(grid)


def _bins(cuts: list[np.ndarray]) -> int:
    return int(np.prod([len(c) - 1 for c in cuts]))
