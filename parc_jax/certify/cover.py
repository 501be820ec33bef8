"""Cover the safe set by polytopes: draw points, grow the uncovered ones, stop when a fresh draw finds (almost) none.

The draw that decides to stop is fresh: no piece was grown from it, so its uncovered share is an honest sample.
Every look has its own part of the error probability.
"""

import time
from typing import NamedTuple

import numpy as np
from scipy.stats import beta

from parc_jax.arrays import x64
from parc_jax.avoid.directions import direction, multiplier_near
from parc_jax.certify.draw import Points, draw, groups
from parc_jax.certify.grow import Items, grow_batch
from parc_jax.certify.piece import Piece, Run
from parc_jax.certify.scene import Scene
from parc_jax.certify.settle import settle
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

SEEDS = 48  # grown together in one compiled call
MATES = 48  # other safe points of the cell that a seed tries to keep
ITEMS = (32, 64, 128)  # padded numbers of obstacle-interval pairs to choose for; above them, all
FIRST_DRAW = 512
DRAW = 8192
LARGEST_DRAW = 65536


class Coverage(NamedTuple):
    """What the last fresh draw says. share: of the model's safe set inside the pieces; at_least: with `confidence`."""

    share: float
    at_least: float
    confidence: float
    fresh_safe: int
    fresh_uncovered: int


class Cover(NamedTuple):
    """Pieces and what was seen. drawn, reaching, safe: counts over all draws (uniform over anchored K x goal box)."""

    pieces: list[Piece]
    coverage: Coverage
    drawn: int
    reaching: int
    safe: int
    points: Points
    first_sample_s: float | None
    first_piece_s: float | None
    seconds: float


def cover(
    model: TrajectoryModel, problem: ReachAvoid, scene: Scene, rng: np.random.Generator,
    *, target: float, confidence: float, budget_s: float,
) -> Cover:  # fmt: skip
    """Grow pieces until at most `target` of the safe set is left out, with `confidence`, or the budget ends."""
    begin = time.perf_counter()
    grower = Grower(model, problem, scene)
    drawn = reaching = safe = 0
    coverage = Coverage(0.0, 0.0, confidence, 0, 0)
    first_sample = first_piece = None
    seen: list[Points] = []
    size, look = FIRST_DRAW, 0
    while True:
        batch = draw(model, scene, rng, size)
        drawn, reaching, safe = drawn + batch.drawn, reaching + batch.reaching, safe + len(batch.safe.k)
        if first_sample is None and len(batch.safe.k):
            first_sample = time.perf_counter() - begin
        inside = grower.contains(batch.safe)
        look += 1
        if len(batch.safe.k):
            coverage = _coverage(len(inside), int((~inside).sum()), 1 - (1 - confidence) * 6 / (np.pi * look) ** 2, confidence)
        seen.append(batch.safe)
        if coverage.at_least >= 1 - target:
            break
        for _ in grower.grow(batch.safe.at(~inside), rng):
            first_piece = first_piece or time.perf_counter() - begin
            if time.perf_counter() - begin > budget_s:
                break
        if time.perf_counter() - begin > budget_s:
            break
        scarce = len(batch.safe.k) < 2000
        size = DRAW if look == 1 else min(LARGEST_DRAW, size * 2) if scarce else size
    everything = Points(*(np.concatenate(parts) for parts in zip(*seen, strict=True)))
    pieces = grower.pruned(everything)
    return Cover(
        pieces, coverage, drawn, reaching, safe, everything, first_sample, first_piece, time.perf_counter() - begin
    )


class Grower:
    """Pieces by cell, and the loop that grows them from uncovered points."""

    def __init__(self, model: TrajectoryModel, problem: ReachAvoid, scene: Scene):
        self.model, self.problem, self.scene = model, problem, scene
        self.by_cell: dict[bytes, list[Piece]] = {}

    def contains(self, points: Points) -> np.ndarray:
        """(b,) bool: inside some piece."""
        inside = np.zeros(len(points.k), bool)
        for cell, index in groups(points.cell):
            for piece in self.by_cell.get(cell, ()):
                rest = index[~inside[index]]
                if len(rest) == 0:
                    break
                inside[rest] = piece.contains_paths(points.path[rest])
        return inside

    def grow(self, points: Points, rng: np.random.Generator):
        """Grow pieces until every point is inside one. Yields after each batch of pieces."""
        left = np.arange(len(points.k))
        while len(left):
            rest = points.at(left)
            seeds, mates, real = _choose(rest, rng)
            pieces = self._grow_batch(rest, seeds, mates, real)
            inside = np.zeros(len(left), bool)
            inside[seeds[[piece is None for piece in pieces]]] = True  # not provable in short fractions: give it up
            members = dict(groups(rest.cell))
            gains = []
            for seed, piece in zip(seeds, pieces, strict=True):
                if piece is not None:
                    index = members[rest.cell[seed].tobytes()]
                    gains.append((index[piece.contains_paths(rest.path[index])], piece, rest.cell[seed].tobytes()))
            for index, piece, cell in sorted(gains, key=lambda g: -len(g[0])):
                if 2 * (~inside[index]).sum() >= len(index) > 0 and (~inside[index]).any():
                    self.by_cell.setdefault(cell, []).append(piece)
                    inside[index] = True
            left = left[~inside]
            yield

    def pruned(self, points: Points) -> list[Piece]:
        """Greedy set cover over all points seen: pieces that add none are dropped."""
        kept: list[Piece] = []
        members = dict(groups(points.cell))
        for cell, pieces in self.by_cell.items():
            index = members.get(cell, np.zeros(0, int))
            inside = [piece.contains_paths(points.path[index]) for piece in pieces]
            left = np.any(inside, axis=0)
            while left.any():
                best = int(np.argmax([(own & left).sum() for own in inside]))
                kept.append(pieces[best])
                left &= ~inside[best]
        return kept

    def _grow_batch(self, points: Points, seeds, mates, real) -> list[Piece | None]:
        settled = settle(self.scene, self.model.tube, points)
        item_o, item_t = np.nonzero(settled < 0)
        n = next((size for size in ITEMS if len(item_o) <= size), settled.size)
        pad = n - len(item_o)
        used = np.arange(n) < len(item_o)
        items = Items(np.pad(item_o, (0, pad)), np.pad(item_t, (0, pad)), used)
        paths = points.path[np.concatenate([seeds[:, None], mates], axis=1)]
        with x64():
            out = grow_batch(self.scene, items, paths, real, self.model.tube.interval[points.bin[seeds]])
        choice, nearest, kept = (np.asarray(x) for x in (out.choice, out.nearest, out.kept))
        pieces: list[Piece | None] = []
        for s, seed in enumerate(seeds):
            directions = settled.copy()
            directions[item_o, item_t] = choice[s][used]
            own = {(o, t): nearest[s, i] for i, (o, t) in enumerate(zip(item_o, item_t, strict=True))}
            piece = self._piece(points, seed, directions, own) if kept[s] else None
            pieces.append(piece)
        return pieces

    def _piece(self, points: Points, seed: int, directions, own) -> Piece | None:
        """Merge the directions (o, T) of a seed into runs; None when the seed falls out by rounding of a multiplier."""
        n_table = self.scene.directions.w.shape[1]
        runs = []
        for o in range(len(self.problem.obstacles)):
            steps = np.flatnonzero(self.scene.obstacles.active[o])
            mine: list[Run] = []
            for t in steps:
                d = directions[o, t]
                if d == n_table:
                    m = multiplier_near(self.problem, self.scene.directions, o, own[o, t])
                    mine.append(Run(int(t), int(t) + 1, m, *direction(self.problem, o, m)))
                elif mine and mine[-1].multiplier is self.scene.directions.multipliers[o][d]:
                    mine[-1] = mine[-1]._replace(end=int(t) + 1)
                else:
                    table = self.scene.directions
                    mine.append(Run(int(t), int(t) + 1, table.multipliers[o][d], table.w[o, d], table.reach[o, d]))
            runs.append(tuple(mine))
        p0, k = points.p0[seed], points.k[seed]
        piece = Piece(self.model, self.scene, p0, k, points.pattern[seed], points.bin[seed], tuple(runs))
        return piece if piece.contains_paths(points.path[[seed]])[0] else None


def _choose(points: Points, rng: np.random.Generator):
    """Seeds (s,), mates (s, m) and which mates are real (s, m): the fullest cells first, several seeds in full ones."""
    cells = sorted((index for _, index in groups(points.cell)), key=len, reverse=True)[:SEEDS]
    share = np.array([len(c) for c in cells], float)
    per_cell = np.maximum(1, np.floor((SEEDS - len(cells)) * share / share.sum())).astype(int)
    per_cell = np.minimum(per_cell, share.astype(int))
    seeds, mates, real = [], [], []
    for index, n in zip(cells, per_cell, strict=True):
        for seed in rng.choice(index, n, replace=False):
            others = rng.permutation(index)[:MATES]
            seeds.append(seed)
            real.append(np.arange(MATES) < len(others))
            mates.append(np.pad(others, (0, MATES - len(others)), constant_values=seed))
    pad = max(0, SEEDS - len(seeds))
    take = np.pad(np.arange(len(seeds)), (0, pad))[: max(SEEDS, len(seeds))]
    return np.array(seeds)[take], np.array(mates)[take], np.array(real)[take]


def _coverage(n: int, uncovered: int, level: float, confidence: float) -> Coverage:
    """Clopper-Pearson bound of this look; the looks share the total error probability."""
    worst = 1.0 if uncovered == n else float(beta.ppf(level, uncovered + 1, n - uncovered))
    return Coverage(1 - uncovered / n, 1 - worst, confidence, n, uncovered)
