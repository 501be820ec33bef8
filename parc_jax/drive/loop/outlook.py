"""Where candidates lead, for the user's own measure of what is better: no verdict at all."""

from typing import NamedTuple

import numpy as np

from parc_jax.common.arrays import slices
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import outputs
from parc_jax.learning.system import TURNS
from parc_jax.problem.robust.pose import Pose

AT_ONCE = 64  # candidates whose predictions are made at a time


class Outlook(NamedTuple):
    """Predictions of candidates, told in the world; leading axis b.

    k (b, n_k). path (b, T + 1, n_p) [m] of the first reference point at all knots. q (b, n_q): the
    other goal states at the end. heading (b,) [rad] at the end, None where no goal state turns.
    leave: number of the knot from which on a manoeuvre may be left.
    """

    k: np.ndarray
    path: np.ndarray
    q: np.ndarray
    heading: np.ndarray | None
    leave: int


def outlook(model: TrajectoryModel, pose: Pose, k: np.ndarray, leave: int) -> Outlook:
    """What the model's network says of k (b, n_k) from a pose."""
    n_p, n_c, n_steps = model.n_p, model.n_c, model.time.n_steps
    of_first = n_c * np.arange(1, n_steps + 1)[:, None] - n_p + np.arange(n_p)
    rows = np.concatenate([of_first.ravel(), np.arange(model.layout.n_offsets, model.net.n_out)])
    # few rows at a time: for large products BLAS starts threads, which costs more than it saves
    parts = [outputs(model.net, k[some], rows) for some in slices(len(k), AT_ONCE)]
    y = np.concatenate(parts)
    path, q = y[:, : n_p * n_steps].reshape(-1, n_steps, n_p), y[:, n_p * n_steps :]
    path = np.concatenate([np.zeros((len(k), 1, n_p)), path], axis=1)
    if pose.heading is None:
        return Outlook(k, path + pose.place, q, None, leave)
    cosine, sine = np.cos(pose.heading), np.sin(pose.heading)
    x, y = path[..., 0], path[..., 1]
    turned = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    turns = np.array([word == TURNS for word in model.rotation], bool)
    q = q + pose.heading * turns
    heading = q[:, turns.argmax()] if turns.any() else None
    return Outlook(k, turned + pose.place, q, heading, leave)
