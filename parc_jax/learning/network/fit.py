"""Networks by settings: several seeds or an affine map, and a last layer for the largest errors."""

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.options import Options
from parc_jax.learning.network.relu import ReLUNetwork, features, relu_network
from parc_jax.learning.runs.batch import RolloutBatch

ROUNDS = 40
RIDGE = 1e-9  # [mean feature power] keeps dead and twin features from making the solve singular
# [largest error of the output] smaller errors count as this large, so that weights never vanish
LIGHTEST = 1e-3


def fit_tail(net: ReLUNetwork, data: RolloutBatch, power: float = 8.0) -> ReLUNetwork:
    """The network, its last layer refitted: by output, the sum of |error|^power is made small.

    data: the training runs and no others, since calibration runs must be fresh. power: 2 is least
    squares; 8 is close to the midrange and still smooth. Damped reweighted least squares;
    an output without a gain retains its row.
    """
    from parc_jax.learning.network.train import training_arrays  # flax and optax

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


@dataclass(frozen=True)
class Training(Options):
    """Settings of training."""

    rollouts: int = 10_000
    """Number of training rollouts."""
    hidden: tuple[int, ...] = (8, 8, 8, 8)
    """Widths of the hidden layers; without any, in Python (), it is PARC's affine map."""
    seeds: int = 6
    """Networks trained, of which the best is kept."""
    steps: int = 3000
    """Training steps."""
    tail: float | None = None
    """Power of the error that the last layer is refitted to, at least 2. Default: least squares."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rollouts < 20:
            raise InputError(f"rollouts: expected at least 20 training runs; got {self.rollouts}.")
        check_count("seeds", self.seeds, 1, "1 for a single network")
        check_count("steps", self.steps, 1, "3000, the default")
        if self.tail is not None and (isinstance(self.tail, str) or not self.tail >= 2):
            raise InputError(f"tail: expected a power of at least 2, or None; got {self.tail!r}.")


def fit(data: RolloutBatch, settings: Training, key: jax.Array) -> ReLUNetwork:
    """The network of the training runs `data`. Raises InputError."""
    from parc_jax.learning.network.train import train, training_arrays  # flax and optax

    if not settings.hidden:
        return fit_affine(*training_arrays(data))
    net = train(data, settings.hidden, key=key, seeds=settings.seeds, steps=settings.steps)
    return net if settings.tail is None else fit_tail(net, data, settings.tail)


def fit_affine(k: Float[np.ndarray, "N n_k"], outputs: Float[np.ndarray, "N n_out"]) -> ReLUNetwork:
    """The affine map k -> C k + d by least squares: a network without hidden layers. [PARC]

    outputs: c_1 ... c_T, q as in `Layout`. N > n_k samples in general position. Raises InputError
    if they do not determine the map.
    """
    k = as_float64("parameters k", k, (None, None))
    outputs = as_float64("trajectory outputs", outputs, (len(k), None))
    middle, spread = k.mean(axis=0), np.ptp(k, axis=0)
    scaled = (k - middle) / np.where(spread > 0, spread, 1.0)
    rows = np.concatenate([scaled, np.ones((len(k), 1))], axis=1)
    solution, _, rank, _ = np.linalg.lstsq(rows, outputs, rcond=None)
    if rank < rows.shape[1]:
        raise InputError(
            f"fit_affine: expected more than {k.shape[1]} samples that vary in all {k.shape[1]} "
            f"parameters; got {len(k)} samples of rank {rank}. Draw k at random from the domain."
        )
    C = solution[:-1].T / spread
    return relu_network([C], [solution[-1] - C @ middle])
