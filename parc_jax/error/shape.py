"""The shape of a tube: how error is spread over time, axes and K, learnt before the holdout is seen."""

import itertools

import numpy as np

from parc_jax.error.measure import Errors, measure
from parc_jax.error.score import bins_of, score_errors
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.sets.box import Box
from parc_jax.tolerances import TOLERANCES

_WORTH = 1.05  # a finer grid must shrink the tube by this factor: bins cost the planner pieces
_TRUSTED = 20  # runs in a bin above which its own maximum counts more than its neighbours'


def uniform_edges(domain: Box, bins) -> tuple[np.ndarray, ...]:
    """Edges of equal bins over K; bins: number per axis. The outer edges are the domain, exactly. Raises InputError."""
    bins = tuple(int(b) for b in np.atleast_1d(bins))
    if len(bins) != domain.n or min(bins) < 1:
        raise InputError(f"bins: expected {domain.n} numbers >= 1, one per axis of K; got {bins}.")
    edges = []
    for lo, hi, count in zip(domain.lo, domain.hi, bins, strict=True):
        edge = np.linspace(lo, hi, count + 1)
        edge[0], edge[-1] = lo, hi
        edges.append(edge)
    return tuple(edges)


def training_shape(net: ReLUNetwork, train: RolloutBatch, bins, floor: float = TOLERANCES.shape_floor) -> Tube:
    """Per-bin maxima of the training errors, smoothed over neighbouring bins, plus a floor [m, rad].

    Any shape fixed before the holdout is valid; this one keeps the tube tight. A bin borrows from its neighbours, the
    more the fewer runs it holds; an empty bin far from others takes the maximum over all. Failed runs are left out of
    the shape (never of the claim). Raises InputError when no run is finite.
    """
    k, errors = training_errors(net, train)
    return shape_of(k, errors, train.domain, bins, floor)


def training_errors(net: ReLUNetwork, train: RolloutBatch) -> tuple[np.ndarray, Errors]:
    """Parameters (n, n_k) and errors of the finite runs. Raises InputError when there is none."""
    usable = train.select(~train.failed)
    if usable.n == 0:
        raise InputError("shape: expected at least one finite training run; got none.")
    return usable.k, measure(net, usable)


def shape_of(k: np.ndarray, errors: Errors, domain: Box, bins, floor: float = TOLERANCES.shape_floor) -> Tube:
    """The shape of `training_shape` from measured errors."""
    frame, (interval, final), counts = bin_maxima(k, errors, domain, bins)
    grid = tuple(len(e) - 1 for e in frame.edges)
    return tube(frame.edges, _smooth(interval, counts, grid) + floor, _smooth(final, counts, grid) + floor)


def bin_maxima(k: np.ndarray, errors: Errors, domain: Box, bins) -> tuple[Tube, Errors, np.ndarray]:
    """Largest errors per closed bin: a zero tube with the edges, Errors (n_bins, ...), runs per bin (n_bins,)."""
    edges = uniform_edges(domain, bins)
    n_bins = int(np.prod([len(e) - 1 for e in edges]))
    frame = tube(edges, np.zeros((n_bins, *errors.interval.shape[1:])), np.zeros((n_bins, errors.final.shape[1])))
    numbers = bins_of(frame, k)
    largest = Errors(np.array(frame.interval), np.array(frame.final))
    for column in numbers.T:
        order = np.argsort(column, kind="stable")
        present, first = np.unique(column[order], return_index=True)
        for seen, new in zip(largest, errors, strict=True):
            seen[present] = np.maximum(seen[present], np.maximum.reduceat(new[order], first, axis=0))
    return frame, largest, runs_per_bin(numbers, n_bins)


def runs_per_bin(numbers: np.ndarray, n_bins: int) -> np.ndarray:
    """(n_bins,) runs in each closed bin; numbers (n, c) as from `bins_of`, where a run may name a bin twice."""
    ordered = np.sort(numbers, axis=1)
    first = np.ones_like(ordered, bool)
    first[:, 1:] = ordered[:, 1:] != ordered[:, :-1]
    return np.bincount(ordered[first], minlength=n_bins)


def choose_bins(net: ReLUNetwork, train: RolloutBatch, candidates=None, check: float = 0.3) -> tuple[int, ...]:
    """The fewest bins whose tube is within 5 % of the smallest on a split of the training data, no holdout touched.

    For every candidate the shape comes from the first 1 - check of the runs and its scalar from the rest; size is the
    geometric mean half width over K, time and axes (what passes narrow gaps in most of K counts, not a few bad bins).
    candidates: tuples of bin numbers; default: powers of two per axis, down to _TRUSTED runs per bin on average.
    Raises InputError when fewer than two runs are finite.
    """
    k, errors = training_errors(net, train)
    cut = int(len(k) * (1.0 - check))
    if not 0 < cut < len(k):
        raise InputError(f"choose_bins: expected at least two finite training runs; got {len(k)}.")
    fit, rest = Errors(*(e[:cut] for e in errors)), Errors(*(e[cut:] for e in errors))
    sizes = []
    for bins in default_candidates(train.n_k, cut) if candidates is None else candidates:
        shape = shape_of(k[:cut], fit, train.domain, bins)
        scale = score_errors(rest, shape, k[cut:])[0].max()
        sizes.append((float(np.log(shape.interval * scale).mean()), tuple(bins)))
    smallest = min(sizes)[0]
    return min(
        (bins for size, bins in sizes if size <= smallest + np.log(_WORTH)), key=lambda bins: (np.prod(bins), bins)
    )


def default_candidates(n_k: int, n_runs: int) -> list[tuple[int, ...]]:
    """Powers of two per axis, as long as a bin holds _TRUSTED runs on average."""
    most = max(1, n_runs // _TRUSTED)
    powers = [2**i for i in range(most.bit_length())]
    return [bins for bins in itertools.product(powers, repeat=n_k) if np.prod(bins) <= most]


def _smooth(part: np.ndarray, counts: np.ndarray, grid: tuple[int, ...]) -> np.ndarray:
    """Each bin at least a share of the largest neighbour: half of it for a full bin, all of it for an empty one."""
    values, counts = part.reshape(*grid, -1), counts.reshape(grid)
    around = values
    for axis, size in enumerate(grid):
        padded = np.pad(around, [(1, 1) if a == axis else (0, 0) for a in range(around.ndim)])
        around = np.maximum.reduce([np.take(padded, np.arange(size) + step, axis=axis) for step in range(3)])
    nothing_near = around.max(axis=-1, keepdims=True) == 0
    around = np.where(nothing_near, values.reshape(-1, values.shape[-1]).max(axis=0), around)
    trust = np.minimum(1.0, counts / _TRUSTED)[..., None]
    return np.maximum(values, around * (1.0 - 0.5 * trust)).reshape(part.shape)
