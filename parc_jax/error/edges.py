"""Where to cut K into bins: where the error changes, learnt from training errors alone."""

import numpy as np

from parc_jax.error.measure import Errors
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.sets.box import Box
from parc_jax.tolerances import TOLERANCES

_CELLS = 4096  # places for cuts: a grid of about this many cells over K
_GAIN = 0.03  # [1] a cut must shrink the tube by this share: bins cost the planner pieces
_FOLDS = 4  # parts of the runs that take turns
_JOIN = (np.maximum, np.add, np.maximum)  # how cells join: errors that shape, runs, errors that size
_TIMES = 16  # groups of intervals that the search for cuts tells apart
_RUNS_PER_BIN = 20  # on average, at least
_TRUSTED = 200  # runs in a bin from which on it takes only half of its largest neighbour


def choose_edges(
    k: np.ndarray, errors: Errors, domain: Box, floor: float = TOLERANCES.shape_floor
) -> tuple[np.ndarray, ...]:
    """Edges per axis of K that make the tube small, found by cutting where it helps most, one cut at a time.

    k (n, n_k) and errors of training runs. Each quarter of them in turn gives the scalar, the rest the shape; size is
    the geometric mean half width over K, time and axes (what passes narrow gaps in most of K counts, not a few bad
    bins).
    Stops when no cut shrinks the tube by _GAIN. Any edges fixed before the holdout is seen are valid.
    Raises InputError for fewer than four runs.
    """
    if len(k) < _FOLDS:
        raise InputError(f"choose_edges: expected at least {_FOLDS} finite training runs; got {len(k)}.")
    per_axis = max(2, round(_CELLS ** (1 / domain.n)))
    thinned, final = _join_times(np.asarray(errors.interval)), np.asarray(errors.final)
    flat, n_interval = np.concatenate([thinned, final], axis=1), thinned.shape[1]
    parts = [_cell_maxima(k[f::_FOLDS], flat[f::_FOLDS], domain, per_axis) for f in range(_FOLDS)]
    grids = []
    for fold, (held, _) in enumerate(parts):  # every fold once as the runs that size the tube, the others shape it
        others = [part for g, part in enumerate(parts) if g != fold]
        grids.append((np.maximum.reduce([m for m, _ in others]), sum(c for _, c in others), held))
    most = len(k) // _RUNS_PER_BIN

    def size_of(axis: int, places) -> list[tuple[float, list[np.ndarray]]]:
        """Sizes after one more cut of an axis at each of the places (the size as it is, for a place already cut)."""
        merged = [[_merge(g, cuts, op, skip=axis) for g, op in zip(grid, _JOIN, strict=True)] for grid in grids]
        tried = [[np.union1d(c, place) if a == axis else c for a, c in enumerate(cuts)] for place in places]
        tried = [t for t in tried if _count(t) <= max(1, most)]
        return [(np.mean([_size(m, t, axis, n_interval, floor) for m in merged]), t) for t in tried]

    cuts = [np.array([0, per_axis])] * domain.n
    best = size_of(0, [0])[0][0]
    while True:
        options = [o for axis in range(domain.n) for o in size_of(axis, np.setdiff1d(np.arange(per_axis), cuts[axis]))]
        options = [(size, tried) for size, tried in options if best - size > _GAIN]
        if not options:
            return tuple(_places(domain, axis, per_axis)[c] for axis, c in enumerate(cuts))
        bins = _count(cuts)  # the cut that gains most per bin it adds
        best, cuts = max(options, key=lambda option: (best - option[0]) / (_count(option[1]) - bins))


def smoothed(maxima: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Each bin at least a share of its largest neighbour: half of it for a well filled bin, all of it for an empty one.

    maxima: (bins of axis 1, ..., bins of axis n_k, m). counts: the same without m.
    """
    around = maxima
    for axis in range(counts.ndim):
        size = around.shape[axis]
        padded = np.pad(around, [(1, 1) if a == axis else (0, 0) for a in range(around.ndim)])
        around = np.maximum.reduce([np.take(padded, np.arange(size) + step, axis=axis) for step in range(3)])
    nothing_near = around.max(axis=-1, keepdims=True) == 0
    around = np.where(nothing_near, maxima.reshape(-1, maxima.shape[-1]).max(axis=0), around)
    trust = np.minimum(1.0, counts / _TRUSTED)[..., None]
    return np.maximum(maxima, around * (1.0 - 0.5 * trust))


def _places(domain: Box, axis: int, per_axis: int) -> np.ndarray:
    places = np.linspace(domain.lo[axis], domain.hi[axis], per_axis + 1)
    places[0], places[-1] = domain.lo[axis], domain.hi[axis]
    return places


def _cell_maxima(k, flat, domain: Box, per_axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Largest errors (cells of axis 1, ..., m) and runs (cells of axis 1, ...) per cell of the grid of places."""
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
    """Errors (n, T, n_p) -> (n, m), neighbouring intervals joined by their maximum: enough to see where to cut K."""
    first = np.unique(np.linspace(0, interval.shape[1], _TIMES, endpoint=False).astype(int))
    return np.maximum.reduceat(interval, first, axis=1).reshape(len(interval), -1)


def _count(cuts) -> int:
    return int(np.prod([len(c) - 1 for c in cuts]))


def _merge(grid, cuts, op, skip: int):
    """Join the cells between cuts, on every axis but one."""
    for axis, c in enumerate(cuts):
        if axis != skip:
            grid = op.reduceat(grid, c[:-1], axis=axis)
    return grid


def _size(merged, cuts, axis: int, n_interval: int, floor: float) -> float:
    """Logarithm of the geometric mean half width that these cuts would give; merged on all other axes already."""
    fit, counts, rest = merged
    start = cuts[axis][:-1]
    shape = smoothed(np.maximum.reduceat(fit, start, axis=axis), np.add.reduceat(counts, start, axis=axis)) + floor
    scale = (np.maximum.reduceat(rest, start, axis=axis) / shape).max()
    volume = np.ones(())
    for c in cuts:
        volume = np.multiply.outer(volume, np.diff(c) / c[-1])
    width = np.log(shape[..., :n_interval]).mean(axis=-1)
    return float(np.log(max(scale, 1e-300)) + (width * volume).sum())


def frame(edges, errors: Errors) -> Tube:
    """A tube of zero widths with these edges, of the size of the errors (n, T, n_p), (n, n_p + n_q)."""
    n_bins = int(np.prod([len(e) - 1 for e in edges]))
    return tube(edges, np.zeros((n_bins, *errors.interval.shape[1:])), np.zeros((n_bins, errors.final.shape[1])))
