"""Cover the safe set by polytopes: draw points, grow the uncovered ones, stop when a fresh draw finds almost none.

The draw that decides to stop is fresh: no piece was grown from it, so its uncovered share is an honest sample. A look
that may stop is announced by the one before it, and only such looks have a part of the error probability.
"""

import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from parc_jax.certify.draw import Points, draw, joined, near
from parc_jax.certify.grower import Grower
from parc_jax.certify.piece import Piece
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

FIRST_DRAW = 512
LARGEST_DRAW = 2**18
HOPELESS = 50_000  # drawn without a safe one: other means have to decide whether there is any
SOME = 100  # safe points seen before a draw may be as large as it wants
ENOUGH = 6000  # fresh safe points of a look: a share a little below a target of 1 % is then told from it
NEAR = 32  # points drawn close to each that a look found outside, MOST_NEAR in all
MOST_NEAR = 32768
ARMED = 1.6  # [target] the next look may stop once this one left less than this share uncovered: growing halves it
LEAVE = 0.1  # [target] share of a look that may stay without a piece: those points cost most and hold least
LEAVE_NEAR = 0.2  # the same for points drawn close by, as a share of those that wait
REMEMBERED = 60_000  # safe points kept, the last ones: a uniform sample of the safe set, whose paths take memory


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
        inside = grower.take(batch.safe)
        seen.append(batch.safe)
        while sum(len(s.k) for s in seen[1:-1]) > REMEMBERED:
            seen.pop(0)
        if fresh:
            look += armed
            # two questions per look, about all pieces and about those that pruning leaves; the shares sum to one
            level = 1 - (1 - confidence) * 3 / (np.pi * max(look, 1)) ** 2
            coverage = _coverage(inside, level, confidence)
            history.append((spent(), len(grower.pieces), coverage.share))
        if armed and coverage.at_least >= 1 - target:
            pieces = grower.pieces
            kept = grower.pruned(joined(seen[:-1]))  # what pruning has looked at could not judge what it leaves
            left = _coverage(grower.contains(batch.safe, kept), level, confidence)
            if left.at_least >= 1 - target:
                pieces, coverage = [pieces[n] for n in kept], left
            break
        for _ in grow_around(grower, batch.safe.at(~inside), int(LEAVE * target * fresh), rng, first_piece is None):
            first_piece = first_piece or spent()
            if compiled is not None and spent() - compiled > budget_s:
                break
        if compiled is None and fresh:
            compiled = spent()  # the budget is for searching: the first pass mostly compiles
        armed = fresh > 0 and 1 - coverage.share < ARMED * target
        if spent() - (compiled or 0.0) > budget_s or (safe == 0 and drawn >= HOPELESS):
            pieces = grower.pieces  # nothing fresh is left to judge a choice among them
            break
        most = LARGEST_DRAW if safe >= SOME else LARGEST_DRAW // 4
        size = int(np.clip(ENOUGH * drawn / max(safe, 1), FIRST_DRAW, most))
    return Cover(
        pieces, coverage, drawn, reaching, safe, batch.volume, joined(seen), first_sample, first_piece, history
    )


def grow_around(grower: Grower, outside: Points, leave: int, rng: np.random.Generator, few: bool) -> Iterator[None]:
    """Grow from what waits, then from safe points close to those that a look found outside. Yields after each batch.

    What uniform draws leave out lies in slivers, where they hit once in a hundred; near a hit they are dense.
    """
    yield from grower.grow(leave, few)
    if len(outside.k):
        grower.take(near(grower.model, grower.scene, rng, outside, min(NEAR * len(outside.k), MOST_NEAR)))
        yield from grower.grow(max(leave, int(LEAVE_NEAR * len(grower.waiting.k))))


def _coverage(inside: np.ndarray, level: float, confidence: float) -> Coverage:
    """Clopper-Pearson bound of this look; the looks share the total error probability."""
    from scipy.special import betaincinv

    n, uncovered = len(inside), int((~inside).sum())
    worst = 1.0 if uncovered == n else float(betaincinv(uncovered + 1, n - uncovered, level))
    return Coverage(1 - uncovered / n, 1 - worst, confidence, n, uncovered)
