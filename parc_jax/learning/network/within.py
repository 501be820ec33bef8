"""Between which numbers a network's outputs lie, for every input of a box. [T10]"""

import itertools

import numpy as np

from parc_jax.common.sets.box import Box
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.network.rounding import rounding_bound

PIECES = 4096  # of the box, at most: bounds of smaller ones are tighter
ROUNDINGS = 4  # [error of an evaluation] both sums of a bound, which are no longer


def outputs_within(
    net: ReLUNetwork, domain: Box, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """lo, hi (pieces, len(rows)) of these outputs over the pieces of a domain, rounding included.

    Layer by layer in intervals: bounds, and seldom the best ones.
    """
    each = int(PIECES ** (1 / len(domain.lo)))
    edges = [np.linspace(a, b, each + 1) for a, b in zip(domain.lo, domain.hi, strict=True)]
    lo, hi = (
        np.array(list(itertools.product(*side)))
        for side in ([e[:-1] for e in edges], [e[1:] for e in edges])
    )
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        lo, hi = (np.maximum(side, 0.0) for side in _layer(W, b, lo, hi))
    lo, hi = _layer(net.weights[-1][rows], net.biases[-1][rows], lo, hi)
    off = ROUNDINGS * rounding_bound(net, domain).error[rows]
    return lo - off, hi + off


def _layer(W: np.ndarray, b: np.ndarray, lo: np.ndarray, hi: np.ndarray):
    up, down = np.maximum(W, 0.0).T, np.minimum(W, 0.0).T
    return lo @ up + hi @ down + b, hi @ up + lo @ down + b
