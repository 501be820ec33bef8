"""Pieces by cell, and the loop that grows them from uncovered points in whole batches."""

import time
from collections.abc import Iterator

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.avoid.directions import direction, multiplier_near
from parc_jax.certify.draw import Points, groups
from parc_jax.certify.grow import grow_batch
from parc_jax.certify.inside import inside_pairs
from parc_jax.certify.piece import Piece
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

SEEDS = 48  # grown together in one compiled call
FEW_SEEDS = 4  # in the first call of a query, so that the first polytope is there at once
MATES = 16  # known safe points of the cell that a seed tries to keep


class Grower:
    """Safe pieces found so far. Index them by `contains`; add to them by `grow`."""

    def __init__(self, model: TrajectoryModel, problem: ReachAvoid, scene: Scene, rng: np.random.Generator):
        self.model, self.problem, self.scene, self.rng = model, problem, scene, rng
        self.pieces: list[Piece] = []
        self._by_cell: dict[bytes, list[int]] = {}
        self._begin = time.perf_counter()

    def contains(self, points: Points) -> np.ndarray:
        """(b,) bool: inside some piece."""
        at, of = self._pairs(points, self._by_cell)
        inside = np.zeros(len(points.k), bool)
        inside[at[self._inside(points, self.pieces, at, of)]] = True
        return inside

    def grow(self, points: Points, few: bool = False) -> Iterator[None]:
        """Grow pieces until every point is inside one. Yields after each batch; few: start with a small batch."""
        left = np.arange(len(points.k))
        while len(left):
            rest = points.at(left)
            seeds = self._choose(rest, FEW_SEEDS if few else SEEDS)
            few = False
            pieces, dropped = self._grow_batch(rest, seeds)
            left = left[~self._accept(rest, seeds, pieces, dropped)]
            yield

    def pruned(self, points: Points) -> list[Piece]:
        """Greedy set cover over all points seen: pieces that add none are dropped."""
        at, of = self._pairs(points, self._by_cell)
        members = self._members(points, self.pieces, at, of)
        left = np.zeros(len(points.k), bool)
        for index in members.values():
            left[index] = True
        kept = []
        for numbers in self._by_cell.values():
            own = [n for n in numbers if n in members]
            while own:
                gain = [int(left[members[n]].sum()) for n in own]
                best = int(np.argmax(gain))
                if gain[best] == 0:
                    break
                left[members[own[best]]] = False
                kept.append(self.pieces[own.pop(best)])
        return kept

    def _accept(self, points: Points, seeds, pieces, dropped) -> np.ndarray:
        """Take the pieces that hold most, one after another, and say which points are done with (b,)."""
        done = np.zeros(len(points.k), bool)
        done[dropped] = True  # not provable in short fractions: given up, and counted as uncovered by the next look
        by_cell: dict[bytes, list[int]] = {}
        for number, seed in enumerate(seeds):
            if pieces[number] is not None:
                by_cell.setdefault(points.cell[seed].tobytes(), []).append(number)
        at, of = self._pairs(points, by_cell)
        members = self._members(points, pieces, at, of)
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
        """Seeds (most,): the fullest cells first, several seeds in full ones; repeated when there are too few."""
        cells = sorted((index for _, index in groups(points.cell)), key=len, reverse=True)[:most]
        share = np.array([len(c) for c in cells], float)
        per_cell = np.maximum(1, np.floor((most - len(cells)) * share / share.sum())).astype(int)
        per_cell = np.minimum(per_cell, share.astype(int))
        seeds = np.concatenate([self.rng.choice(c, n, replace=False) for c, n in zip(cells, per_cell, strict=True)])
        return np.resize(seeds, most)

    def _grow_batch(self, points: Points, seeds: np.ndarray) -> tuple[list[Piece | None], list[int]]:
        members = dict(groups(points.cell))
        mates, real = np.repeat(seeds[:, None], MATES, axis=1), np.zeros((len(seeds), MATES), bool)
        for row, seed in enumerate(seeds):
            others = self.rng.permutation(members[points.cell[seed].tobytes()])[:MATES]
            mates[row, : len(others)], real[row, : len(others)] = others, True
        boxes = [self.model.tube.bin_box(n) for n in points.bin[seeds]]
        keys = np.asarray(self.rng.integers(0, 2**32, (len(seeds), 2)), np.uint32)
        with x64():
            out = jax.device_get(
                grow_batch(
                    self.model.net, self.model.tube, self.scene.arrays, keys, points.p0[seeds], points.k[seeds],
                    points.pattern[seeds], points.bin[seeds], np.array([b[0] for b in boxes]),
                    np.array([b[1] for b in boxes]), points.path[mates], real,
                )
            )  # fmt: skip
        pieces: list[Piece | None] = [None] * len(seeds)
        first = {int(s): row for row, s in reversed(list(enumerate(seeds)))}  # repeated seeds grow once
        for seed, row in first.items():
            if out.kept[row]:
                pieces[row] = self._piece(points, seed, out.choice[row], out.nearest[row])
        rows = [row for row, piece in enumerate(pieces) if piece is not None]
        own = seeds[rows]
        keep = self._inside(points, [pieces[r] for r in rows], own, np.arange(len(rows)))
        for row in (r for r, ok in zip(rows, keep, strict=True) if not ok):
            pieces[row] = None
        return pieces, [s for s, row in first.items() if pieces[row] is None]

    def _piece(self, points: Points, seed: int, choice: np.ndarray, nearest: np.ndarray) -> Piece:
        """Look the chosen directions up; a seed's own nearest ones are first rounded to short multipliers."""
        table, active = self.scene.directions, self.scene.obstacles.active
        n_w = table.w.shape[1]
        rows = np.arange(len(table.w))[:, None]
        known = np.minimum(choice, n_w - 1)
        w, reach = table.w[rows, known], table.reach[rows, known]
        spelled = [[table.multipliers[o][d] for d in known[o]] for o in range(len(table.multipliers))]
        for o, t in np.argwhere((choice == n_w) & active):
            spelled[o][t] = multiplier_near(self.problem, table, o, nearest[o, t])
            w[o, t], reach[o, t] = direction(self.problem, o, spelled[o][t])
        error = self.model.tube.interval[points.bin[seed]]
        size = np.abs(w)
        need = reach + (size * error).sum(axis=2) + self.scene.slack * size.sum(axis=2)
        return Piece(
            self.model, self.scene, points.p0[seed], points.k[seed], points.pattern[seed], points.bin[seed],
            w, np.where(active, need, -np.inf), spelled, time.perf_counter() - self._begin,
        )  # fmt: skip

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

    def _pairs(self, points: Points, by_cell: dict[bytes, list[int]]) -> tuple[np.ndarray, np.ndarray]:
        """All (point, piece) pairs of equal cells."""
        at, of = [np.zeros(0, int)], [np.zeros(0, int)]
        for cell, index in groups(points.cell):
            numbers = by_cell.get(cell, ())
            at.append(np.repeat(index, len(numbers)))
            of.append(np.tile(np.array(numbers, int), len(index)))
        return np.concatenate(at), np.concatenate(of)


def _split(values: np.ndarray):
    """Pairs (value, indices) of equal integers."""
    if len(values) == 0:
        return []
    order = np.argsort(values, kind="stable")
    cut = np.flatnonzero(np.diff(values[order])) + 1
    return [(values[index[0]], index) for index in np.split(order, cut)]
