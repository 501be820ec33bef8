"""A profile whose worst bins do not decide about all: for networks that are learned once."""

from collections.abc import Iterable

import numpy as np

from parc_jax.learning.bound.measure import scores_of
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch


def evened(net: ReLUNetwork, profile: Tube, batches: Iterable[RolloutBatch]) -> Tube:
    """The profile, every bin widened by the largest score in it of these runs, if above one.

    Bins without such a run stay as they are. Failed runs are left out, as of every profile.
    """
    usable = [finite for finite in (batch.finite for batch in batches) if finite.n]
    if not usable:
        return profile
    # before the calibration set, as the profile is, so a claim holds as before [T1]
    scores, factor = scores_of(net, profile, usable), np.ones(profile.n_bins)
    numbers = profile.bins_of(scores.k)
    np.maximum.at(factor, numbers, np.broadcast_to(scores.score[:, None], numbers.shape))
    halves = (half * factor.reshape(-1, *[1] * (half.ndim - 1)) for half in profile.halves)
    return profile.with_halves(*halves)
