"""The polyhedral complex as a face lattice: vertices, edges, ..., cells, each face a list of the
faces one dimension down.

Vertices are shared by all faces that contain them, so a network is evaluated once per vertex. A
vertex carries, beside its floats, its exact sign at every hyperplane so far; these signs
*are* the vertex (see exact.py).
"""

import os
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

from parc_jax.common.arrays import slices
from parc_jax.common.errors import BudgetError
from parc_jax.proof.regions.storage import (
    CHUNK,
    NUMBER,
    Growable,
    Ragged,
    row_chunks,
    row_positions,
    unpack,
)


class Sign:
    """Sign of a function at a vertex, or the union of those at the vertices of a face.

    Bits of a uint8; not an IntFlag, since NumPy takes the members of one for 64-bit integers and
    converts arrays for every comparison.
    """

    ZERO = np.uint8(0)
    PLUS = np.uint8(1)
    MINUS = np.uint8(2)
    CUT = PLUS | MINUS  # a face with vertices on both sides
    NEW = CUT | np.uint8(4)  # the face made by the cut itself, which bounds both parts


class SignBits:
    """Exact signs of vertices at columns (domain rows, then neurons): a plus and a minus bit."""

    def __init__(self, n_columns: int, count: int):
        words = (n_columns + 63) // 64
        self.plus = Growable(np.zeros((count, words), np.uint64))
        self.minus = Growable(np.zeros((count, words), np.uint64))

    def inherit(self, a: np.ndarray, b: np.ndarray) -> None:
        """Append points inside edges (a, b): nonzero where an end is (the ends never disagree)."""
        for bits in (self.plus, self.minus):
            bits.append(bits.data.take(a, axis=0) | bits.data.take(b, axis=0))

    def mark(self, column: int, codes: np.ndarray) -> None:
        """Set one column for the first len(codes) vertices. codes: uint8, see `Sign`."""
        word, bit = column >> 6, np.uint64(column & 63)
        for bits, sign in ((self.plus, Sign.PLUS), (self.minus, Sign.MINUS)):
            bits.data[: len(codes), word] |= ((codes & sign) != 0).astype(np.uint64) << bit

    def is_plus(self, first: int, last: int) -> np.ndarray:
        """Bool (V, last - first): strictly positive at the columns first..last-1."""
        return unpack(self.plus.view, last)[:, first:]

    def at(self, vertex: int, n_columns: int) -> tuple[np.ndarray, np.ndarray]:
        """(plus, zero) of one vertex, each bool (n_columns,)."""
        both = np.stack([self.plus.data[vertex], self.minus.data[vertex]])
        plus, minus = unpack(both, n_columns)
        return plus, ~(plus | minus)


def _with_dummy(values: np.ndarray, dummy: int = 0) -> Growable:
    """Values of all faces of one dimension, with that of the dummy in front."""
    return Growable(np.concatenate([[dummy], values]).astype(NUMBER))


Faces = Int[np.ndarray, " faces"]


class Level:
    """Faces of one dimension k >= 2 in one pool. Face 0 is a dummy that owns pool position 0
    and all positions no longer in use.

    sub: pooled (k-1)-faces. own: face of each pool entry. start, size: where a face's row lies.
    first: a vertex of the face.
    """

    def __init__(self, sub: Int[np.ndarray, " entries"], size: Faces, first: Faces):
        size = np.concatenate([[0], size])
        self.sub = _with_dummy(sub)
        self.own = _with_dummy(np.repeat(np.arange(len(size)), size))
        self.start = Growable(1 + np.cumsum(size) - size)
        self.size = Growable(size.astype(NUMBER))
        self.first = _with_dummy(first)

    @property
    def count(self) -> int:
        """Number of faces, dummy included."""
        return self.size.n

    def append_rows(
        self, sub: Int[np.ndarray, " entries"], own: np.ndarray, size: Int[np.ndarray, " new"]
    ) -> np.ndarray:
        """Append rows to the pool; returns their starts. The caller enters the rows' faces."""
        starts = self.sub.n + np.cumsum(size) - size
        self.sub.append(sub)
        self.own.append(own)
        return starts

    def compact(self) -> None:
        """Drop dead pool entries when they are more than half as many as the live ones."""
        live = int(self.size.view.sum())
        if self.sub.n <= live + live // 2 + 64:
            return
        end = 1
        for part in slices(self.sub.n, CHUNK):
            used = np.flatnonzero(self.own.data[part])
            for pool in (self.sub, self.own):
                pool.data[end : end + len(used)] = pool.data[part].take(used)
            end += len(used)
        self.sub.n = end
        self.own.n = end
        own = self.own.view
        heads = np.flatnonzero(own[1:] != own[:-1]) + 1
        self.start.data[own[heads]] = heads


class Complex:
    """All faces of dimension 0..n. Mutable; lives only inside the subdivision.

    x: (V, n) float vertices. z: (V, w) pre-activations of the current layer. bits: exact signs.
    a, b: ends of the edges (edge 0 is a dummy). levels[k]: faces of dimension k = 2..n.
    radius[k]: of all k-faces, see rounding.py; rho: of the vertices. home[k]: cell of the complex
        at the start of the layer that contains each k-face.
    label: column of the hyperplane that carries each (n-1)-face.
    """

    def __init__(
        self,
        x: Float[np.ndarray, "V n"],
        bits: SignBits,
        a: Int[np.ndarray, " E"],
        b: Int[np.ndarray, " E"],
        levels: dict[int, Level],
        label: Int[np.ndarray, " F"],
    ):
        self.n = x.shape[1]
        self.x = Growable(x)
        self.z = Growable(np.zeros((len(x), 0)))
        self.bits = bits
        self.a = _with_dummy(a)
        self.b = _with_dummy(b)
        self.levels = levels
        counts = [len(x), self.a.n, *(levels[k].count for k in range(2, self.n + 1))]
        self.radius = [Growable(np.zeros(count)) for count in counts]
        self.home = [Growable(np.zeros(count, NUMBER)) for count in counts]
        self.rho = self.radius[0]
        # a dummy in front, unless they are vertices
        self.label = Growable(label) if self.n == 1 else _with_dummy(label, -1)

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.count(self.n) - 1

    def count(self, k: int) -> int:
        """Number of stored k-faces; one more than there are for k >= 1 (the dummy)."""
        return self.home[k].n

    def enter(self, k: int, radius: np.ndarray, home: np.ndarray, column: int) -> None:
        """Enter new k-faces, which lie in the hyperplane of a column."""
        self.radius[k].append(radius)
        self.home[k].append(home)
        if k == self.n - 1:
            self.label.append(np.full(len(home), column))

    def halve(self, k: int, faces: np.ndarray) -> None:
        """Enter the minus halves of k-faces, which are as the whole ones were."""
        facets = [self.label] if k == self.n - 1 else []
        for of_faces in (self.radius[k], self.home[k], *facets):
            of_faces.append(of_faces.data[faces])

    def settle(self) -> None:
        """Start a layer: the cells of now are the homes of all faces."""
        inside = np.arange(-1, self.n_cells, dtype=NUMBER)
        for k in range(self.n, 0, -1):
            self.home[k].data[: self.count(k)] = inside
            below = np.zeros(self.count(k - 1), NUMBER)
            if k > 1:
                level = self.levels[k]
                for part in slices(level.sub.n, CHUNK):
                    below[level.sub.data[part]] = inside.take(level.own.data[part])
            else:
                below[self.a.view[1:]] = inside[1:]
                below[self.b.view[1:]] = inside[1:]
            inside = below
        self.home[0].data[: self.x.n] = inside

    def rows(self, k: int) -> Ragged:
        """Boundaries of all k-faces, no dummy: flat (k-1)-faces, offsets; both numbered from 0."""
        if k == 1:
            ends = np.stack([self.a.view[1:], self.b.view[1:]], axis=1)
            return ends.ravel(), 2 * np.arange(len(ends) + 1)
        level = self.levels[k]
        start = level.start.view[1:]
        size = level.size.view[1:]
        offsets = np.concatenate([[0], np.cumsum(size)])
        flat = np.empty(offsets[-1], NUMBER)
        for first, last in row_chunks(offsets, CHUNK):
            positions, _ = row_positions(start[first:last], size[first:last])
            np.subtract(level.sub.data.take(positions), 1, out=flat[offsets[first] : offsets[last]])
        return flat, offsets

    def all_rows(self, *, drop: bool = False) -> Iterator[Ragged]:
        """`rows` of the k-faces, k = 1, ..., n. drop: the complex gives up its rows, for good."""
        for k in range(1, self.n + 1):
            yield self.rows(k)
            if drop and k > 1:
                level = self.levels[k]  # whose number of faces stays
                level.sub, level.own = (Growable(np.zeros(1, NUMBER)) for _ in range(2))

    @property
    def nbytes(self) -> int:
        """Bytes held by the complex (a close count, for the budget after every cut)."""
        per_vertex = 8 * (self.n + self.z.data.shape[1] + 2 * self.bits.plus.data.shape[1] + 2)
        held = per_vertex * self.x.n + 20 * self.a.n
        for level in self.levels.values():
            held += 8 * level.sub.n + 28 * level.count
        return held

    def compact(self) -> None:
        """Drop dead entries, where they are more than half as many as the live ones."""
        for level in self.levels.values():
            level.compact()


# peak memory of the next cut and of the finished table, per byte held now (measured: 1.7 to 3.7)
PEAK = 5
# faces of one dimension: a cut makes at most three of one, which 32 bits can then still count
MAX_FACES = 2**29


class Budget:
    """Caps on regions and bytes of one enumeration, which end in a message and not in swap."""

    def __init__(self, regions: int, memory: int | None, n_columns: int):
        if memory is None and hasattr(os, "sysconf"):  # half of the machine's
            memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
        self.memory = 4 << 30 if memory is None else memory  # Windows does not tell
        self.regions, self.n_columns = regions, n_columns

    def check(self, lattice: Complex, column: int) -> None:
        """Called when `column` hyperplanes are cut. Raises BudgetError."""
        needed = PEAK * lattice.nbytes
        caps = {
            f"more than max_regions = {self.regions} regions": lattice.n_cells > self.regions,
            f"more than {MAX_FACES} faces of one dimension": MAX_FACES
            < max(lattice.count(k) for k in range(lattice.n + 1)),
            f"may need more than max_bytes = {self.memory} ({needed})": needed > self.memory,
        }
        for why in (words for words, passed in caps.items() if passed):
            raise BudgetError(
                f"enumerate_regions: {why}, with {column} of {self.n_columns} hyperplanes cut, "
                f"{lattice.n_cells} regions. Nothing is returned, since a part would not cover "
                "the domain. Shrink the domain or the network, or raise the cap."
            )
