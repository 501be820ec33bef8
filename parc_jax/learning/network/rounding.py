"""How far float64 may be from the real-number network, for every input of a box. [T10]"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.sets.box import Box
from parc_jax.learning.network.relu import ReLUNetwork

UNIT = 2.0**-53  # unit round-off of float64
TINY = 2.0**-1022  # smallest normal number: covers flush-to-zero
SAFETY = 1 + 2.0**-10  # pays for evaluating the bound itself in float64


class RoundingBound(NamedTuple):
    """(n_out,) each, over all k of the box: error >= |fl N - N|, magnitude >= |N| and |fl N|."""

    error: np.ndarray
    magnitude: np.ndarray


def rounding_bound(net: ReLUNetwork, domain: Box) -> RoundingBound:
    """Static bound by the recursion of [T10]: sums in any order, fused or not, flushed or not."""
    size = np.maximum(np.abs(domain.lo), np.abs(domain.hi))
    error = np.zeros_like(size)
    for W, b in zip(net.weights, net.biases, strict=True):
        n = W.shape[1]
        gamma = (n + 2) * UNIT / (1 - (n + 2) * UNIT)
        absolute = np.abs(W) @ size + np.abs(b)
        error = (np.abs(W) @ error + gamma * absolute + (n + 2) * TINY) * SAFETY
        size = (absolute + error) * SAFETY
    return RoundingBound(error, size)
