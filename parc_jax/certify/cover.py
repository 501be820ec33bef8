"""Cover the safe set by polytopes: draw points, grow the uncovered ones, stop when a fresh draw finds almost none.

The draw that decides to stop is fresh: no piece was grown from it, so its uncovered share is an honest sample. A look
that may stop is announced by the one before it, and only such looks have a part of the error probability.
"""

import time
from typing import NamedTuple

import numpy as np
from scipy.stats import beta

from parc_jax.certify.draw import Points, draw
from parc_jax.certify.grower import Grower
from parc_jax.certify.piece import Piece
from parc_jax.certify.scene import Scene
from parc_jax.certify.union import SafeUnion
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

FIRST_DRAW = 512
DRAW = 8192
LARGEST_DRAW = 65536
HOPELESS = 50_000  # drawn without a safe one: other means have to decide whether there is any
ENOUGH = 2000  # fresh safe points that make a look worth having
ARMED = 0.95  # [target] the next look may stop once this one left less than this share uncovered
DECIDING = 16_000  # safe points that a look may take to decide, when a smaller one probably would not
SIGMAS = 3.0  # room for chance that such a look allows for


class Coverage(NamedTuple):
    """What the last fresh draw says. share: of the model's safe set inside the pieces; at_least: with `confidence`."""

    share: float
    at_least: float
    confidence: float
    fresh_safe: int
    fresh_uncovered: int


class Cover(NamedTuple):
    """Pieces and what was seen. drawn, reaching, safe: counts over all draws, which are uniform over a
    set of the given volume.

    history: (seconds, pieces, share covered) after each look.
    """

    pieces: list[Piece]
    coverage: Coverage
    drawn: int
    reaching: int
    safe: int
    volume: float
    points: Points
    first_sample_s: float | None
    first_piece_s: float | None
    history: list[tuple[float, int, float]]


def cover(
    model: TrajectoryModel, problem: ReachAvoid, scene: Scene, rng: np.random.Generator,
    *, target: float, confidence: float, budget_s: float,
) -> Cover:  # fmt: skip
    """Grow pieces until at most `target` of the safe set is left out, with `confidence`, or the budget ends.

    budget_s: [s] after the first pass, so that compiling is not counted.
    """
    begin = time.perf_counter()
    spent = lambda: time.perf_counter() - begin  # noqa: E731
    grower = Grower(model, problem, scene, rng)
    drawn = reaching = safe = look = 0
    armed = False  # only a look that was announced by the one before may stop, so only such looks cost confidence
    coverage = Coverage(0.0, 0.0, confidence, 0, 0)  # nothing is known to be covered until a fresh look says so
    first_sample = first_piece = None
    compiled = None
    seen: list[Points] = []
    history: list[tuple[float, int, float]] = []
    size = FIRST_DRAW
    while True:
        batch = draw(model, scene, rng, size)
        fresh = len(batch.safe.k)
        drawn, reaching, safe = drawn + batch.drawn, reaching + batch.reaching, safe + fresh
        if fresh and first_sample is None:
            first_sample = spent()
        inside = grower.contains(batch.safe)
        seen.append(batch.safe)
        if fresh:
            look += armed
            # two questions per look, about all pieces and about those that pruning leaves; the shares sum to one
            level = 1 - (1 - confidence) * 3 / (np.pi * max(look, 1)) ** 2
            coverage = _coverage(inside, level, confidence)
            history.append((spent(), len(grower.pieces), coverage.share))
        if armed and coverage.at_least >= 1 - target:
            kept = grower.pruned(_joined(seen[:-1]))  # what pruning has looked at could not judge what it leaves
            left = _coverage(SafeUnion(model, scene, kept).count(batch.safe) > 0, level, confidence)
            if left.at_least >= 1 - target:
                pieces, coverage = kept, left
                break
        for _ in grower.grow(batch.safe.at(~inside), few=first_piece is None):
            first_piece = first_piece or spent()
            if compiled is not None and spent() - compiled > budget_s:
                break
        if compiled is None and fresh:
            compiled = spent()  # the budget is for searching: the first pass mostly compiles
        armed = fresh > 0 and 1 - coverage.share < ARMED * target
        if spent() - (compiled or 0.0) > budget_s or (safe == 0 and drawn >= HOPELESS):
            pieces = grower.pieces  # nothing fresh is left to judge a choice among them
            break
        size = _next_size(size, drawn, fresh, 1 - coverage.share, target)
    return Cover(
        pieces, coverage, drawn, reaching, safe, batch.volume, _joined(seen), first_sample, first_piece, history
    )


def _next_size(size: int, drawn: int, fresh: int, uncovered: float, target: float) -> int:
    """Points to draw next: more while safe ones are scarce, and enough to decide once the target is in reach."""
    if drawn == FIRST_DRAW:
        return DRAW
    if fresh < ENOUGH:
        return min(LARGEST_DRAW, 2 * size)
    if uncovered < ARMED * target:
        deciding = max(ENOUGH, SIGMAS**2 * uncovered / (target - uncovered) ** 2)
        if deciding <= DECIDING:
            return int(min(LARGEST_DRAW, max(DRAW, deciding * size / fresh)))
    return DRAW


def _joined(parts: list[Points]) -> Points:
    return Points(*(np.concatenate(fields) for fields in zip(*parts, strict=True)))


def _coverage(inside: np.ndarray, level: float, confidence: float) -> Coverage:
    """Clopper-Pearson bound of this look; the looks share the total error probability."""
    n, uncovered = len(inside), int((~inside).sum())
    worst = 1.0 if uncovered == n else float(beta.ppf(level, uncovered + 1, n - uncovered))
    return Coverage(1 - uncovered / n, 1 - worst, confidence, n, uncovered)
