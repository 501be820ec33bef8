"""The bins of K: closed boxes between edges along every axis, row-major (last axis fastest).

edges: tuple over the n_k axes of (n_bins_i + 1,) increasing numbers.
"""

import itertools
from collections.abc import Sequence
from fractions import Fraction
from typing import Literal

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common import struct
from parc_jax.common.errors import InputError
from parc_jax.common.shapes import Params

Edges = tuple[np.ndarray, ...]
Bins = Sequence[int] | Sequence[ArrayLike]  # per axis of K: numbers of equal bins, or edges


@struct.dataclass
class Binned:
    """Data by bin of K."""

    edges: Edges

    @property
    def n_k(self) -> int:
        """Number of manoeuvre parameters."""
        return len(self.edges)

    @property
    def grid(self) -> tuple[int, ...]:
        """Number of bins along each axis of K."""
        return tuple(len(e) - 1 for e in self.edges)

    def bin_of(self, k: np.ndarray) -> np.ndarray:
        """Bin number of k (..., n_k), one of the closed bins that contain it; -1 outside K."""
        k = np.asarray(k)
        number = np.zeros(k.shape[:-1], int)
        inside = np.ones(k.shape[:-1], bool)
        for axis, edge in enumerate(self.edges):
            x = k[..., axis]
            inside &= (x >= edge[0]) & (x <= edge[-1])
            number = number * (len(edge) - 1) + _place(edge, x, "right")
        return np.where(inside, number, -1)

    def bins_of(self, k: np.ndarray) -> np.ndarray:
        """(n, c) numbers of all closed bins that contain k (n, n_k); c is 1 unless a row lies
        exactly on an inner edge. Raises InputError for a k outside every bin.
        """
        k = np.asarray(k, np.float64)
        for axis, edge in enumerate(self.edges):
            outside = ~((k[:, axis] >= edge[0]) & (k[:, axis] <= edge[-1]))
            if outside.any():
                row = int(np.argmax(outside))
                raise InputError(
                    f"bins: k row {row} = {k[row]} falls in no bin of axis {axis}, {edge[[0, -1]]}."
                )
        return closed_bins(self.edges, k)

    def bin_box(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Corners lo (n_k,), hi (n_k,) of a bin."""
        sides = list(zip(self.edges, np.unravel_index(number, self.grid), strict=True))
        lo, hi = (np.array([edge[i + side] for edge, i in sides]) for side in (0, 1))
        return lo, hi


def each_bin(edges: Edges, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of a row of k (n, n_k) and a closed bin that contains it: rows (m,), in order, and
    bins (m,). A k outside K is paired with a near bin.
    """
    numbers = np.sort(closed_bins(edges, np.asarray(k, np.float64)), axis=1)
    other = np.diff(numbers, axis=1, prepend=-1) > 0
    return np.nonzero(other)[0], numbers[other]


def closed_bins(edges: Edges, k: np.ndarray) -> np.ndarray:
    """(n, c) as of `Binned.bins_of`, of k inside K."""
    numbers = np.zeros((len(k), 1), int)
    for axis, edge in enumerate(edges):
        right, left = (_place(edge, k[:, axis], side) for side in ("right", "left"))
        choices = [right] if (left == right).all() else [right, left]
        numbers = np.concatenate(
            [numbers * (len(edge) - 1) + choice[:, None] for choice in choices], axis=1
        )
    return numbers


def open_bin_of(edges: Edges, k: Params):
    """`Binned.bin_of` for one k in a kernel, but -1 also on a border between bins. [T28]"""
    # several tubes count on a border, and draws fall there with probability 0
    bin = jnp.asarray(0)
    inside = jnp.asarray(True)
    for axis, given in enumerate(edges):
        edge = jnp.asarray(given)
        along = (k[axis] >= edge[1:-1]).sum()
        on_inner_edge = (k[axis] == edge[1:-1]).any()
        inside &= (k[axis] >= edge[0]) & (k[axis] <= edge[-1]) & ~on_inner_edge
        bin = bin * (len(edge) - 1) + along
    return jnp.where(inside, bin, -1)


def _place(edge: np.ndarray, x: np.ndarray, side: Literal["left", "right"]) -> np.ndarray:
    """Index of the bin of increasing edges that holds x, at an edge the one on this side."""
    return edge[1:-1].searchsorted(x, side)


def block_shares(edges: Edges, block: np.ndarray) -> list[Fraction]:
    """(n_bins,) exact share of K of each bin's block: its probability when k is uniform. [T5]"""
    shares = [Fraction(1)]
    for edge in edges:
        exact = [Fraction(float(x)) for x in edge]
        width = exact[-1] - exact[0]
        parts = [(high - low) / width for low, high in itertools.pairwise(exact)]
        shares = [share * part for share in shares for part in parts]
    whole = [Fraction(0)] * (int(block.max()) + 1)
    for number, share in zip(block, shares, strict=True):
        whole[number] += share
    return [whole[number] for number in block]
