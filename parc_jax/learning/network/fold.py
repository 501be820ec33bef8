"""Normalisation, and folding it into float64 weights: the folded network is verified."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.learning.network.predict import outputs
from parc_jax.learning.network.relu import ReLUNetwork, relu_network

# [1] largest difference of folded and unfolded outputs, relative to their size
FOLD_RELATIVE = 1e-10


class Normalisation(NamedTuple):
    """Affine scalings in and out. x_mean, x_scale: (n_k,); y_mean, y_scale: (n_out,)."""

    x_mean: np.ndarray
    x_scale: np.ndarray
    y_mean: np.ndarray
    y_scale: np.ndarray

    @classmethod
    def of(cls, k: np.ndarray, y: np.ndarray, n_p_outputs: int) -> "Normalisation":
        """Statistics of k (n, n_k), y (n, n_out). All workspace outputs share one scale: metres
        stay comparable. Raises InputError when a parameter does not vary at all.
        """
        x_scale = k.std(axis=0)
        if not (x_scale > 0).all():
            raise InputError(
                f"train: expected every parameter to vary; axis {int(np.argmin(x_scale))} is "
                "constant."
            )
        spread = y.std(axis=0)
        scale = np.where(spread > 0, spread, 1.0)
        scale[:n_p_outputs] = np.sqrt((spread[:n_p_outputs] ** 2).mean()) or 1.0
        return cls(k.mean(axis=0), x_scale, y.mean(axis=0), scale)

    def inputs(self, k: np.ndarray) -> np.ndarray:
        """Normalised inputs."""
        return (k - self.x_mean) / self.x_scale

    def outputs(self, y: np.ndarray) -> np.ndarray:
        """Normalised outputs."""
        return (y - self.y_mean) / self.y_scale


def fold(
    weights: Sequence[np.ndarray | jax.Array],
    biases: Sequence[np.ndarray | jax.Array],
    norm: Normalisation,
) -> ReLUNetwork:
    """The float64 network on raw units equal to y_mean + y_scale * net((k - x_mean) / x_scale).

    weights: list of (out, in), biases: list of (out,), hidden ReLU. The equality is checked on
    random inputs first; a difference above FOLD_RELATIVE raises SoundnessError.
    """
    weights = [np.array(W, np.float64) for W in weights]
    biases = [np.array(b, np.float64) for b in biases]
    plain = ReLUNetwork(tuple(weights), tuple(biases))
    weights[-1] = norm.y_scale[:, None] * weights[-1]
    biases[-1] = norm.y_scale * biases[-1] + norm.y_mean
    first = weights[0] / norm.x_scale
    biases[0] = biases[0] - first @ norm.x_mean
    weights[0] = first
    net = relu_network(weights, biases)
    x = np.random.default_rng(0).uniform(-2, 2, (512, len(norm.x_mean)))
    expected = norm.y_mean + norm.y_scale * outputs(plain, x)
    got = outputs(net, norm.x_mean + norm.x_scale * x)
    gap = np.abs(expected - got).max() / max(1.0, np.abs(expected).max())
    if not gap <= FOLD_RELATIVE:
        raise SoundnessError(
            f"fold: folded and unfolded networks differ by {gap:.1e} (relative); check the "
            "scalings."
        )
    return net
