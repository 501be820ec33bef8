"""A profile made even: every bin wider by what it lacked for runs that it was not learnt from.

One number scales all of a profile, so the bin that was learnt worst, say where the robot jumps,
decides how wide all the others become. Runs held back from the profile show what each bin lacks.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from parc_jax.claim.score import scores_of
from parc_jax.claim.tube import Tube
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch

SHARE = 4  # one run of so many of those for the profile is held back


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
