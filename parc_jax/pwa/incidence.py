"""Which vertices lie on which face, from the boundaries of the faces."""

import numpy as np

from parc_jax.pwa.growable import row_positions

Ragged = tuple[np.ndarray, np.ndarray]  # flat items, and offsets: row i is flat[offsets[i]:offsets[i + 1]]


def face_vertices(boundaries: tuple[Ragged, ...], n_points: int, k: int) -> Ragged:
    """Vertices of all k-faces, each row in increasing order. boundaries[j - 1]: the (j-1)-faces of every j-face."""
    if k == 0:
        return np.arange(n_points), np.arange(n_points + 1)
    flat, offsets = boundaries[0]
    vertices = np.sort(flat.reshape(-1, 2), axis=1).ravel(), offsets
    for j in range(2, k + 1):
        vertices = next_vertices(boundaries[j - 1], vertices, n_points, polygons=j == 2)
    return vertices


def next_vertices(boundary: Ragged, below: Ragged, n_points: int, polygons: bool) -> Ragged:
    """Vertices of the faces with the given boundaries, from the vertices of the faces one dimension down."""
    (sub, rows), (flat, offsets) = boundary, below
    count, bits = len(rows) - 1, n_points.bit_length()
    positions, ends = row_positions(offsets[sub], np.diff(offsets)[sub])
    of_row = np.diff(ends[rows[1:] - 1], prepend=0)
    key = np.repeat(np.arange(count) << bits, of_row) | flat[positions]
    key.sort()
    if polygons:  # a vertex of a polygon lies on exactly two of its edges
        return key[::2] & ((1 << bits) - 1), rows
    key = key[np.flatnonzero(np.diff(key, prepend=-1))]
    return key & ((1 << bits) - 1), np.searchsorted(key, np.arange(count + 1) << bits)
