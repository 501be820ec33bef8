"""How error spreads over time, axes and K: a tube's profile, learnt before the holdout is seen.

One number scales all of a profile, so the bin that was learnt worst, say where the robot jumps,
decides how wide all the others become. Runs held back show what each bin lacks, and make it even.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.bins import Bins, Edges
from parc_jax.learning.bound.edges import choose_edges, edges_of, smoothed
from parc_jax.learning.bound.measure import Errors, measure
from parc_jax.learning.bound.score import scores_of
from parc_jax.learning.bound.tube import Tube, tube, zero_tube
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch

SHARE = 4  # one run of so many of those for the profile is held back


def training_errors(net: ReLUNetwork, train: RolloutBatch) -> tuple[np.ndarray, Errors]:
    """Parameters (n, n_k) and errors of the finite runs. Raises InputError when there is none."""
    usable = train.finite
    if usable.n == 0:
        raise InputError("profile: expected at least one finite training run; got none.")
    return usable.k, measure(net, usable)


def profile_of(
    k: np.ndarray,
    errors: Errors,
    domain: Box,
    bins: Bins | None = None,
    n_points: int = 1,
    floor: float = TOLERANCES.profile_floor,
) -> Tube:
    """Per-bin maxima of measured, finite errors of k (n, n_k), smoothed over neighbours, plus a
    floor [m, rad]; n_points: reference points whose coordinates are the columns of the errors.

    Any profile fixed before the holdout is valid; this one keeps the tube tight. A bin borrows from
    its neighbours, the more the fewer runs it holds; an empty bin far from others takes the maximum
    over all. bins: numbers per axis, edges per axis, or None = edges where the error changes.
    """
    edges = choose_edges(k, errors, domain, floor) if bins is None else edges_of(domain, bins)
    empty, largest, counts = bin_maxima(k, errors, edges)
    widths = [
        smoothed(part.reshape(*empty.grid, -1), counts.reshape(empty.grid)).reshape(part.shape)
        for part in largest
    ]
    return tube(empty.edges, widths[0] + floor, widths[1] + floor, n_points)


def bin_maxima(k: np.ndarray, errors: Errors, edges: Edges) -> tuple[Tube, Errors, np.ndarray]:
    """Of closed bins: a zero tube, largest errors (n_bins, ...), numbers of runs (n_bins,)."""
    empty = zero_tube(edges, *errors.interval.shape[1:], errors.final.shape[1])
    numbers = empty.bins_of(k)
    largest = Errors(np.array(empty.interval), np.array(empty.final))
    for column in numbers.T:
        order = np.argsort(column, kind="stable")
        present, first = np.unique(column[order], return_index=True)
        for seen, new in zip(largest, errors, strict=True):
            seen[present] = np.maximum(
                seen[present], np.maximum.reduceat(new[order], first, axis=0)
            )
    return empty, largest, runs_per_bin(numbers, empty.n_bins)


def runs_per_bin(numbers: np.ndarray, n_bins: int) -> np.ndarray:
    """(n_bins,) runs in each closed bin; numbers (n, c) of `bins_of` may name a bin twice."""
    ordered = np.sort(numbers, axis=1)
    return np.bincount(ordered[np.diff(ordered, axis=1, prepend=-1) > 0], minlength=n_bins)


def learnt_from(batches: Iterator[RolloutBatch], n: int) -> Iterator[RolloutBatch]:
    """The batches of the first runs, as many as a profile is learnt from that is made even with the
    rest of n runs; these are left in the iterator.
    """
    left = n - n // SHARE
    while left > 0:
        batch = next(batches, None)
        if batch is None:
            return
        left -= batch.n
        yield batch


def evened(
    nets: list[ReLUNetwork], profiles: list[Tube], batches: Iterable[RolloutBatch]
) -> list[Tube]:
    """The profiles, every bin grown by the largest score in it of these runs, if above one. They
    come before the holdout, as the profiles do, so a claim holds as it did. [T1]

    Bins without such a run stay as they are. Failed runs are left out, as of every profile.
    """
    usable = [batch.finite for batch in batches]
    usable = [batch for batch in usable if batch.n]
    if not usable:
        return profiles
    seen = scores_of(nets, profiles, usable)
    return [_grown(profile, s.k, s.score) for profile, s in zip(profiles, seen, strict=True)]


def _grown(profile: Tube, k: np.ndarray, score: np.ndarray) -> Tube:
    factor = np.ones(profile.n_bins)
    numbers = profile.bins_of(k)
    np.maximum.at(factor, numbers, np.broadcast_to(score[:, None], numbers.shape))
    halves = (half * factor.reshape(-1, *[1] * (half.ndim - 1)) for half in profile.halves)
    return profile.with_halves(*halves)
