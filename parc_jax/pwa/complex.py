"""The polyhedral complex as a face lattice: vertices, edges, ..., cells, each face a list of the faces one dimension down.

Vertices are shared by all faces that contain them, so a network is evaluated once per vertex. A vertex carries, beside its
floats, its exact sign at every hyperplane seen so far; that is what it *is* (see exact.py).
"""

import numpy as np

from parc_jax.pwa.growable import Growable, row_positions


class SignBits:
    """Exact signs of the vertices at the columns (domain rows, then neurons): one bit each for plus and minus."""

    def __init__(self, n_columns: int, count: int):
        words = (n_columns + 63) // 64
        self.plus = Growable(np.zeros((count, words), np.uint64))
        self.minus = Growable(np.zeros((count, words), np.uint64))

    def inherit(self, a: np.ndarray, b: np.ndarray) -> None:
        """Append points inside the edges (a, b): nonzero where an end is nonzero (the ends never disagree)."""
        self.plus.append(self.plus.data[a] | self.plus.data[b])
        self.minus.append(self.minus.data[a] | self.minus.data[b])

    def mark(self, column: int, codes: np.ndarray) -> None:
        """Set one column for the first len(codes) vertices. codes: uint8, 1 plus, 2 minus, 0 zero."""
        word, bit = column >> 6, np.uint64(column & 63)
        wide = codes.astype(np.uint64)
        self.plus.data[: len(codes), word] |= (wide & np.uint64(1)) << bit
        self.minus.data[: len(codes), word] |= (wide >> np.uint64(1)) << bit

    def is_plus(self, first: int, last: int) -> np.ndarray:
        """Bool (V, last - first): strictly positive at the columns first..last-1."""
        return unpack(self.plus.view, last)[:, first:]

    def at(self, vertex: int, n_columns: int) -> tuple[np.ndarray, np.ndarray]:
        """(plus, zero) of one vertex, each bool (n_columns,)."""
        plus, minus = (unpack(bits.data[vertex : vertex + 1], n_columns)[0] for bits in (self.plus, self.minus))
        return plus, ~(plus | minus)


def unpack(words: np.ndarray, n_columns: int) -> np.ndarray:
    """Bit words (r, words) -> bool (r, n_columns)."""
    as_bytes = np.ascontiguousarray(words.astype("<u8", copy=False)).view(np.uint8)
    return np.unpackbits(as_bytes, axis=1, count=n_columns, bitorder="little").view(bool)


class Level:
    """Faces of one dimension k >= 2 in one pool. Face 0 is a dummy that owns what is no longer used, and pool position 0.

    sub: pooled (k-1)-faces. own: face of each pool entry. start, size: where a face's row lies. first: a vertex of the face.
    radius: see rounding.py.
    """

    def __init__(self, sub, size, first):
        size = np.concatenate([[0], size])
        self.sub = Growable(np.concatenate([[0], sub]))
        self.own = Growable(np.concatenate([[0], np.repeat(np.arange(len(size)), size)]))
        self.start, self.size = Growable(1 + np.cumsum(size) - size), Growable(size)
        self.first, self.radius = Growable(np.concatenate([[0], first])), Growable(np.zeros(len(size)))

    @property
    def count(self) -> int:
        """Number of faces, dummy included."""
        return self.size.n

    def append_rows(self, sub, own, size) -> np.ndarray:
        """Append rows to the pool; returns their starts. The rows' faces are entered by the caller."""
        starts = self.sub.n + np.cumsum(size) - size
        self.sub.append(sub)
        self.own.append(own)
        return starts

    def compact(self) -> None:
        """Drop dead pool entries when they are more than the live ones."""
        live = int(self.size.view.sum())
        if self.sub.n > 2 * live + 64:
            positions, ends = row_positions(self.start.view, self.size.view)
            for pool in (self.sub, self.own):
                pool.data[1 : live + 1] = pool.data[positions]
                pool.n = live + 1
            self.start.data[: self.count] = 1 + ends - self.size.view

    @property
    def nbytes(self) -> int:
        """Bytes held."""
        return sum(getattr(self, name).nbytes for name in ("sub", "own", "start", "size", "first", "radius"))


class Complex:
    """All faces of dimension 0..n. Mutable; lives only inside the subdivision.

    x: (V, n) float vertices. z: (V, w) pre-activations of the current layer. rho: (V,). bits: exact signs.
    a, b: ends of the edges (edge 0 is a dummy), edge_radius. levels[k]: faces of dimension k = 2..n.
    label: column of the hyperplane that carries each (n-1)-face.
    """

    def __init__(self, x, bits: SignBits, a, b, levels: dict[int, Level], label):
        self.n = x.shape[1]
        self.x, self.bits = Growable(x), bits
        self.z, self.rho = Growable(np.zeros((len(x), 0))), Growable(np.zeros(len(x)))
        self.a, self.b = Growable(np.concatenate([[0], a])), Growable(np.concatenate([[0], b]))
        self.edge_radius = Growable(np.zeros(self.a.n))
        self.levels = levels
        self.label = Growable(label if self.n == 1 else np.concatenate([[-1], label]))

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.count(self.n) - 1

    def count(self, k: int) -> int:
        """Number of stored k-faces; one more than there are for k >= 1 (the dummy)."""
        return self.x.n if k == 0 else self.a.n if k == 1 else self.levels[k].count

    def radius(self, k: int) -> Growable:
        """Distance bound of the k-faces, 0 <= k < n."""
        return self.rho if k == 0 else self.edge_radius if k == 1 else self.levels[k].radius

    def rows(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Boundaries of all k-faces, dummy dropped: (k-1)-faces flat, and row sizes. Numbered from 0 on both sides."""
        if k == 1:
            ends = np.stack([self.a.view[1:], self.b.view[1:]], axis=1)
            return ends.ravel(), np.full(len(ends), 2)
        level = self.levels[k]
        positions, _ = row_positions(level.start.view[1:], level.size.view[1:])
        return level.sub.data[positions] - 1, level.size.view[1:].copy()

    @property
    def nbytes(self) -> int:
        """Bytes held by the complex."""
        arrays = (self.x, self.z, self.rho, self.bits.plus, self.bits.minus, self.a, self.b, self.edge_radius, self.label)
        return sum(array.nbytes for array in arrays) + sum(level.nbytes for level in self.levels.values())

    def set_values(self, z: np.ndarray) -> None:
        """Store the pre-activations (V, w) of a new layer."""
        self.z = Growable(z)

    def touches(self, first: int, last: int) -> bool:
        """Whether a vertex lies on one of the domain rows first..last-1."""
        return not unpack(self.bits.minus.view, last)[:, first:].all()

    def compact(self) -> None:
        """Drop what cuts left behind, where it is more than what is in use."""
        for level in self.levels.values():
            level.compact()
