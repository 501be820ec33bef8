"""Bounds of a network's rounding errors, and of its outputs over a box of parameters."""

import itertools
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


PIECES = 4096  # of the box, at most: bounds are tighter on smaller boxes
ROUNDINGS = 4  # [error of an evaluation] both sums of a bound


def outputs_within(
    net: ReLUNetwork, domain: Box, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """lo, hi (pieces, len(rows)) of these outputs over the pieces of a domain, with rounding."""
    lo, hi = over_pieces(net, domain, PIECES, net.weights[-1][rows], net.biases[-1][rows])
    off = ROUNDINGS * rounding_bound(net, domain).error[rows]
    return lo - off, hi + off


def over_pieces(
    net: ReLUNetwork, domain: Box, pieces: int, W: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """lo, hi (pieces, len(b)) of outputs W, b of the last hidden layer over the pieces of a domain,
    at most so many, alike along all axes; up to rounding.

    Layer by layer in intervals: bounds, and seldom the best ones.
    """
    each = int(pieces ** (1 / len(domain.lo)))
    edges = [np.linspace(a, b, each + 1) for a, b in zip(domain.lo, domain.hi, strict=True)]
    sides = [e[:-1] for e in edges], [e[1:] for e in edges]
    lo, hi = (np.array(list(itertools.product(*side))) for side in sides)
    for layer in zip(net.weights[:-1], net.biases[:-1], strict=True):
        lo, hi = (np.maximum(side, 0.0) for side in _affine(*layer, lo, hi))
    return _affine(W, b, lo, hi)


def _affine(W: np.ndarray, b: np.ndarray, lo: np.ndarray, hi: np.ndarray):
    """Bounds on W x + b over boxes of x, lo and hi (s, n)."""
    up, down = np.maximum(W, 0.0).T, np.minimum(W, 0.0).T
    return lo @ up + hi @ down + b, hi @ up + lo @ down + b
