"""Does the claim hold for runs that had no part in it?

No held-out run leaves a tube that all of them have sized, and of random halves one run in half + 1
leaves the tube of the others whatever the robot does: both say nothing. Time says something, since
floor, tyres and battery change: the earlier half sizes a tube and the later one is counted, and the
other way round.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.learning.bound.counts import supported_eps
from parc_jax.learning.bound.measure import scores_of
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from sims.foreign.husky.learn import DELTA


class Unseen(NamedTuple):
    """Two halves in order of time. eps: what one of them supports. runs: in the other. later,
    earlier: of these, how many leave the tube that the other half sizes.
    """

    eps: float
    runs: int
    later: int
    earlier: int


def unseen(net: ReLUNetwork, held: RolloutBatch, profile: Tube) -> Unseen:
    """Size a tube with one half of the held-out runs, count those of the other that leave it."""
    scores = scores_of(net, profile, [held]).score[np.argsort(held.rows)]
    half = len(scores) // 2
    first, last = scores[:half], scores[half:]
    eps = float(supported_eps(half, DELTA, 0))
    later = int((last > first.max()).sum())
    return Unseen(eps, len(last), later, int((first > last.max()).sum()))
