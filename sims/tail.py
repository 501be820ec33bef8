"""A network's last layer, refitted to the largest errors, which decide the width of a tube."""

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.network.relu import ReLUNetwork, features, relu_network
from parc_jax.learning.network.train import training_arrays
from parc_jax.learning.runs.batch import RolloutBatch

ROUNDS = 40
RIDGE = 1e-9  # [mean feature power] keeps dead and twin features from making the solve singular
# [largest error of the output] smaller errors count as this large, so that weights never vanish
LIGHTEST = 1e-3


def fit_tail(net: ReLUNetwork, data: RolloutBatch, power: float = 8.0) -> ReLUNetwork:
    """The network, its last layer refitted: by output, the sum of |error|^power is made small.

    data: the training runs and no others, since calibration runs must be fresh. power: 2 is least
    squares; 8 is close to the midrange and still smooth. Damped reweighted least squares;
    an output without a gain retains its row. Raises InputError for a power below 2.
    """
    if not power >= 2:
        raise InputError(f"fit_tail: expected a power of at least 2 (least squares); got {power}.")
    k, y = training_arrays(data)
    hidden = features(net.weights[:-1], net.biases[:-1], k)
    rows = np.concatenate([hidden, np.ones((len(k), 1))], axis=1)
    size = np.abs(rows).max(axis=0)
    size = np.where(size > 0, size, 1.0)
    rows = rows / size
    old = np.concatenate([net.weights[-1], net.biases[-1][:, None]], axis=1)
    new = _reweighted(rows, y, old * size, power) / size
    better = _loss(rows, y, new * size, power) < _loss(rows, y, old * size, power)
    last = np.where(better[:, None], new, old)
    return relu_network([*net.weights[:-1], last[:, :-1]], [*net.biases[:-1], last[:, -1]])


def _reweighted(rows: np.ndarray, y: np.ndarray, last: np.ndarray, power: float) -> np.ndarray:
    """Rows (m, a) after ROUNDS damped steps of weighted least squares; rows (n, a), y (n, m)."""
    n, a = rows.shape
    products = (rows[:, :, None] * rows[:, None, :]).reshape(n, a * a)
    for _ in range(ROUNDS):
        error = y - rows @ last.T
        relative = np.abs(error) / np.maximum(np.abs(error).max(axis=0), np.finfo(float).tiny)
        weight = np.maximum(relative, LIGHTEST) ** (power - 2)
        gram = (weight.T @ products).reshape(-1, a, a)
        gram += RIDGE * np.trace(gram, axis1=1, axis2=2)[:, None, None] / a * np.eye(a)
        # a full step overshoots for powers above 2; 1 / (power - 1) of it is Newton's step
        step = np.linalg.solve(gram, ((weight * error).T @ rows)[:, :, None])[:, :, 0]
        last = last + step / (power - 1)
    return last


def _loss(rows: np.ndarray, y: np.ndarray, last: np.ndarray, power: float) -> np.ndarray:
    """(m,) power means of the errors."""
    error = np.abs(y - rows @ last.T)
    largest = np.maximum(error.max(axis=0), np.finfo(float).tiny)
    return largest * ((error / largest) ** power).mean(axis=0) ** (1 / power)
