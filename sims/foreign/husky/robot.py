"""The recorded robot as a black box: it answers with what it did, and with nothing else."""

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.system import Trajectory
from sims.foreign.husky.log import K_LABELS, NAME, Log, domain, grid, read_log, recorded
from sims.rectangle import POINTS


class Husky:
    """A black box whose runs are those of a log: the k of a recorded command, and no other."""

    name, n_p, n_q, points = NAME, 2, 0, POINTS
    p_labels, k_labels = ("x [m]", "y [m]"), K_LABELS

    def __init__(self, log: Log):
        self.domain = domain()
        self.time = grid()
        self.runs = recorded(log)

    def rollout_batch(self, keys, ks) -> Trajectory:
        """The recorded runs of ks (B, 2) [rad/s]: p (B, n_record + 1, 5, 2) [m]. Raises InputError
        for commands that were never driven.
        """
        del keys
        ks = np.asarray(ks, np.float64)
        same = (ks[:, None, :] == self.runs.k[None]).all(axis=2)
        if not same.any(axis=1).all():
            unknown = ks[np.argmin(same.any(axis=1))]
            raise InputError(
                f"husky: expected the k of a recorded command; {unknown} was never driven, and the "
                "robot is not here to drive it. `parc-jax run husky` learns from its log."
            )
        rows = same.argmax(axis=1)
        p = self.runs.p[rows].reshape(len(ks), -1, len(self.points), self.n_p)
        return Trajectory(p, np.zeros((len(ks), 0)))


def system() -> Husky:
    """The robot of the log that comes with the package. k = (left, right) wheel speeds [rad/s]; p
    (41, 5, 2) of the centre and the corners of its footprint.
    """
    return Husky(read_log())
