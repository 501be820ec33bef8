"""Networks by settings: several seeds or an affine map."""

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.options import Options, check_count
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.runs.batch import RolloutBatch


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

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rollouts < 20:
            raise InputError(f"rollouts: expected at least 20 training runs; got {self.rollouts}.")
        check_count("seeds", self.seeds, 1, "1 for a single network")
        check_count("steps", self.steps, 1, "3000, the default")


def fit(data: RolloutBatch, settings: Training, key: jax.Array) -> ReLUNetwork:
    """The network of the training runs `data`. Raises InputError."""
    from parc_jax.learning.network.train import train, training_arrays  # flax and optax

    if not settings.hidden:
        return fit_affine(*training_arrays(data))
    return train(data, settings.hidden, key=key, seeds=settings.seeds, steps=settings.steps)


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
