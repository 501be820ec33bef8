"""The shape of a tube: how error is spread over time, axes and K, learnt before the holdout is seen."""

import itertools

import numpy as np

from parc_jax.error.measure import measure
from parc_jax.error.score import bins_of, score_batch
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.sets.box import Box
from parc_jax.tolerances import TOLERANCES

_TRUSTED = 20  # runs in a bin above which its own maximum counts more than its neighbours'


def uniform_edges(domain: Box, bins) -> tuple[np.ndarray, ...]:
    """Edges of equal bins over K; bins: number per axis. The outer edges are the domain, exactly."""
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
    more the
    fewer runs it holds; an empty bin takes the maximum over all. Failed runs are left out of the shape (never of the
    claim).
    """
    edges = uniform_edges(train.domain, bins)
    usable = train.select(~train.failed)
    if usable.n == 0:
        raise InputError("shape: expected at least one finite training run; got none.")
    errors = measure(net, usable)
    grid = tuple(len(e) - 1 for e in edges)
    empty = tube(
        edges, np.zeros((np.prod(grid), *errors.interval.shape[1:])), np.zeros((np.prod(grid), errors.final.shape[1]))
    )
    numbers = bins_of(empty, usable.k)
    parts = [maxima(part, numbers, empty.n_bins) for part in (errors.interval, errors.final)]
    counts = np.bincount(numbers[:, 0], minlength=empty.n_bins)
    interval, final = (_smooth(part, counts, grid) + floor for part in parts)
    return tube(edges, interval, final)


def maxima(errors: np.ndarray, numbers: np.ndarray, n_bins: int) -> np.ndarray:
    """Per-bin maxima (n_bins, ...) of errors (n, ...); numbers (n, c) = bins of each run. Zero for an empty bin."""
    out = np.zeros((n_bins, *errors.shape[1:]))
    for column in numbers.T:
        np.maximum.at(out, column, errors)
    return out


def choose_bins(net: ReLUNetwork, train: RolloutBatch, candidates=None, check: float = 0.3) -> tuple[int, ...]:
    """The bin numbers whose tube is smallest on a split of the training data; the holdout is not touched.

    For every candidate the shape comes from the first 1 - check of the runs and its scalar from the rest; size is the
    geometric
    mean half width over K, time and axes (what passes narrow gaps in most of K counts, not a few bad bins).
    candidates: tuples of bin numbers; default: powers of two per axis, up to _TRUSTED runs per bin on average.
    """
    cut = max(1, int(train.n * (1.0 - check)))
    if cut >= train.n:
        raise InputError(f"choose_bins: expected at least two training runs; got {train.n}.")
    fit, rest = train.select(slice(0, cut)), train.select(slice(cut, None))
    rest = rest.select(~rest.failed)
    if candidates is None:
        candidates = default_candidates(train.n_k, cut)
    sizes = [(_size(net, fit, rest, bins), bins) for bins in candidates]
    return min(sizes)[1]


def default_candidates(n_k: int, n_runs: int) -> list[tuple[int, ...]]:
    """Powers of two per axis, as long as a bin holds _TRUSTED runs on average."""
    most = max(1, n_runs // _TRUSTED)
    powers = [2**i for i in range(most.bit_length())]
    return [bins for bins in itertools.product(powers, repeat=n_k) if np.prod(bins) <= most]


def _size(net, fit, rest, bins) -> float:
    shape = training_shape(net, fit, bins)
    scale = score_batch(net, rest, shape).score.max() if rest.n else 1.0
    return float(np.log(shape.interval * scale).mean())


def _smooth(part: np.ndarray, counts: np.ndarray, grid: tuple[int, ...]) -> np.ndarray:
    """Each bin at least a share of the largest neighbour: half of it for a full bin, all of it for an empty one."""
    values, counts = part.reshape(*grid, -1), counts.reshape(grid)
    known = np.where(counts[..., None] > 0, values, 0.0)
    around = known
    for axis in range(len(grid)):
        padded = np.pad(around, [(1, 1) if a == axis else (0, 0) for a in range(around.ndim)])
        shifted = [np.take(padded, np.arange(grid[axis]) + step, axis=axis) for step in range(3)]
        around = np.maximum.reduce(shifted)
    around = np.where(around.max(axis=-1, keepdims=True) > 0, around, values.reshape(-1, values.shape[-1]).max(axis=0))
    trust = np.minimum(1.0, counts / _TRUSTED)[..., None]
    return np.maximum(values, around * (1.0 - 0.5 * trust)).reshape(part.shape)
