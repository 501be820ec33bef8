"""Error shapes by time, axis and bin of K, from training runs: boxes, or principal faces. [T26]"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial, reduce
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.arrays import in_chunks, slices, x64
from parc_jax.common.errors import InputError
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.bins import Bins, Edges
from parc_jax.learning.bound.edges import edges_of, smoothed
from parc_jax.learning.bound.error_set import CENTRE_BITS, DIRECTION_BITS, Faces, faces, short
from parc_jax.learning.bound.measure import Errors, allowance, chunk_size, extremes_many, measure
from parc_jax.learning.bound.tube import Tube, fitted_tube, tube, zero_tube
from parc_jax.learning.network.predict import layout_of, trajectories
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch

AT_ONCE = 2048  # runs whose errors are held at a time


def largest_errors(net: ReLUNetwork, runs: RolloutBatch, edges: Edges) -> "Maxima":
    """Of the finite runs, of which some are looked at a time: the errors of all at all intervals
    take hundreds of MB. Raises InputError when there is none.
    """
    usable = runs.finite
    if usable.n == 0:
        raise InputError("profile: expected at least one finite training run; got none.")
    parts = (usable.select(rows) for rows in slices(usable.n, AT_ONCE))
    return reduce(joined, (bin_maxima(part.k, measure(net, part), edges) for part in parts), None)


def box_profile(net: ReLUNetwork, runs: Iterable[RolloutBatch], bins: Bins) -> Tube:
    """Half widths along the axes, of finite runs batch by batch; bins as in `edges_of`."""
    found = None
    for batch in runs:
        found = joined(found, largest_errors(net, batch, edges_of(batch.domain, bins)))
    return smooth_profile(found, len(batch.points))


class Maxima(NamedTuple):
    """Of closed bins: a zero tube, largest errors (n_bins, ...), numbers of runs (n_bins,)."""

    empty: Tube
    largest: Errors
    counts: np.ndarray


def joined(one: Maxima | None, other: Maxima) -> Maxima:
    """The maxima of the runs of both, on the same bins."""
    if one is None:
        return other
    largest = Errors(*map(np.maximum, one.largest, other.largest))
    return Maxima(one.empty, largest, one.counts + other.counts)


def smooth_profile(maxima: Maxima, n_points: int, floor: float = TOLERANCES.profile_floor) -> Tube:
    """Per-bin maxima, smoothed over neighbours, plus a floor [m, rad]; n_points: reference points
    whose coordinates are the columns of the errors.

    A bin borrows from its neighbours, the more the fewer runs it holds; an empty bin far from
    others takes the maximum over all.
    """
    # any profile is valid that is fixed before the calibration set is drawn; this one is tight
    empty, largest, counts = maxima
    widths = [
        smoothed(part.reshape(*empty.grid, -1), counts.reshape(empty.grid)).reshape(part.shape)
        for part in largest
    ]
    return tube(empty.edges, widths[0] + floor, widths[1] + floor, n_points)


def bin_maxima(k: np.ndarray, errors: Errors, edges: Edges) -> Maxima:
    """Maxima of the errors of runs with these k (n, n_k)."""
    empty = zero_tube(edges, *errors.interval.shape[1:], errors.final.shape[1])
    numbers = empty.bins_of(k)
    largest = Errors(np.array(empty.interval), np.array(empty.final))
    for column in numbers.T:
        order = np.argsort(column, kind="stable")
        present, first = np.unique(column[order], return_index=True)
        for part, new in zip(largest, errors, strict=True):
            in_bin = np.maximum.reduceat(new[order], first, axis=0)
            part[present] = np.maximum(part[present], in_bin)
    return Maxima(empty, largest, runs_per_bin(numbers, empty.n_bins))


def runs_per_bin(numbers: np.ndarray, n_bins: int) -> np.ndarray:
    """(n_bins,) runs in each closed bin; numbers (n, c) of `bins_of` may name a bin twice."""
    ordered = np.sort(numbers, axis=1)
    return np.bincount(ordered[np.diff(ordered, axis=1, prepend=-1) > 0], minlength=n_bins)


# [mean half width] without it the thinnest faces, which cost least, decide the score
MARGIN = 0.1
_FEW = 20.0  # [runs] weight of all of K in the covariance of a bin


def fitted_profile(
    net: ReLUNetwork, runs: Iterable[RolloutBatch], bins: Bins, turned: bool = True
) -> Tube:
    """The profile of finite runs, at least one, held in memory: between the least and the largest
    error along every direction, in bins of few runs as wide as their neighbours, plus a margin (a
    tenth of the bin's mean half width along every axis; at the end, of the half width there) and a
    floor [m, rad]. bins: as in `edges_of`. turned: principal axes too. Raises InputError.
    """
    runs = list(runs)
    edges = edges_of(runs[0].domain, bins)
    layout = layout_of(runs[0])
    frame = zero_tube(edges, layout.n_steps, layout.n_c, layout.n_c + runs[0].n_q, layout.n_points)
    numbers = [frame.bins_of(batch.k) for batch in runs]
    counts = sum(runs_per_bin(n, frame.n_bins) for n in numbers)
    directions = _directions(net, runs, numbers, counts)
    if not turned:
        directions = Errors(*(u[..., : u.shape[-1], :] for u in directions))
    least, most = _extremes(net, runs, numbers, directions)
    counts = counts.reshape(frame.grid)
    parts = zip(directions, least, most, (False, True), strict=True)
    during, at_end = (_between(u, low, high, counts, frames) for u, low, high, frames in parts)
    return fitted_tube(edges, during, at_end)


class _Spread(NamedTuple):
    """Of each bin's samples: number (n_bins,), sum (n_bins, ..., n), outer (n_bins, ..., n, n)."""

    number: np.ndarray
    sum: np.ndarray
    outer: np.ndarray

    def covariance(self) -> np.ndarray:
        """(n_bins, ..., n, n) about the bin's mean; of few samples, closer to the mean of all."""
        shape = (-1, *[1] * (self.sum.ndim - 1))
        number = np.maximum(self.number, 1.0).reshape(shape)
        mean = self.sum / number
        about = self.outer - (number * mean)[..., :, None] * mean[..., None, :]
        whole = about.sum(axis=0) / max(self.number.sum(), 1.0)
        number = self.number.reshape(*shape, 1)
        return (about + _FEW * whole) / (number + _FEW)


def _directions(
    net: ReLUNetwork, runs: Sequence[RolloutBatch], numbers: list[np.ndarray], counts: np.ndarray
) -> Errors:
    """Axes and principal ones: interval (n_bins, T, m, 2 n_p, n_p), final (n_bins, 2 n_e, n_e)."""
    layout = layout_of(runs[0])
    n_e = layout.n_c + runs[0].n_q
    during = np.zeros((len(counts), layout.n_steps + 1, layout.n_points, layout.n_p))
    at_end = np.zeros((len(counts), n_e))
    knots, end = (_Spread(counts, x, np.zeros((*x.shape, x.shape[-1]))) for x in (during, at_end))
    for batch, bins in zip(runs, numbers, strict=True):
        offsets, q = trajectories(net, layout, batch.k)
        error = batch.p[:, :: batch.time.stride] - offsets
        last = np.concatenate([error[:, -1], batch.q - q], axis=1)
        error = error.reshape(batch.n, *during.shape[1:])
        for number in np.unique(bins):
            inside = (bins == number).any(axis=1)
            for spread, sample in ((knots, error[inside]), (end, last[inside])):
                spread.sum[number] += sample.sum(axis=0)
                spread.outer[number] += np.einsum("n...a,n...b->...ab", sample, sample)
    both = _Spread(
        2 * counts, knots.sum[:, :-1] + knots.sum[:, 1:], knots.outer[:, :-1] + knots.outer[:, 1:]
    )
    return Errors(with_principal_axes(both.covariance()), with_principal_axes(end.covariance()))


def with_principal_axes(covariance: np.ndarray) -> np.ndarray:
    """(..., 2 n, n) the axes, then the principal ones, longest first, as short fractions."""
    n = covariance.shape[-1]
    # coordinates of different units are scaled by their spread, a power of two
    spread = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    unit = np.exp2(np.round(np.log2(np.where(spread > 0, spread, 1.0))))
    _, principal = np.linalg.eigh(covariance / (unit[..., :, None] * unit[..., None, :]))
    rows = short(np.swapaxes(principal, -1, -2)[..., ::-1, :], DIRECTION_BITS)
    axes = np.broadcast_to(np.eye(n), rows.shape)
    return np.concatenate(
        [axes, rows / unit[..., None, :] * unit.max(axis=-1)[..., None, None]], axis=-2
    )


def _extremes(
    net: ReLUNetwork, runs: Sequence[RolloutBatch], numbers: list[np.ndarray], directions: Errors
) -> tuple[Errors, Errors]:
    """Least and largest error of a bin's runs along its directions; infinite where it has none."""
    least = Errors(*(np.full(u.shape[:-1], np.inf) for u in directions))
    most = Errors(*(np.full(u.shape[:-1], -np.inf) for u in directions))
    layout = layout_of(runs[0])
    slack = allowance(net, runs[0].domain, layout)

    def extremes(batch: RolloutBatch, bins: np.ndarray, rows: np.ndarray) -> tuple:
        along = Errors(*(u[bins[rows]] for u in directions))
        held = batch.k[rows], batch.p[rows], batch.q[rows]
        with x64():
            return jax.device_get(extremes_many(net, slack, along, *held, layout=layout))

    for batch, bins in zip(runs, numbers, strict=True):
        for column in bins.T:
            low, high = in_chunks(batch.n, chunk_size(batch.n), partial(extremes, batch, column))
            for part in range(len(directions)):
                np.minimum.at(least[part], column, low[part])
                np.maximum.at(most[part], column, high[part])
    return least, most


def _between(
    directions: np.ndarray, least: np.ndarray, most: np.ndarray, counts: np.ndarray, frames: bool
) -> Faces:
    """Faces about the middle of seen errors and zero; a bin (grid) without runs gets the widest."""
    # zero error belongs to the set: a proof of absence needs trajectories that follow the model
    least, most = np.minimum(least, 0.0), np.maximum(most, 0.0)
    filled = (counts > 0).reshape(-1)
    centre, half = np.zeros((2, *least.shape))
    centre[filled] = short(0.5 * (least[filled] + most[filled]), CENTRE_BITS)
    half[filled] = np.maximum(most[filled] - centre[filled], centre[filled] - least[filled])
    # neighbours have directions of their own, so a bin that has runs enough goes by these alone
    half = smoothed(half.reshape(*counts.shape, -1), counts, least=0.0).reshape(half.shape)
    fitted = faces(directions, centre, half, frames)
    half[~filled] = fitted.half_around(fitted.box[filled].max(axis=0))[~filled]
    width = half[..., : directions.shape[-1]]
    if not frames:  # all intervals of a bin, point by point
        width = width.mean(axis=1, keepdims=True)
    return fitted.with_half(half + fitted.half_around(MARGIN * width + TOLERANCES.profile_floor))


# a new kind of tube: its word and how it is learnt, and a line in `shape_of`
SHAPES: dict[str, Callable[[ReLUNetwork, Iterable[RolloutBatch], Bins], Tube]] = {
    "box": box_profile,
    "signed": partial(fitted_profile, turned=False),
    "fitted": fitted_profile,
}


def shape_of(tube: Tube) -> str:
    """The word of `SHAPES` for a tube."""
    if tube.templates is None:
        return "box"
    rows, n = tube.templates.final.directions.shape[-2:]
    return "signed" if rows == n else "fitted"
