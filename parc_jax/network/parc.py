"""PARC as the simplest trajectory model: one affine map per time step, fitted by least squares over
K.
"""

import numpy as np
from jaxtyping import Float

from parc_jax.base.arrays import as_float64
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork, relu_network


def fit_affine(k: Float[np.ndarray, "N n_k"], outputs: Float[np.ndarray, "N n_out"]) -> ReLUNetwork:
    """The affine map k -> C k + d nearest to the samples in the mean square: a network without
    hidden layers. [PARC]

    k: (N, n_k). outputs: (N, n_out), trajectories in the output layout c_1 ... c_T, q. N > n_k
    samples in general position. It passes through the same stages as any network: one region, one
    activation pattern of length zero.
    Raises InputError if the samples do not determine the map.
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
            "parameters; "
            f"got {len(k)} samples of rank {rank}. Draw k at random from the domain."
        )
    C = solution[:-1].T / spread
    return relu_network([C], [solution[-1] - C @ middle])
