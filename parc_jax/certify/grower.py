"""Pieces by cell, and the loop that grows them from uncovered points in whole batches."""

import time
from collections.abc import Iterator

import jax
import numpy as np

from parc_jax.arrays import on_all_cores, x64
from parc_jax.avoid.directions import DirectionTable, direction, multiplier_near
from parc_jax.certify.draw import Points, groups, joined
from parc_jax.certify.grow import Growth, grow_batch
from parc_jax.certify.inside import inside_any, inside_pairs, pairs_of_cells
from parc_jax.certify.piece import Piece
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

SEEDS = 64  # grown together
CALL = 8  # of which so many in one compiled call; the first polytope of a query comes from one call
MATES = 16  # known safe points of the cell that a seed tries to keep
ITEMS = (12, 32, 128)  # obstacle-interval pairs of a seed with a free choice: larger once a seed asked for more


class Grower:
    """Safe pieces found so far. `take` shows it safe points, `grow` grows pieces around those outside of all."""

    def __init__(self, model: TrajectoryModel, problem: ReachAvoid, scene: Scene, rng: np.random.Generator):
        self.model, self.problem, self.scene, self.rng = model, problem, scene, rng
        self.pieces: list[Piece] = []
        self.waiting: Points | None = None
        self._by_cell: dict[bytes, list[int]] = {}
        self._items = ITEMS[0]
        self._begin = time.perf_counter()
        self._spelled = _objects(scene.directions)

    def take(self, points: Points) -> np.ndarray:
        """(b,) bool: inside some piece. The others wait for one."""
        inside = self.contains(points)
        new = points.at(~inside)
        self.waiting = new if self.waiting is None else joined([self.waiting, new])
        return inside

    def contains(self, points: Points, pieces: list[int] | None = None) -> np.ndarray:
        """(b,) bool: inside some piece, or some of the given ones."""
        if not self.pieces:
            return np.zeros(len(points.k), bool)
        chosen = None if pieces is None else set(pieces)
        by_cell = {c: [n for n in own if chosen is None or n in chosen] for c, own in self._by_cell.items()}
        w, need = np.stack([p.w for p in self.pieces]), np.stack([p.need for p in self.pieces])
        return inside_any(points, w, need, by_cell)

    def grow(self, leave: int = 0, few: bool = False) -> Iterator[None]:
        """Grow pieces until at most `leave` points wait. Yields after each batch; few: start with a small one."""
        while self.waiting is not None and len(self.waiting.k) > leave:
            seeds = self._choose(self.waiting, CALL if few else SEEDS)
            few = False
            pieces, dropped = self._grow_batch(self.waiting, seeds)
            self.waiting = self.waiting.at(~self._accept(self.waiting, seeds, pieces, dropped))
            yield

    def pruned(self, points: Points) -> list[int]:
        """Greedy set cover over the given points: numbers of the pieces that add some."""
        members = self._members(points, self.pieces, *pairs_of_cells(points.cell, self._by_cell))
        left = np.zeros(len(points.k), bool)
        for index in members.values():
            left[index] = True
        kept: list[int] = []
        for numbers in self._by_cell.values():
            own = [n for n in numbers if n in members]
            while own:
                gain = [int(left[members[n]].sum()) for n in own]
                best = int(np.argmax(gain))
                if gain[best] == 0:
                    break
                left[members[own[best]]] = False
                kept.append(own.pop(best))
        return kept

    def _accept(self, points: Points, seeds, pieces, dropped) -> np.ndarray:
        """Take the pieces that hold most, one after another, and say which points are done with (b,)."""
        done = np.zeros(len(points.k), bool)
        done[dropped] = True  # not provable in short fractions: given up, and counted as uncovered by the next look
        by_cell: dict[bytes, list[int]] = {}
        for number, seed in enumerate(seeds):
            if pieces[number] is not None:
                by_cell.setdefault(points.cell[seed].tobytes(), []).append(number)
        members = self._members(points, pieces, *pairs_of_cells(points.cell, by_cell))
        for number in sorted(members, key=lambda n: -len(members[n])):
            fresh = int((~done[members[number]]).sum())
            if 2 * fresh >= len(members[number]):
                done[members[number]] = True
                self._by_cell.setdefault(points.cell[seeds[number]].tobytes(), []).append(len(self.pieces))
                self.pieces.append(pieces[number])
        if not members:
            done[seeds] = True
        return done

    def _choose(self, points: Points, most: int) -> np.ndarray:
        """Seeds (at most `most`,): the fullest cells first, several seeds in full ones."""
        cells = sorted((index for _, index in groups(points.cell)), key=len, reverse=True)[:most]
        share = np.array([len(c) for c in cells], float)
        per_cell = np.maximum(1, np.floor((most - len(cells)) * share / share.sum())).astype(int)
        per_cell = np.minimum(per_cell, share.astype(int))
        return np.concatenate([self.rng.choice(c, n, replace=False) for c, n in zip(cells, per_cell, strict=True)])

    def _grow_batch(self, points: Points, seeds: np.ndarray) -> tuple[list[Piece | None], list[int]]:
        """A piece around every seed, None where that failed, and the seeds where it did."""
        growth = self._growth(points, seeds)
        pieces: list[Piece | None] = [None] * len(seeds)
        rows = np.flatnonzero(growth.kept)
        for row, piece in zip(rows, self._pieces(points, seeds[rows], growth, rows), strict=True):
            pieces[row] = piece
        keep = self._inside(points, [pieces[r] for r in rows], seeds[rows], np.arange(len(rows)))
        for row in rows[~keep]:
            pieces[row] = None
        return pieces, [int(s) for s, piece in zip(seeds, pieces, strict=True) if piece is None]

    def _growth(self, points: Points, seeds: np.ndarray) -> Growth:
        """Directions for all seeds, CALL seeds at a time."""
        members = dict(groups(points.cell))
        mates, real = np.repeat(seeds[:, None], MATES, axis=1), np.zeros((len(seeds), MATES), bool)
        for row, seed in enumerate(seeds):
            others = self.rng.permutation(members[points.cell[seed].tobytes()])[:MATES]
            mates[row, : len(others)], real[row, : len(others)] = others, True
        keys = np.asarray(self.rng.integers(0, 2**32, (len(seeds), 2)), np.uint32)
        lo, hi = (np.array(x) for x in zip(*(self.model.tube.bin_box(b) for b in points.bin[seeds]), strict=True))
        items, arrays = self._items, self.scene.arrays

        def call(first):
            rows = np.resize(np.arange(first, min(first + CALL, len(seeds))), CALL)
            own = seeds[rows]
            with x64():
                out = grow_batch(
                    items, self.model.net, self.model.tube, arrays, keys[rows], points.p0[own], points.k[own],
                    points.pattern[own], points.bin[own], lo[rows], hi[rows], points.path[mates[rows]], real[rows],
                )  # fmt: skip
            return jax.device_get(out)

        parts = on_all_cores(call, range(0, len(seeds), CALL))
        growth = Growth(*(np.concatenate(x)[: len(seeds)] for x in zip(*parts, strict=True)))
        self._items = next((n for n in ITEMS if n >= growth.open.max()), ITEMS[-1])
        return growth

    def _pieces(self, points: Points, seeds, growth: Growth, rows) -> list[Piece]:
        """Look the chosen directions up; a seed's own nearest ones are first rounded to short multipliers."""
        table, active = self.scene.directions, self.scene.obstacles.active
        choice = growth.choice[rows]
        n_w = table.w.shape[1]
        known = np.minimum(choice, n_w - 1)
        o = np.arange(len(table.w))[None, :, None]
        w, reach, spelled = table.w[o, known], table.reach[o, known], self._spelled[o, known]
        for i, j, t in np.argwhere((choice == n_w) & active):
            own = multiplier_near(self.problem, table, j, growth.nearest[rows[i], j, t].astype(np.float64))
            w[i, j, t], reach[i, j, t] = direction(self.problem, j, own)
            spelled[i, j, t] = own
        error = self.model.tube.interval[points.bin[seeds]]
        size = np.abs(w)
        need = reach + (size * error[:, None]).sum(axis=3) + self.scene.slack * size.sum(axis=3)
        need = np.where(active, need, -np.inf)
        born = time.perf_counter() - self._begin
        return [
            Piece(
                self.model, self.scene, points.p0[s], points.k[s], points.pattern[s], points.bin[s], w[i], need[i],
                spelled[i], born,
            )
            for i, s in enumerate(seeds)
        ]  # fmt: skip

    def _members(self, points: Points, pieces, at, of) -> dict[int, np.ndarray]:
        """Indices of the points inside each piece, of the given pairs."""
        keep = self._inside(points, pieces, at, of)
        at, of = at[keep], of[keep]
        return {int(piece): at[index] for piece, index in _split(of)}

    def _inside(self, points: Points, pieces, at, of) -> np.ndarray:
        if len(at) == 0:
            return np.zeros(0, bool)
        used, whose = np.unique(of, return_inverse=True)
        w, need = np.stack([pieces[n].w for n in used]), np.stack([pieces[n].need for n in used])
        return inside_pairs(points.path, w, need, at, whose)


def _objects(table: DirectionTable) -> np.ndarray:
    """Multipliers (o, d) as an object array, looked up by index like w; None for obstacles that only pad."""
    out = np.empty(table.reach.shape, object)
    for j, row in enumerate(table.multipliers):
        for d, m in enumerate(row):
            out[j, d] = m
    return out


def _split(values: np.ndarray):
    """Pairs (value, indices) of equal integers."""
    if len(values) == 0:
        return []
    order = np.argsort(values, kind="stable")
    cut = np.flatnonzero(np.diff(values[order])) + 1
    return [(values[index[0]], index) for index in np.split(order, cut)]
