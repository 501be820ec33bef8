"""When a search stops: looks at fresh draws that share one error probability, and a limit in
seconds above the work.

A draw is fresh when nothing was built from it, so its uncovered share is an honest sample. A look
may end the search only if one before it announced that looks count from then on, and only such
looks have a part of the error probability. Many of them are judged by the last ones together: what
was outside before more was built tells against the cover, never for it. [T31]

Work alone decides the result of a search; where seconds cut some of it off, the limit remembers it
for the answer to report.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from parc_jax.learning.bound.counts import clopper_pearson

# [target] looks count once one left less than this share uncovered: building more makes it several
# times smaller, and a look that counts in vain costs little
ARMED = 6.0
TOGETHER = 2  # of so many looks that count, the last one; the last two of twice as many, and so on


class Coverage(NamedTuple):
    """Result of a look at a fresh draw.

    share: of the model's safe set that is covered. at_least: with `confidence`.
    """

    share: float
    at_least: float
    confidence: float
    fresh_safe: int
    fresh_uncovered: int


def nothing_covered(confidence: float) -> Coverage:
    """Coverage before any look."""
    return Coverage(0.0, 0.0, confidence, 0, 0)


class StoppingRule(NamedTuple):
    """Stop when at most `target` is left out, with the confidence of `coverage`. Begin with
    `stopping_rule`.

    coverage: of the last look, or of several that confirmed the target together. looks: (n,
    uncovered) of each that counted so far. announced: the next one counts, and all later ones,
    whose sizes no count decides. satisfied: one confirmed the target.
    """

    target: float
    coverage: Coverage
    looks: tuple[tuple[int, int], ...] = ()
    announced: bool = False
    satisfied: bool = False

    def after(self, covered: np.ndarray) -> "StoppingRule":
        """The rule after a look: covered (b,) bool says which plans of a fresh draw are. Nothing
        changes once it is satisfied: more only adds to it.
        """
        if self.satisfied:
            return self
        looks = (*self.looks, (len(covered), int((~covered).sum())))
        # one that does not count has the next part: it decides nothing, but may be the last
        part, least, confidence = len(looks), 1 - self.target, self.coverage.confidence
        many = looks[-max(1, part // TOGETHER) :] if self.announced else looks[-1:]
        (n, out), each = np.sum(many, axis=0).tolist(), 1 - (1 - confidence) / min(len(many), 2)
        # together they show the target, which was fixed beforehand, and no more; else the last one
        if len(many) == 1 or 1 - largest_share(n, out, each, part) < least:
            (n, out), least = looks[-1], 1 - largest_share(*looks[-1], each, part)
        coverage = Coverage(1 - out / n, least, confidence, n, out)
        return StoppingRule(
            target=self.target,
            coverage=coverage,
            looks=looks if self.announced else (),
            announced=self.announced or out < ARMED * self.target * n,
            satisfied=self.announced and coverage.at_least >= 1 - self.target,
        )


def stopping_rule(target: float, confidence: float) -> StoppingRule:
    """The rule before any look."""
    return StoppingRule(target, nothing_covered(confidence))


def largest_share(n: int, out: int, confidence: float, part: int) -> float:
    """Clopper-Pearson bound on a share of which n plans showed `out`, with the part 6 / (pi i)^2 of
    the error probability that look number i has, i = `part` from 1 on. [T31]
    """
    return float(clopper_pearson(out, n, (1 - confidence) * 6 / (np.pi * part) ** 2))


class Limit:
    """Most seconds of a search, from `start` on. cut: something was left undone for them."""

    def __init__(self, seconds: float):
        self.seconds = seconds
        self.cut = False
        self._begin: float | None = None

    def start(self) -> None:
        """Count from now, if not from earlier on: most of the time before is compilation."""
        if self._begin is None:
            self._begin = time.perf_counter()

    @contextmanager
    def uncounted(self) -> Iterator[None]:
        """Compilation inside does not count."""
        begin = time.perf_counter()
        yield
        if self._begin is not None:
            self._begin += time.perf_counter() - begin

    def over(self, reserved: float = 0.0) -> bool:
        """Is it over? Ask only if more is to do: True cuts that off. reserved [s]: for later."""
        if self._begin is not None:
            spent = time.perf_counter() - self._begin
            self.cut = self.cut or spent + reserved > self.seconds
        return self.cut
