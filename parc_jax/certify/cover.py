"""Cover the safe set: draw plans, grow corridors and cut polytopes around those outside, until a fresh draw finds
almost none.

The draw that decides to stop is fresh: nothing was grown from it, so its uncovered share is an honest sample. A look
that may decide is announced by the one before it, and only such looks have a part of the error probability.
"""

import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.certify.corridor import Corridor
from parc_jax.certify.draw import Points, joined, near
from parc_jax.certify.draws import Draws
from parc_jax.certify.grower import Grower
from parc_jax.certify.piece import Piece
from parc_jax.certify.pieces import Pieces
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

NEAR = 32  # points drawn close to each that a look found outside, MOST_NEAR in all
MOST_NEAR = 16384
SLIVERS = 0.1  # while more than this share is outside, plain draws say enough of where
ARMED = 1.6  # [target] the next look may stop once this one left less than this share uncovered: growing halves it
LEAVE = 0.1  # [target] share of a look that may stay without a corridor: those points cost most and hold least
LEAVE_NEAR = 0.5  # the same for points drawn close by, as a share of those outside


class Coverage(NamedTuple):
    """What the last fresh draw says. share: of the model's safe set that is covered; at_least: with `confidence`."""

    share: float
    at_least: float
    confidence: float
    fresh_safe: int
    fresh_uncovered: int


class Look(NamedTuple):
    """One look of the search, `seconds` after its beginning: corridors and polytopes so far, and the shares of a fresh
    draw from the safe set that keep to some corridor and that are inside some polytope."""

    seconds: float
    corridors: int
    kept: float
    polytopes: int
    inside: float


class Cover(NamedTuple):
    """What a search found. drawn, reaching, safe: counts over all draws, which are uniform over a set of that volume.

    points: safe ones among them. kept, coverage: what the corridors and what the pieces cover. corridors: those that
    were certified to cover enough, corridors_s [s] after the beginning, or all where none were; pieces are cut from
    later ones too. first_piece_s: [s] until the first corridor, which in its seed's cell is a safe polytope.
    """

    drawn: int
    reaching: int
    safe: int
    volume: float
    points: Points
    kept: Coverage
    coverage: Coverage
    corridors: Sequence[Corridor] = ()
    pieces: Sequence[Piece] = ()
    first_sample_s: float | None = None
    first_piece_s: float | None = None
    corridors_s: float | None = None
    history: Sequence[Look] = ()


def nothing_covered(confidence: float) -> Coverage:
    """What is known to be covered before a fresh look says more."""
    return Coverage(0.0, 0.0, confidence, 0, 0)


def cover(
    model: TrajectoryModel, problem: ReachAvoid, scene: Scene, rng: np.random.Generator,
    *, target: float, confidence: float, budget_s: float, polytopes: bool = True,
) -> Cover:  # fmt: skip
    """Grow until the pieces leave out at most `target` of the safe set, with `confidence`, or the budget ends.

    polytopes: False asks that of the corridors, and cuts no pieces. budget_s: [s] after the first pass, so that
    compiling is not counted; the draw that is under way when it ends judges.
    """
    begin = time.perf_counter()
    spent = lambda: time.perf_counter() - begin  # noqa: E731
    for_draws, rng = rng.spawn(2)
    grower = Grower(model, problem, scene, rng)
    corridors, pieces = grower.corridors, Pieces(grower)
    by_corridors, by_pieces = Judge(target, confidence), Judge(target, confidence)
    first_sample = first_piece = corridors_s = enough = compiled = None
    late = lambda: compiled is not None and spent() - compiled > budget_s  # noqa: E731
    history: list[Look] = []
    with Draws(model, scene, for_draws) as draws:
        while True:
            fresh = draws.take()
            inside = pieces.inside(fresh) if polytopes else np.zeros(len(fresh.k), bool)
            kept = inside.copy()  # whoever is inside keeps to a corridor
            kept[~inside] = grower.keep(fresh.at(~inside))
            covered = inside if polytopes else kept
            if len(fresh.k):
                first_sample = first_sample or spent()
                by_corridors.look(kept)
                by_pieces.look(covered)
                if by_corridors.satisfied and corridors_s is None:
                    corridors_s, enough = spent(), len(corridors.all)
                history.append(Look(spent(), len(corridors.all), kept.mean(), len(pieces), inside.mean()))
            if late() or by_pieces.satisfied or draws.hopeless:
                break
            if corridors.all:  # the first one should come soon, with all cores
                draws.start()
            leave = int(LEAVE * target * len(fresh.k))
            slivers = covered.sum() > (1 - SLIVERS) * len(covered)
            for _ in _grow(pieces, fresh.at(~covered), leave, rng, polytopes, slivers):
                first_piece = first_piece or spent()
                if late():
                    break
            if compiled is None and len(fresh.k):
                compiled = spent()  # the budget is for searching: the first pass mostly compiles
    return Cover(
        draws.drawn, draws.reaching, draws.safe, draws.volume, draws.seen, by_corridors.coverage,
        by_pieces.coverage if polytopes else nothing_covered(confidence), corridors.all[:enough],
        pieces.all(), first_sample, first_piece, corridors_s, history,
    )  # fmt: skip


def _grow(pieces: Pieces, outside: Points, leave: int, rng, polytopes: bool, slivers: bool) -> Iterator[None]:
    """Grow corridors around plans that a look found outside, cut polytopes from their cells. Yields after each batch.

    slivers: what uniform draws still leave out lies in slivers, where they hit once in a hundred. Near a hit they are
    dense: safe plans close to those outside say which corridor and which polytope holds most.
    """
    grower = pieces.grower
    if slivers and len(outside.k):
        around = near(grower.model, grower.scene, rng, outside, min(NEAR * len(outside.k), MOST_NEAR))
        if polytopes:
            around = around.at(~pieces.inside(around))
        grower.keep(around)
        outside, leave = joined([outside, around]), max(leave, int(LEAVE_NEAR * len(outside.k)))
    yield from grower.grow(leave, few=not grower.corridors.all)
    if polytopes:
        pieces.add(outside)
        yield


class Judge:
    """Says when enough is covered. coverage: of the last look. satisfied: at most `target` is left out, surely enough.

    A look that may decide is announced by the one before, which nearly did; only such looks share the error.
    """

    def __init__(self, target: float, confidence: float):
        self.target, self.confidence = target, confidence
        self.satisfied = self._announced = False
        self._looks = 0
        self.coverage = nothing_covered(confidence)

    def look(self, covered: np.ndarray) -> None:
        """covered (b,) bool: which of the plans of a fresh draw are. Ignored once satisfied: more only adds to it."""
        if self.satisfied:
            return
        self._looks += self._announced
        n, out = len(covered), int((~covered).sum())
        self.coverage = Coverage(1 - out / n, 1 - self._worst(n, out), self.confidence, n, out)
        self.satisfied = self._announced and self.coverage.at_least >= 1 - self.target
        self._announced = out < ARMED * self.target * n

    def _worst(self, n: int, out: int) -> float:
        """Clopper-Pearson bound with the part of the error probability that this look has."""
        from scipy.special import betaincinv

        level = 1 - (1 - self.confidence) * 6 / (np.pi * max(self._looks, 1)) ** 2
        return 1.0 if out == n else float(betaincinv(out + 1, n - out, level))
