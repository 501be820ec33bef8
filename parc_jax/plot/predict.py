"""What the model says of a few plans, on the host: pictures need no compiled kernels."""

from typing import NamedTuple

import numpy as np

from parc_jax.model import TrajectoryModel


class Predicted(NamedTuple):
    """path (n, T + 1, n_p) [m], q (n, n_q), error (n, T, n_p) [m]: predicted paths, goal states, tubes around them."""

    path: np.ndarray
    q: np.ndarray
    error: np.ndarray


def predicted(model: TrajectoryModel, plans: np.ndarray) -> Predicted:
    """Paths and tubes of plans (n, n_p + n_k) over (p0, k), in float64, for drawing and not for verdicts."""
    n_p, T = model.n_p, model.time.n_steps
    p0, k = plans[:, :n_p], plans[:, n_p:]
    x = k
    for W, b in zip(model.net.weights[:-1], model.net.biases[:-1], strict=True):
        x = np.maximum(x @ W.T + b, 0)
    y = x @ model.net.weights[-1].T + model.net.biases[-1]
    offsets = np.concatenate([np.zeros((len(k), 1, n_p)), y[:, : T * n_p].reshape(len(k), T, n_p)], axis=1)
    return Predicted(p0[:, None] + offsets, y[:, T * n_p :], model.tube.interval[model.tube.bin_of(k)])
