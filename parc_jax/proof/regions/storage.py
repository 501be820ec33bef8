"""Storage of the complex: boolean rows as 64-bit words, arrays growing at the end, ragged rows."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

# numbers of faces take half the memory of the default; `Budget` caps how many there are
NUMBER = np.int32
# entries of ragged rows treated at once: what is worked out for them stays in cache
CHUNK = 1 << 16
# most spare rows of an array that grows
SPARE = 1 << 25

# flat items, and offsets: row i is flat[offsets[i]:offsets[i + 1]]
Ragged = tuple[np.ndarray, np.ndarray]


def pack(rows: np.ndarray) -> np.ndarray:
    """Bool (r, m) -> uint64 (r, words), bit c of word w is column 64 w + c; spare bits are 0."""
    as_bytes = np.packbits(rows, axis=1, bitorder="little")
    words = np.zeros((len(rows), -(-rows.shape[1] // 64) * 8), np.uint8)
    words[:, : as_bytes.shape[1]] = as_bytes
    return words.view("<u8").astype(np.uint64, copy=False)


def unpack(words: np.ndarray, n_columns: int) -> np.ndarray:
    """uint64 (r, words) -> bool (r, n_columns)."""
    as_bytes = np.ascontiguousarray(words.astype("<u8", copy=False)).view(np.uint8)
    return np.unpackbits(as_bytes, axis=1, count=n_columns, bitorder="little").view(bool)


def hash_words(words: np.ndarray) -> np.ndarray:
    """uint64 (r, words) -> (r,): equal rows, equal hash; different rows seldom."""
    factors = np.random.default_rng(0).integers(1, 2**63, words.shape[1], dtype=np.uint64)
    factors |= np.uint64(1)
    return ((words ^ (words >> np.uint64(29))) * factors).sum(axis=1, dtype=np.uint64)


class Growable:
    """A growing array along axis 0: the cost of an append does not depend on the length.

    `view` is the filled part (no copy; invalid after the next append).
    """

    __slots__ = ("data", "n")

    def __init__(self, array: np.ndarray):
        self.data = np.array(array)
        self.n = len(self.data)

    @property
    def view(self) -> np.ndarray:
        """The filled rows."""
        return self.data[: self.n]

    def append(self, rows: np.ndarray) -> None:
        """Add rows at the end; spare rows are not touched, and cost no memory."""
        end = self.n + len(rows)
        if end > len(self.data):
            data = np.empty((end + min(3 * end, SPARE), *self.data.shape[1:]), self.data.dtype)
            data[: self.n] = self.view
            self.data = data
        self.data[self.n : end] = rows
        self.n = end


def row_positions(start: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the concatenated rows [start_i, start_i + size_i) and their ends in the result.

    start, size: (r,) int. Returns positions (sum size,) and ends (r,).
    """
    ends = np.cumsum(size)
    total = ends[-1] if len(ends) else 0
    shift = np.repeat(start - (ends - size), size)
    return np.arange(total) + shift, ends


def or_over_cells(words: np.ndarray, boundaries: Iterable[Ragged]) -> np.ndarray:
    """OR of vertex words (V, m) over each n-face: (r, m). boundaries: of the k-faces, k = 1..n."""
    for flat, offsets in boundaries:
        of_faces = np.empty((len(offsets) - 1, words.shape[1]), words.dtype)
        for first, last in row_chunks(offsets, CHUNK):
            rows = offsets[first:last]
            entries = words.take(flat[rows[0] : offsets[last]], axis=0)
            np.bitwise_or.reduceat(entries, rows - rows[0], axis=0, out=of_faces[first:last])
        words = of_faces
    return words


def face_vertices(boundaries: tuple[Ragged, ...], n_points: int, k: int) -> Ragged:
    """Vertices of all k-faces, each row sorted. boundaries[j - 1]: (j-1)-faces of every j-face."""
    if k == 0:
        return np.arange(n_points), np.arange(n_points + 1)
    flat, offsets = boundaries[0]
    vertices = (np.sort(flat.reshape(-1, 2), axis=1).ravel(), offsets)
    for j in range(2, k + 1):
        vertices = _next_vertices(boundaries[j - 1], vertices, n_points, polygons=j == 2)
    return vertices


def _next_vertices(boundary: Ragged, below: Ragged, n_points: int, polygons: bool) -> Ragged:
    """Vertices of the faces with given boundaries, from those of the faces one dimension down."""
    sub, rows = boundary
    flat, offsets = below
    count = len(rows) - 1
    bits = n_points.bit_length()  # a key is the number of the face, then that of the vertex
    vertex_of = (1 << bits) - 1
    positions, ends = row_positions(offsets[sub], np.diff(offsets)[sub])
    of_row = np.diff(ends[rows[1:] - 1], prepend=0)
    key = np.repeat(np.arange(count) << bits, of_row) | flat[positions]
    key.sort()
    if polygons:  # a vertex of a polygon lies on exactly two of its edges
        return key[::2] & vertex_of, rows
    key = key[np.flatnonzero(np.diff(key, prepend=-1))]
    return key & vertex_of, np.searchsorted(key, np.arange(count + 1) << bits)


def row_chunks(offsets: np.ndarray, entries: int) -> Iterator[tuple[int, int]]:
    """Ranges of rows, in order, of about `entries` entries each."""
    cuts = np.searchsorted(offsets, np.arange(offsets[0], offsets[-1], entries))
    return pairwise(np.unique(np.append(cuts, len(offsets) - 1)).tolist())
