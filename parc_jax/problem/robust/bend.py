"""How far a ReLU network can be from the mixture of its values at the corners of a box. [T21]

Between corners an affine network mixes. A neuron whose kink passes through the box gives less than
the mixture of its values at the corners, by at most a quarter of how much its input varies over the
box. Neurons that are on, or off, for all k of a bin's executions add nothing.
"""

import itertools
from typing import NamedTuple

import numpy as np

from parc_jax.common.arrays import slices
from parc_jax.learning.network.relu import ReLUNetwork

ROUNDING = 2.0**-40  # of every bound here, far more than the rounding of float64 sums
UP = 1 + 2.0**-20
PARTS = 8192  # that all bins together are looked at in
CHUNK = 256  # of them at once


class _Intervals(NamedTuple):
    """Matrices between lo and hi (b, r, c)."""

    lo: np.ndarray
    hi: np.ndarray

    @property
    def largest(self) -> np.ndarray:
        return np.maximum(np.abs(self.lo), np.abs(self.hi))


def bend_by_bin(net: ReLUNetwork, lo: np.ndarray, hi: np.ndarray, width: np.ndarray) -> np.ndarray:
    """(b, n_out) bound of `bend` for all boxes of full width (n_k,) within bins [lo, hi] (b, n_k).

    Bins are split into parts as fine as the width, or as PARTS allows: a box near one kink is not
    near all others of its bin.
    """
    if not width.any():
        return np.zeros((len(lo), net.n_out))
    counts = _parts(lo, hi, width, max(1, PARTS // len(lo)))
    free = np.maximum(hi - lo - width, 0)  # for the lower corner of such a box
    worst = np.zeros((len(lo), net.n_out))
    for place in itertools.product(*(range(n) for n in counts)):
        first = lo + free * (np.array(place) / counts)
        last = lo + free * ((np.array(place) + 1) / counts)
        pad = ROUNDING * (np.abs(lo) + np.abs(hi))
        for rows in slices(len(lo), CHUNK):
            parts = first[rows] - pad[rows], (last + width + pad)[rows], width
            worst[rows] = np.maximum(worst[rows], bend(net, *parts))
    return worst


def _parts(lo: np.ndarray, hi: np.ndarray, width: np.ndarray, most: int) -> np.ndarray:
    """(n_k,) number of parts along each axis of the boxes, `most` in all."""
    free = np.maximum((hi - lo).max(axis=0) - width, 0)
    wanted = np.ceil(free / np.where(width > 0, width, free + 1)).clip(1, most)
    # an axis without uncertainty is split as finely as the others
    wanted = np.where((width > 0) | (free == 0), wanted, wanted.max())
    counts = np.ones(len(width), int)
    while True:
        axis = int(np.argmax(wanted / counts))
        more = counts + (np.arange(len(width)) == axis)
        if counts[axis] >= wanted[axis] or more.prod() > most:
            return counts
        counts = more


def bend(net: ReLUNetwork, lo: np.ndarray, hi: np.ndarray, width: np.ndarray) -> np.ndarray:
    """(b, n_out) bound, for every box of the given full width (n_k,) within [lo, hi] (b, n_k), of
    the distance of a value from the mixture of the corners' values with the same weights.
    """
    layers = list(zip(net.weights, net.biases, strict=True))
    middle = (lo + hi) / 2
    half = (hi - lo) / 2 * UP
    least, most = lo, hi
    n_k = lo.shape[1]
    identity = np.broadcast_to(np.eye(n_k), (len(lo), n_k, n_k))
    slope = _Intervals(identity, identity)
    gaps, slopes = [], []
    for W, b in layers[:-1]:
        slope = _product(_Intervals(W[None], W[None]), slope)
        middle = middle @ W.T + b
        # bounds of the input: from those of the layer before, and from the slope
        size = np.abs(W) @ np.maximum(np.abs(least), np.abs(most))[..., None]
        pad = ROUNDING * (size[..., 0] + np.abs(b))
        plus, minus = np.maximum(W, 0), np.minimum(W, 0)
        below = least @ plus.T + most @ minus.T + b - pad
        above = most @ plus.T + least @ minus.T + b + pad
        off = (slope.largest @ half[..., None])[..., 0] * UP + pad
        below, above = np.maximum(below, middle - off), np.minimum(above, middle + off)
        varies = np.minimum((slope.largest @ width) * UP, above - below)
        # a kink lies at most a quarter of the variation below the mixture of the ends, and no
        # deeper than the input reaches to either side of it
        gap = np.minimum(varies / 4, np.minimum(-below, above))
        gaps.append(np.maximum(gap, 0) * UP)
        on, off_ = below >= 0, above <= 0
        slopes.append(_Intervals(np.where(on, 1.0, 0.0), np.where(off_, 0.0, 1.0)))
        slope = _masked(slope, slopes[-1], rows=True)
        least, most, middle = (np.maximum(x, 0) for x in (below, above, middle))
    # backwards: the gap of each neuron times the slopes of all that comes after it
    more = less = np.zeros((len(lo), net.n_out))
    if not gaps:
        return more
    W = layers[-1][0]
    after = _Intervals(*(np.broadcast_to(W, (len(lo), *W.shape)),) * 2)
    for depth in range(len(gaps) - 1, -1, -1):
        gap = gaps[depth][..., None]
        less = less + (np.maximum(after.hi, 0) @ gap)[..., 0]
        more = more + (np.maximum(-after.lo, 0) @ gap)[..., 0]
        if depth:
            W = layers[depth][0]
            after = _product(
                _masked(after, slopes[depth], rows=False), _Intervals(W[None], W[None])
            )
    return np.maximum(more, less) * UP


def _product(a: _Intervals, b: _Intervals) -> _Intervals:
    """Bounds of all products: by middle and radius, rounded outward."""
    ma, mb = (a.lo + a.hi) / 2, (b.lo + b.hi) / 2
    ra, rb = (a.hi - a.lo) / 2, (b.hi - b.lo) / 2
    middle = ma @ mb
    size = np.abs(ma) @ np.abs(mb)
    radius = (np.abs(ma) @ rb + ra @ np.abs(mb) + ra @ rb) * UP + ROUNDING * size
    return _Intervals(middle - radius, middle + radius)


def _masked(a: _Intervals, by: _Intervals, rows: bool) -> _Intervals:
    """Rows (or columns) multiplied by numbers between 0 and 1."""
    low, high = (x[:, :, None] if rows else x[:, None, :] for x in by)
    ends = [x * y for x in a for y in (low, high)]
    return _Intervals(np.minimum.reduce(ends), np.maximum.reduce(ends))
