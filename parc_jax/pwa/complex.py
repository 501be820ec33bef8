"""The polyhedral complex as a face lattice: vertices, edges, ..., cells, each face a list of the faces one dimension
down.

Vertices are shared by all faces that contain them, so a network is evaluated once per vertex. A vertex carries,
beside its floats, its exact sign at every hyperplane seen so far; that is what it *is* (see exact.py).
"""

import numpy as np

from parc_jax.pwa.bits import unpack
from parc_jax.pwa.growable import Growable, row_positions


class SignBits:
    """Exact signs of the vertices at the columns (domain rows, then neurons): one bit each for plus and minus."""

    def __init__(self, n_columns: int, count: int):
        words = (n_columns + 63) // 64
        self.plus = Growable(np.zeros((count, words), np.uint64))
        self.minus = Growable(np.zeros((count, words), np.uint64))

    def inherit(self, a: np.ndarray, b: np.ndarray) -> None:
        """Append points inside the edges (a, b): nonzero where an end is nonzero (the ends never disagree)."""
        self.plus.append(self.plus.data.take(a, axis=0) | self.plus.data.take(b, axis=0))
        self.minus.append(self.minus.data.take(a, axis=0) | self.minus.data.take(b, axis=0))

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


class Level:
    """Faces of one dimension k >= 2 in one pool. Face 0 is a dummy that owns what is no longer used, and pool
    position 0.

    sub: pooled (k-1)-faces. own: face of each pool entry. start, size: where a face's row lies. first: a vertex of
    the face.
    radius: see rounding.py. home: cell of the complex at the start of the layer that contains the face.
    """

    def __init__(self, sub, size, first):
        size = np.concatenate([[0], size])
        self.sub = Growable(np.concatenate([[0], sub]))
        self.own = Growable(np.concatenate([[0], np.repeat(np.arange(len(size)), size)]))
        self.start, self.size = Growable(1 + np.cumsum(size) - size), Growable(size)
        self.first, self.radius = Growable(np.concatenate([[0], first])), Growable(np.zeros(len(size)))
        self.home = Growable(np.zeros(len(size), int))

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
        self.edge_radius, self.edge_home = Growable(np.zeros(self.a.n)), Growable(np.zeros(self.a.n, int))
        self.vertex_home = Growable(np.zeros(len(x), int))
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

    def home(self, k: int) -> Growable:
        """A cell of the complex at the start of the layer that contains each k-face."""
        return self.vertex_home if k == 0 else self.edge_home if k == 1 else self.levels[k].home

    def settle(self) -> None:
        """Start a layer: the cells of now are the homes of all faces."""
        inside = np.arange(self.count(self.n)) - 1
        for k in range(self.n, 0, -1):
            self.home(k).data[: self.count(k)] = inside
            below = np.zeros(self.count(k - 1), int)
            if k > 1:
                below[self.levels[k].sub.view] = inside[self.levels[k].own.view]
            else:
                below[self.a.view[1:]] = below[self.b.view[1:]] = inside[1:]
            inside = below
        self.vertex_home.data[: self.x.n] = inside

    def signs_of_cells(self, words: np.ndarray) -> np.ndarray:
        """OR of the vertices' bit words (V, m) over each cell: (cells, m)."""
        words = words.take(self.a.view, axis=0) | words.take(self.b.view, axis=0)
        for k in range(2, self.n + 1):
            level = self.levels[k]
            positions, ends = row_positions(level.start.view[1:], level.size.view[1:])
            gathered = words.take(level.sub.data[positions], axis=0)
            rows = np.bitwise_or.reduceat(gathered, ends - level.size.view[1:], axis=0)
            words = np.concatenate([rows[:1], rows])
        return words[1:]

    def rows(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Boundaries of all k-faces, dummy dropped: (k-1)-faces flat, and offsets. Numbered from 0 on both sides."""
        if k == 1:
            ends = np.stack([self.a.view[1:], self.b.view[1:]], axis=1)
            return ends.ravel(), 2 * np.arange(len(ends) + 1)
        level = self.levels[k]
        positions, ends = row_positions(level.start.view[1:], level.size.view[1:])
        return level.sub.data[positions] - 1, np.concatenate([[0], ends])

    @property
    def nbytes(self) -> int:
        """Bytes held by the complex, spare capacity included (a close count, asked for after every cut)."""
        per_vertex = 8 * (self.n + self.z.data.shape[1] + 2 * self.bits.plus.data.shape[1] + 2)
        pools = sum(16 * len(level.sub.data) + 40 * len(level.size.data) for level in self.levels.values())
        return per_vertex * len(self.x.data) + 32 * len(self.a.data) + pools

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
