"""What the model says of a few plans, on the host: pictures need no compiled kernels."""

from typing import NamedTuple

import numpy as np

from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import moved_to, trajectories


class Predicted(NamedTuple):
    """path (n, T + 1, n_c) [m], q (n, n_q), error (n, T, n_c) [m]: predicted paths of all reference
    points, goal states, tubes around them.
    """

    path: np.ndarray
    q: np.ndarray
    error: np.ndarray


def predicted(model: TrajectoryModel, plans: np.ndarray) -> Predicted:
    """Paths and tubes of plans (n, n_p + n_k) over (p0, k), in float64, for drawing and not for
    verdicts.
    """
    p0, k = plans[:, : model.n_p], plans[:, model.n_p :]
    offsets, q = trajectories(model.net, model.layout, k)
    return Predicted(moved_to(p0, offsets), q, model.tube.widest_at(k)[0])
