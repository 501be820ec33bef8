"""The safe polytopes of a query: which corridors are used in which cells."""

import time

import numpy as np

from parc_jax.certify.draw import Points, groups
from parc_jax.certify.grower import Grower
from parc_jax.certify.piece import Piece


class Pieces:
    """Polytopes found so far, each a corridor in a cell, with one inner point."""

    def __init__(self, grower: Grower):
        self.grower, self.corridors = grower, grower.corridors
        self._row: dict[bytes, int] = {}  # of a cell in the table of uses
        self._used = np.zeros((0, 0), bool)
        self._inner: list[tuple] = []  # p0, k, pattern, bin, number of the corridor, seconds
        self._begin = time.perf_counter()

    def __len__(self) -> int:
        return len(self._inner)

    def inside(self, points: Points) -> np.ndarray:
        """(b,) bool: inside some polytope."""
        if not self._inner:
            return np.zeros(len(points.k), bool)
        self._widen()
        return self.corridors.first(points.path, points.bin, self._uses(points)) >= 0

    def add(self, points: Points) -> None:
        """Polytopes around those of the given plans that keep to a corridor: in every cell as few as hold them all."""
        maybe = self.corridors.nearly(points.path, points.bin)
        popular = self.corridors.hits / (1 + self.corridors.hits.sum())  # decides where corridors hold equally many
        born = time.perf_counter() - self._begin
        open_cells, left = groups(points.cell), np.ones(len(points.k), bool)
        while open_cells:
            chosen = []
            for cell, index in open_cells:
                gain = maybe[index[left[index]]].sum(axis=0) + popular
                n = int(np.argmax(gain))
                if gain[n] >= 1:
                    chosen.append((cell, index, n, index[maybe[index, n]]))
            rows = np.concatenate([np.zeros(0, int), *(mine for *_, mine in chosen)])
            of = np.repeat([n for _, _, n, _ in chosen], [len(mine) for *_, mine in chosen]).astype(int)
            kept = self.corridors.kept_pairs(points.path, points.bin, rows, of)
            maybe[rows[~kept], of[~kept]] = False
            end = 0
            for cell, _, n, mine in chosen:
                end += len(mine)
                mine = mine[kept[end - len(mine) : end]]
                if left[mine].any():
                    left[mine] = False
                    middle = points.p0[mine].mean(axis=0), points.k[mine].mean(axis=0)  # inside: a polytope is convex
                    self._inner.append((*middle, points.pattern[mine[0]], points.bin[mine[0]], n, born))
                    self._use(cell, n)
            open_cells = [(cell, index) for cell, index, *_ in chosen]

    def all(self) -> list[Piece]:
        """Every polytope with all that describes it."""
        model, scene = self.grower.model, self.grower.scene
        return [Piece(model, scene, *found, self.corridors.all[n], born) for *found, n, born in self._inner]

    def _uses(self, points: Points) -> np.ndarray:
        """(b, c) bool: the corridors that are used in the cell of each plan."""
        row = np.full(len(points.k), len(self._used) - 1)
        for cell, index in groups(points.cell):
            row[index] = self._row.get(cell, len(self._used) - 1)
        return self._used[row][:, : len(self.corridors.all)]

    def _use(self, cell: bytes, n: int) -> None:
        row = self._row.setdefault(cell, len(self._row))
        self._widen()
        self._used[row, n] = True

    def _widen(self) -> None:
        """Room for all cells and corridors; the last row stays empty, for cells that use none."""
        rows, columns = self._used.shape
        more = (max(0, len(self._row) + 1 - rows), max(0, len(self.corridors.all) - columns))
        if any(more):
            self._used = np.pad(self._used, [(0, n and 2 * n + 64) for n in more])
