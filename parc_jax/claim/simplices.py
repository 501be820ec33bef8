"""Cutting convex regions of K into small simplices that share their vertices."""

import math
from typing import NamedTuple

import numpy as np

from parc_jax.errors import InputError, SoundnessError
from parc_jax.sets.box import Box
from parc_jax.sets.qhull import delaunay

# [1] how far the volumes of the simplices may be from that of K and still count as filling it
_VOLUME_RELATIVE = 1e-9


class Simplices(NamedTuple):
    """points: (m, n_k) all vertices, each once. corners: (s, n_k + 1) indices into points. longest:
    (s,) edges.
    """

    points: np.ndarray
    corners: np.ndarray
    longest: np.ndarray


def triangulate(vertices: list[np.ndarray], domain: Box, size: float) -> Simplices:
    """Simplices that fill K, each inside one of the convex regions given by their vertices (v,
    n_k).

    size: longest edge, as a share of the widths of K (edges are measured in those units while
        cutting).
    Raises InputError; SoundnessError when the volumes do not add up to that of K.
    """
    if not 0 < size:
        raise InputError(f"cover: expected a size > 0; got {size}.")
    width = np.where(domain.hi > domain.lo, domain.hi - domain.lo, 1.0)
    parts = [
        part for region in vertices for part in _delaunay(np.asarray(region, np.float64), width)
    ]
    simplices = np.concatenate(parts)
    filled = np.abs(
        np.linalg.det((simplices[:, 1:] - simplices[:, :1]) / width)
    ).sum() / math.factorial(domain.n)
    if abs(filled - 1.0) > _VOLUME_RELATIVE:
        raise SoundnessError(
            f"cover: the simplices fill {filled:.12f} of K, not all of it; the regions are "
            "incomplete."
        )
    simplices = _halve_until(simplices, width, size)
    points, index = np.unique(simplices.reshape(-1, domain.n), axis=0, return_inverse=True)
    corners = index.reshape(len(simplices), domain.n + 1)
    edges = simplices[:, :, None] - simplices[:, None]
    return Simplices(points, corners, np.sqrt((edges**2).sum(axis=-1).max(axis=(1, 2))))


def _delaunay(region: np.ndarray, width: np.ndarray) -> list[np.ndarray]:
    """Simplices (s, n + 1, n) of one convex region."""
    n = region.shape[1]
    if n == 1:
        return [np.array([[region.min(axis=0), region.max(axis=0)]])]
    if len(region) == n + 1:
        return [region[None]]
    # Joggled input would move vertices; scaling by the widths of the region keeps thin ones well
    # shaped instead
    scaled = (region - region.min(axis=0)) / np.maximum(np.ptp(region, axis=0), 1e-300 * width)
    corners = delaunay(scaled, "Qbb Qc Qz Q12")
    if corners is None:
        raise SoundnessError(
            "simplices: Qhull could not cut a region of K; please report the model."
        )
    return [region[corners]]


def _halve_until(simplices: np.ndarray, width: np.ndarray, size: float) -> np.ndarray:
    """Cut the longest edge of every simplex in two until none is longer than `size`."""
    done = []
    while len(simplices):
        scaled = simplices / width
        length = ((scaled[:, :, None] - scaled[:, None]) ** 2).sum(axis=-1)
        flat = length.reshape(len(simplices), -1)
        large = flat.max(axis=1) > size**2
        done.append(simplices[~large])
        simplices = simplices[large]
        longest = flat[large].argmax(axis=1)
        rows = np.arange(len(simplices))
        i, j = np.divmod(longest, simplices.shape[1])
        middle = 0.5 * (simplices[rows, i] + simplices[rows, j])
        left = simplices.copy()
        right = simplices.copy()
        left[rows, i] = middle
        right[rows, j] = middle
        simplices = np.concatenate([left, right])
    return np.concatenate(done)
