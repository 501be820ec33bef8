"""The trajectory network in plain float64 arrays, the subject of every claim and proof."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, content_hash, product
from parc_jax.common.errors import InputError, SoundnessError


@struct.dataclass
class ReLUNetwork:
    """x -> W_L relu(... relu(W_0 x + b_0) ...) + b_L. Build with `relu_network`, which validates.

    weights: tuple of (out, in) float64. biases: tuple of (out,) float64.
    Hidden neurons are numbered by layer; an activation pattern is a bool vector in that order.
    """

    weights: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]

    @property
    def n_in(self) -> int:
        """Number of inputs n_k."""
        return self.weights[0].shape[1]

    @property
    def n_out(self) -> int:
        """Number of outputs."""
        return self.weights[-1].shape[0]

    @property
    def hidden(self) -> tuple[int, ...]:
        """Widths of the hidden layers."""
        return tuple(b.shape[0] for b in self.biases[:-1])

    @property
    def hash(self) -> str:
        """Content hash of the float64 weights."""
        return content_hash(*self.weights, *self.biases)

    def __repr__(self) -> str:
        if not isinstance(self.weights[0], np.ndarray):
            return f"ReLUNetwork({self.weights!r})"
        hidden = "-".join(map(str, self.hidden)) or "affine"
        return f"ReLUNetwork({self.n_in} -> {hidden} -> {self.n_out}, {self.hash[:8]})"

    def __call__(self, x: jax.Array) -> jax.Array:
        """One input (n_in,) -> (n_out,). Pure; vmap for batches."""
        return forward(self, x)[0]


def forward(net: ReLUNetwork, x: Float[ArrayLike, " n_in"]) -> tuple[jax.Array, jax.Array]:
    """Outputs (n_out,) and activation pattern (n_hidden,) bool of one input x (n_in,). Kernel."""
    active = [jnp.zeros(0, bool)]
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        z = product(W, x) + b
        active.append(z > 0)
        x = jnp.maximum(z, 0)
    return product(net.weights[-1], x) + net.biases[-1], jnp.concatenate(active)


def relu_network(weights: Sequence, biases: Sequence) -> ReLUNetwork:
    """Validated network from lists of (out, in) weights and (out,) biases. Raises InputError."""
    if len(weights) != len(biases) or not weights:
        raise InputError(
            f"network: expected a bias per weight, at least one; got {len(biases)}, {len(weights)}."
        )
    weights = tuple(as_float64(f"weights[{i}]", W, (None, None)) for i, W in enumerate(weights))
    pairs = enumerate(zip(weights, biases, strict=True))
    biases = tuple(as_float64(f"biases[{i}]", b, W.shape[:1]) for i, (W, b) in pairs)
    for i, (first, second) in enumerate(itertools.pairwise(weights)):
        if second.shape[1] != first.shape[0]:
            raise InputError(
                f"network: expected weights[{i + 1}] to take the {first.shape[0]} outputs of layer "
                f"{i}; got {second.shape[1]} columns."
            )
    return ReLUNetwork(weights, biases)


def features(
    weights: Sequence[np.ndarray], biases: Sequence[np.ndarray], x: np.ndarray
) -> np.ndarray:
    """Values (n, width) after the given hidden layers at inputs x (n, n_in), on the host."""
    for W, b in zip(weights, biases, strict=True):
        x = np.maximum(x @ W.T + b, 0.0)
    return x


def outputs(net: ReLUNetwork, k: np.ndarray, rows: slice | np.ndarray = slice(None)) -> np.ndarray:
    """Outputs (n, n_out) at k (n, n_k) on the host in float64. rows: of outputs, all by default."""
    h = features(net.weights[:-1], net.biases[:-1], k)
    return h @ net.weights[-1][rows].T + net.biases[-1][rows]


# [1] largest difference of folded and unfolded outputs, relative to their size
FOLD_RELATIVE = 1e-10
STILL = 1e-6  # [size] a parameter that varies by less, as of a rounding, would be lost by `fold`
Layers = Sequence[np.ndarray | jax.Array]


class Normalisation(NamedTuple):
    """Affine scalings in and out. x_mean, x_scale: (n_k,); y_mean, y_scale: (n_out,)."""

    x_mean: np.ndarray
    x_scale: np.ndarray
    y_mean: np.ndarray
    y_scale: np.ndarray

    @classmethod
    def of(
        cls, k: np.ndarray, y: np.ndarray, n_p_outputs: int, names: Sequence[str] = ()
    ) -> "Normalisation":
        """Statistics of k (n, n_k), y (n, n_out). All workspace outputs share one scale: metres
        stay comparable. names: of parameters. Raises InputError when one of them does not vary.
        """
        x_scale = k.std(axis=0)
        if (still := x_scale <= STILL * np.abs(k).max(axis=0)).any():
            axis = int(np.argmax(still))
            named = f"axis {axis} ({names[axis]})" if names else f"axis {axis}"
            raise InputError(
                f"train: expected k to vary; {named} is constant. Leave it out, or shift its zero."
            )
        spread = y.std(axis=0)
        scale = np.where(spread > 0, spread, 1.0)
        scale[:n_p_outputs] = np.sqrt((spread[:n_p_outputs] ** 2).mean()) or 1.0
        return cls(k.mean(axis=0), x_scale, y.mean(axis=0), scale)

    def inputs(self, k: np.ndarray) -> np.ndarray:
        """Normalised k."""
        return (k - self.x_mean) / self.x_scale

    def outputs(self, y: np.ndarray) -> np.ndarray:
        """Normalised y."""
        return (y - self.y_mean) / self.y_scale


def fold(weights: Layers, biases: Layers, norm: Normalisation) -> ReLUNetwork:
    """The float64 network on raw units equal to y_mean + y_scale * net((k - x_mean) / x_scale).

    weights: list of (out, in), biases: list of (out,), hidden ReLU. The equality is checked on
    random inputs first; a difference above FOLD_RELATIVE raises SoundnessError.
    """
    weights = [np.array(W, np.float64) for W in weights]
    biases = [np.array(b, np.float64) for b in biases]
    plain = ReLUNetwork(tuple(map(np.asarray, weights)), tuple(map(np.asarray, biases)))
    weights[-1] = norm.y_scale[:, None] * weights[-1]
    biases[-1] = norm.y_scale * biases[-1] + norm.y_mean
    weights[0] = weights[0] / norm.x_scale
    biases[0] = biases[0] - weights[0] @ norm.x_mean
    net = relu_network(weights, biases)
    x = np.random.default_rng(0).uniform(-2, 2, (512, len(norm.x_mean)))
    expected = norm.y_mean + norm.y_scale * outputs(plain, x)
    got = outputs(net, norm.x_mean + norm.x_scale * x)
    gap = np.abs(expected - got).max() / max(1.0, np.abs(expected).max())
    if not gap <= FOLD_RELATIVE:
        raise SoundnessError(
            f"fold: folded and unfolded networks differ by {gap:.1e} (relative); check scalings."
        )
    return net
