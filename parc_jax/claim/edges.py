"""Where to cut K into bins: where the error changes, learnt from training errors alone."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.base.tolerances import TOLERANCES
from parc_jax.claim.measure import Errors
from parc_jax.errors import InputError
from parc_jax.sets.box import Box

_CELLS = 4096  # places for cuts: a grid of about this many cells over K
_GAIN = 0.03  # [1] a cut must shrink the tube by this share: bins cost the planner pieces
_FOLDS = 4  # parts of the runs that take turns
_TIMES = 16  # groups of intervals that the search for cuts tells apart
_RUNS_PER_BIN = 20  # on average, at least
_TRUSTED = 200  # runs in a bin from which on it takes the least of its largest neighbour


class _Fold(NamedTuple):
    """One part of the runs held out against the rest, per cell of a grid over K, m coordinates.

    fit (cells of axis 1, ..., m): largest errors of the rest, which give a profile. runs (cells of
    axis 1, ...): how many these are. held (cells of axis 1, ..., m): largest errors of the runs
    held out, which give the scale.
    """

    fit: np.ndarray
    runs: np.ndarray
    held: np.ndarray

    def joined(self, cuts: np.ndarray, axis: int) -> "_Fold":
        """The cells between cuts (c,) of one axis made one."""
        start = cuts[:-1]
        return _Fold(
            np.maximum.reduceat(self.fit, start, axis=axis),
            np.add.reduceat(self.runs, start, axis=axis),
            np.maximum.reduceat(self.held, start, axis=axis),
        )


class _Option(NamedTuple):
    """Cuts per axis of K, places of the grid, and the size of the tube that they would give."""

    size: float
    cuts: list[np.ndarray]


def choose_edges(
    k: np.ndarray, errors: Errors, domain: Box, floor: float = TOLERANCES.profile_floor
) -> tuple[np.ndarray, ...]:
    """Edges per axis of K that make the tube small, found by cutting where it helps most, one cut
    at a time.

    k (n, n_k) and errors of training runs. Each quarter of them in turn gives the scalar, the rest
    the profile; size is the geometric mean half width over K, time and axes (what passes narrow
    gaps in most of K counts, not a few bad bins).
    Stops when no cut shrinks the tube by _GAIN. Any edges fixed before the holdout is seen are
    valid.
    Raises InputError for fewer than four runs.
    """
    if len(k) < _FOLDS:
        raise InputError(
            f"choose_edges: expected at least {_FOLDS} finite training runs; got {len(k)}."
        )
    per_axis = max(2, round(_CELLS ** (1 / domain.n)))
    thinned = _join_times(np.asarray(errors.interval))
    flat = np.concatenate([thinned, np.asarray(errors.final)], axis=1)
    folds = _folds(k, flat, domain, per_axis)
    most_bins = max(1, len(k) // _RUNS_PER_BIN)

    def tried(axis: int, candidates: list[list[np.ndarray]]) -> list[_Option]:
        """Options for candidates that differ in the cuts of one axis only."""
        partly = folds
        for other, cuts in enumerate(candidates[0] if candidates else []):
            if other != axis:
                partly = [fold.joined(cuts, other) for fold in partly]
        options = []
        for cuts in candidates:
            whole = [fold.joined(cuts[axis], axis) for fold in partly]
            sizes = [_log_size(fold, cuts, thinned.shape[1], floor) for fold in whole]
            options.append(_Option(float(np.mean(sizes)), cuts))
        return options

    uncut = [np.array([0, per_axis])] * domain.n
    best = tried(0, [uncut])[0]
    while True:
        options = []
        for axis in range(domain.n):
            finer = [c for c in _one_more_cut(best.cuts, axis, per_axis) if _bins(c) <= most_bins]
            options += tried(axis, finer)
        helpful = [option for option in options if best.size - option.size > _GAIN]
        if not helpful:
            return tuple(_places(domain, axis, per_axis)[c] for axis, c in enumerate(best.cuts))
        gains = [
            (best.size - option.size) / (_bins(option.cuts) - _bins(best.cuts))
            for option in helpful
        ]
        best = helpful[int(np.argmax(gains))]  # the cut that gains most per bin it adds


def _folds(k: np.ndarray, flat: np.ndarray, domain: Box, per_axis: int) -> list[_Fold]:
    """Every _FOLDS-th run held out in turn; flat (n, m) errors of runs k (n, n_k)."""
    parts = [
        _cell_maxima(k[first::_FOLDS], flat[first::_FOLDS], domain, per_axis)
        for first in range(_FOLDS)
    ]
    folds = []
    for number, (held, _) in enumerate(parts):
        rest = [part for other, part in enumerate(parts) if other != number]
        fit = np.maximum.reduce([largest for largest, _ in rest])
        folds.append(_Fold(fit, sum(runs for _, runs in rest), held))
    return folds


def _one_more_cut(cuts: list[np.ndarray], axis: int, per_axis: int) -> list[list[np.ndarray]]:
    """The cuts with one more on this axis, at every place that has none."""
    out = []
    for place in np.setdiff1d(np.arange(per_axis), cuts[axis]):
        finer = list(cuts)
        finer[axis] = np.union1d(cuts[axis], place)
        out.append(finer)
    return out


def _log_size(fold: _Fold, cuts: list[np.ndarray], n_interval: int, floor: float) -> float:
    """Logarithm of the geometric mean half width; fold joined on all axes."""
    profile = smoothed(fold.fit, fold.runs) + floor
    scale = (fold.held / profile).max()
    volume = np.ones(())
    for c in cuts:
        volume = np.multiply.outer(volume, np.diff(c) / c[-1])
    width = np.log(profile[..., :n_interval]).mean(axis=-1)
    return float(np.log(max(scale, 1e-300)) + (width * volume).sum())


def smoothed(maxima: np.ndarray, counts: np.ndarray, least: float = 0.5) -> np.ndarray:
    """Each bin at least a share of its largest neighbour: `least` of it for a well filled bin, all
    of it for an empty one.

    maxima: (bins of axis 1, ..., bins of axis n_k, m). counts: the same without m.
    """
    around = maxima
    for axis in range(counts.ndim):
        size = around.shape[axis]
        padded = np.pad(around, [(1, 1) if a == axis else (0, 0) for a in range(around.ndim)])
        around = np.maximum.reduce(
            [np.take(padded, np.arange(size) + step, axis=axis) for step in range(3)]
        )
    nothing_near = around.max(axis=-1, keepdims=True) == 0
    around = np.where(nothing_near, maxima.reshape(-1, maxima.shape[-1]).max(axis=0), around)
    trust = np.minimum(1.0, counts / _TRUSTED)[..., None]
    return np.maximum(maxima, around * (1.0 - (1.0 - least) * trust))


def _places(domain: Box, axis: int, per_axis: int) -> np.ndarray:
    places = np.linspace(domain.lo[axis], domain.hi[axis], per_axis + 1)
    places[0] = domain.lo[axis]
    places[-1] = domain.hi[axis]
    return places


def _cell_maxima(
    k: Float[np.ndarray, "n n_k"], flat: Float[np.ndarray, "n m"], domain: Box, per_axis: int
) -> tuple[np.ndarray, np.ndarray]:
    """Largest errors (cells of axis 1, ..., m) and runs (cells of axis 1, ...) per cell of the grid
    of places.
    """
    number = np.zeros(len(k), int)
    for axis in range(domain.n):
        inner = _places(domain, axis, per_axis)[1:-1]
        number = number * per_axis + np.searchsorted(inner, k[:, axis], side="right")
    out = np.zeros((per_axis**domain.n, flat.shape[1]))
    order = np.argsort(number, kind="stable")
    present, first = np.unique(number[order], return_index=True)
    out[present] = np.maximum.reduceat(flat[order], first, axis=0)
    grid = (per_axis,) * domain.n
    return out.reshape(*grid, -1), np.bincount(number, minlength=len(out)).reshape(grid)


def _join_times(interval: np.ndarray) -> np.ndarray:
    """Errors (n, T, n_c) -> (n, m), neighbouring intervals joined by their maximum: enough to see
    where to cut K.
    """
    first = np.unique(np.linspace(0, interval.shape[1], _TIMES, endpoint=False).astype(int))
    return np.maximum.reduceat(interval, first, axis=1).reshape(len(interval), -1)


def _bins(cuts: list[np.ndarray]) -> int:
    return int(np.prod([len(c) - 1 for c in cuts]))
