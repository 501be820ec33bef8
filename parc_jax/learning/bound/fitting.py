"""A profile of faces that fit the errors: their principal axes beside those of space. [T26]

Directions, centres and half widths are learnt per bin, interval and reference point, and per bin at
the end, from runs that come before the holdout. From there on it is a profile like any other.
"""

from collections.abc import Sequence
from threading import Lock
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.arrays import on_all_cores
from parc_jax.common.errors import InputError
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.bins import Bins
from parc_jax.learning.bound.edges import edges_of, smoothed
from parc_jax.learning.bound.faces import CENTRE_BITS, DIRECTION_BITS, Faces, faces, short
from parc_jax.learning.bound.measure import Errors, allowance, measure_arrays_along, padded_chunks
from parc_jax.learning.bound.profile import runs_per_bin
from parc_jax.learning.bound.tube import Tube, fitted_tube, zero_tube
from parc_jax.learning.network.predict import Layout, layout_of, trajectories
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch

# [mean half width] without it the thinnest faces, which cost least, decide the one number
MARGIN = 0.1
_FEW = 20.0  # [runs] of all of K that say which way the errors of a bin spread, beside its own


def fitted_profile(net: ReLUNetwork, runs: Sequence[RolloutBatch], bins: Bins) -> Tube:
    """The profile of finite runs: between the least and the largest error along every direction,
    in bins of few runs as wide as their neighbours, plus a margin (a tenth of the bin's mean half
    width along every axis; at the end, of the half width there) and a floor [m, rad]. bins: numbers
    or edges per axis of K, as in `edges_of`. Raises InputError, also for no runs.
    """
    if not runs:
        raise InputError("profile: expected at least one finite training run; got none.")
    edges = edges_of(runs[0].domain, bins)
    layout = layout_of(runs[0])
    frame = zero_tube(edges, layout.n_steps, layout.n_c, layout.n_c + runs[0].n_q, layout.n_points)
    numbers = [frame.bins_of(batch.k) for batch in runs]
    counts = sum(runs_per_bin(n, frame.n_bins) for n in numbers)
    directions = _directions(net, layout, runs, numbers, counts)
    least, most = _extremes(net, layout, runs, numbers, directions)
    counts = counts.reshape(frame.grid)
    during, at_end = (
        _between(u, low, high, counts, frames)
        for u, low, high, frames in zip(directions, least, most, (False, True), strict=True)
    )
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
    net: ReLUNetwork,
    layout: Layout,
    runs: Sequence[RolloutBatch],
    numbers: list[np.ndarray],
    counts: np.ndarray,
) -> Errors:
    """Axes and principal axes: interval (n_bins, T, n_points, 2 n_p, n_p), final (n_bins, 2 n_e,
    n_e).
    """
    n_e = layout.n_c + runs[0].n_q
    during = np.zeros((len(counts), layout.n_steps + 1, layout.n_points, layout.n_p))
    at_end = np.zeros((len(counts), n_e))
    knots, end = (_Spread(counts, x, np.zeros((*x.shape, x.shape[-1]))) for x in (during, at_end))
    for batch, bins in zip(runs, numbers, strict=True):
        offsets, q = trajectories(net, layout, batch.k)
        stride = (batch.p.shape[1] - 1) // layout.n_steps
        error = batch.p[:, ::stride] - offsets
        last = np.concatenate([error[:, -1], batch.q - q], axis=1)
        error = error.reshape(batch.n, *during.shape[1:])
        for number in np.unique(bins):
            inside = (bins == number).any(axis=1)
            for spread, seen in ((knots, error[inside]), (end, last[inside])):
                spread.sum[number] += seen.sum(axis=0)
                spread.outer[number] += np.einsum("n...a,n...b->...ab", seen, seen)
    both = _Spread(
        2 * counts, knots.sum[:, :-1] + knots.sum[:, 1:], knots.outer[:, :-1] + knots.outer[:, 1:]
    )
    return Errors(with_principal_axes(both.covariance()), with_principal_axes(end.covariance()))


def with_principal_axes(covariance: np.ndarray) -> np.ndarray:
    """(..., 2 n, n) the axes, then the principal ones, longest first, as short fractions.

    Coordinates of different units are told apart by their own spread, a power of two.
    """
    n = covariance.shape[-1]
    spread = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    unit = np.exp2(np.round(np.log2(np.where(spread > 0, spread, 1.0))))
    _, principal = np.linalg.eigh(covariance / (unit[..., :, None] * unit[..., None, :]))
    rows = short(np.swapaxes(principal, -1, -2)[..., ::-1, :], DIRECTION_BITS)
    axes = np.broadcast_to(np.eye(n), rows.shape)
    return np.concatenate(
        [axes, rows / unit[..., None, :] * unit.max(axis=-1)[..., None, None]], axis=-2
    )


def _extremes(
    net: ReLUNetwork,
    layout: Layout,
    runs: Sequence[RolloutBatch],
    numbers: list[np.ndarray],
    directions: Errors,
) -> tuple[Errors, Errors]:
    """Least and largest error of a bin's runs along its directions; infinite where it has none."""
    least = Errors(*(np.full(u.shape[:-1], np.inf) for u in directions))
    most = Errors(*(np.full(u.shape[:-1], -np.inf) for u in directions))
    slack = allowance(net, runs[0].domain, layout)
    one_at_a_time = Lock()

    def widen(chunk: tuple[RolloutBatch, np.ndarray, np.ndarray]) -> None:
        batch, bins, rows = chunk
        held = batch.k[rows], batch.p[rows], batch.q[rows]
        for own in bins[rows].T:
            along = Errors(*(u[own] for u in directions))
            found = jax.device_get(measure_arrays_along(net, slack, layout, along, *held))
            with one_at_a_time:
                for part in range(len(directions)):
                    np.minimum.at(least[part], own, found.least[part])
                    np.maximum.at(most[part], own, found.most[part])

    pairs = zip(runs, numbers, strict=True)
    on_all_cores(widen, ((b, bins, rows) for b, bins in pairs for rows in padded_chunks(b.n)))
    return least, most


def _between(
    directions: np.ndarray, least: np.ndarray, most: np.ndarray, counts: np.ndarray, frames: bool
) -> Faces:
    """Faces about the middle of what was seen and of no error: a proof that no plan is safe needs
    trajectories that keep to the model. A bin without runs gets all that was seen. counts: (grid).
    """
    least = np.minimum(least, 0.0)
    most = np.maximum(most, 0.0)
    seen = (counts > 0).reshape(-1)
    centre = np.zeros(least.shape)
    half = np.zeros(least.shape)
    centre[seen] = short(0.5 * (least[seen] + most[seen]), CENTRE_BITS)
    half[seen] = np.maximum(most[seen] - centre[seen], centre[seen] - least[seen])
    # neighbours have directions of their own, so a bin that has runs enough goes by these alone
    half = smoothed(half.reshape(*counts.shape, -1), counts, least=0.0).reshape(half.shape)
    found = faces(directions, centre, half, frames)
    half[~seen] = found.half_around(found.box[seen].max(axis=0))[~seen]
    width = half[..., : directions.shape[-1]]
    if not frames:  # all intervals of a bin, point by point
        width = width.mean(axis=1, keepdims=True)
    return found.with_half(half + found.half_around(MARGIN * width + TOLERANCES.profile_floor))
