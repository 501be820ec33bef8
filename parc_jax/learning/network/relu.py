"""The trajectory network in plain float64 arrays: what every claim and every proof is about."""

import itertools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, content_hash, product
from parc_jax.common.errors import InputError


@struct.dataclass
class ReLUNetwork:
    """x -> W_L relu(... relu(W_0 x + b_0) ...) + b_L. Build with `relu_network`, which validates.

    weights: tuple of (out, in) float64. biases: tuple of (out,) float64.
    Hidden neurons are numbered layer by layer; an activation pattern is a bool vector in that
    order.
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
        return forward(self.weights, self.biases, x)[0]


def forward(
    weights: Sequence[ArrayLike], biases: Sequence[ArrayLike], x: Float[ArrayLike, " n_in"]
) -> tuple[jax.Array, jax.Array]:
    """Outputs (n_out,) and activation pattern (n_hidden,) bool of one input x (n_in,). Kernel."""
    active = [jnp.zeros(0, bool)]
    for W, b in zip(weights[:-1], biases[:-1], strict=True):
        z = product(W, x) + b
        active.append(z > 0)
        x = jnp.maximum(z, 0)
    return product(weights[-1], x) + biases[-1], jnp.concatenate(active)


def relu_network(weights: Sequence, biases: Sequence) -> ReLUNetwork:
    """Validated network from lists of (out, in) weights and (out,) biases. Raises InputError."""
    if len(weights) != len(biases) or not weights:
        raise InputError(
            f"network: expected one bias per weight, at least one; got {len(biases)} and "
            f"{len(weights)}."
        )
    weights = tuple(as_float64(f"weights[{i}]", W, (None, None)) for i, W in enumerate(weights))
    rows = [W.shape[0] for W in weights]
    biases = tuple(
        as_float64(f"biases[{i}]", b, (n,))
        for i, (n, b) in enumerate(zip(rows, biases, strict=True))
    )
    for i, (first, second) in enumerate(itertools.pairwise(weights)):
        if second.shape[1] != first.shape[0]:
            raise InputError(
                f"network: expected weights[{i + 1}] to take the {first.shape[0]} outputs of layer "
                f"{i}; got {second.shape[1]} columns."
            )
    return ReLUNetwork(weights, biases)
