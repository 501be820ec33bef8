"""A trained network as the chain of operations that a file describes, folded into the float64
network we verify.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.learning.network.relu import FOLD_RELATIVE, ReLUNetwork, outputs, relu_network


class Linear(NamedTuple):
    """y = W x + b. W (out, in), b (out,)."""

    W: np.ndarray
    b: np.ndarray


class Scale(NamedTuple):
    """y = factor * x + offset, entry by entry; both (n,) or ()."""

    factor: np.ndarray
    offset: np.ndarray


class Relu(NamedTuple):
    """y = max(x, 0)."""


def apply(chain: list, x: np.ndarray) -> np.ndarray:
    """The chain as it is written, in float64, on inputs (b, n_in)."""
    for step in chain:
        if isinstance(step, Relu):
            x = np.maximum(x, 0)
        elif isinstance(step, Scale):
            x = step.factor * x + step.offset
        else:
            x = x @ step.W.T + step.b
    return x


def fold_chain(chain: list, name: str) -> ReLUNetwork:
    """The ReLU network equal to the chain; scalings before, between and after the layers are folded
    into them.

    The equality is checked on random inputs of several sizes before the network is returned. name:
    of the file, for messages. Raises InputError for a chain that is no network of linear layers and
    ReLU, SoundnessError if the check fails.
    """
    first = next((step for step in chain if isinstance(step, Linear)), None)
    if first is None:
        raise InputError(f"{name}: expected a network with at least one linear layer; found none.")
    n_in = first.W.shape[1]
    weights: list[np.ndarray] = []
    biases: list[np.ndarray] = []
    W, b = np.eye(n_in), np.zeros(n_in)
    fresh = True  # nothing but the identity since the last ReLU
    for step in chain:
        if isinstance(step, Relu):
            if fresh and weights:
                continue  # max(max(x, 0), 0)
            weights, biases, fresh = [*weights, W], [*biases, b], True
            W, b = np.eye(len(b)), np.zeros(len(b))
            continue
        fresh = False
        try:
            if isinstance(step, Scale):
                factor, offset = (np.broadcast_to(v, b.shape) for v in step)
                W, b = factor[:, None] * W, factor * b + offset
            else:
                W, b = step.W @ W, step.W @ b + step.b
        except ValueError as error:
            raise InputError(
                f"{name}: expected each layer to fit the one before it; {error}."
            ) from None
    net = relu_network([*weights, W], [*biases, b])
    x = np.random.default_rng(0).normal(size=(512, n_in)) * np.logspace(-2, 2, 512)[:, None]
    expected, got = apply(chain, x), outputs(net, x)
    gap = (np.abs(expected - got).max(axis=1) / np.maximum(1.0, np.abs(expected).max(axis=1))).max()
    if not gap <= FOLD_RELATIVE:
        raise SoundnessError(
            f"{name}: the folded network differs from the file's by {gap:.1e} (relative)."
        )
    return net
