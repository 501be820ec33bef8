"""What is asked of a set of plans in one scene, and what its tests show: the sentence (V). [T42]"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Looks
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.bound.claim import recorded
from parc_jax.learning.bound.counts import (
    RECORDINGS,
    RUNS,
    as_probability,
    most_discards,
    required_runs,
)
from parc_jax.learning.bound.statement import confidence_of, probability
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.system import System, check_system
from parc_jax.statement import all_plans, resting_on

# tests by default: so many, or so many times as many as suffice where none fails
LEAST_TESTS, TIMES = 18_000, 10
# of the claim's tube, down to a sixth of it; of the error shape, which nothing has sized yet
SCALES = tuple(round(0.95**i, 3) for i in range(36))
SCALES_OF_SHAPE = tuple(round(4 * 0.85**i, 3) for i in range(28))
WAY = 0.65  # part of the scale on the way
RISK_AND_DELTA, OF_RECORDINGS = (0.003, 1e-3), (0.15, 0.05)  # by default
UNLIKE = "That is not how the model's runs go: compare units, the order of k, and the robot."


@dataclass(frozen=True)
class Validate:
    """How a set of plans is validated in one scene, fixed before its runs are made. [T42]

    source: the black box of the model, each test a run of it; or recorded runs that its training
        has not seen, such as `split` sets aside: each recording is one test, a run of it moved to a
        start that the set has for its k.
    risk: most probability with which a plan drawn from the set may fail. delta: that of saying so
        falsely. 0.003 and 1e-3 by default, with recordings 0.15 and 0.05, for which 19 suffice
        where none fails.
    tests: plans drawn and run once each; None for 18,000, or ten times as many as suffice where
        none fails if that is more (23,000 for 0.003), or for all recordings.
    scales: of the claim's tube, or with recordings of the error shape, which those that sized the
        tube have not seen; falling: sets are tested in this order. None for 1 to 0.17, 4 to 0.05.
    way: part of each scale that errors on the way have, those at the end all of it. None for 0.65:
        on the way most are in no direction that matters; with recordings 1.
    looks: how often sets may be tested, in all scenes together, each time at its share of delta;
        once more is refused. Or the account of an answer, whose plans then share it.
    Raises InputError.
    """

    source: System | RolloutBatch
    risk: Fraction | float | str | None = None
    delta: Fraction | float | str | None = None
    tests: int | None = None
    scales: Sequence[float] | None = None
    way: float | None = None
    looks: int | Looks = 1

    def __post_init__(self) -> None:
        runs = self.source if isinstance(self.source, RolloutBatch) else None
        if runs is None:
            check_system(self.source)
        usual = RISK_AND_DELTA if runs is None else OF_RECORDINGS
        risk = as_probability("risk", usual[0] if self.risk is None else self.risk)
        known = isinstance(self.looks, Looks)
        looks, planned = (self.looks, None) if known else (Looks(), self.looks)
        own = looks.delta or usual[1] if self.delta is None else self.delta
        delta = looks.declare(own, planned).delta
        least = required_runs(risk, delta / looks.planned)
        unit = RUNS if runs is None else RECORDINGS
        tests = max(LEAST_TESTS, TIMES * least) if self.tests is None else self.tests
        if runs is not None:
            tests = runs.recordings
            if self.tests not in (None, tests):
                raise InputError(
                    f"tests: expected all {tests:,} recordings, each of which is one test; got "
                    f"{self.tests!r:.40}. Leave it out, or select runs before any is looked at."
                )
        check_count("tests", tests, 1, "plans that are run once each")
        if tests < least:
            raise InputError(
                f"tests: expected at least {least:,} {unit.many}, which show a risk of "
                f"{rounded_up(risk)} where none fails; got {tests:,}. Ask for more of them, or for "
                "more risk."
            )
        usual = SCALES if runs is None else SCALES_OF_SHAPE
        scales = np.asarray(usual if self.scales is None else self.scales, float)
        finite = scales.ndim == 1 and len(scales) and np.isfinite(scales).all()
        if not finite or not (np.diff(scales, append=0) < 0).all():
            raise InputError(
                f"scales: expected falling positive numbers, such as (1.0, 0.8, 0.6); got "
                f"{self.scales!r:.60}."
            )
        way = (WAY if runs is None else 1.0) if self.way is None else self.way
        if not (isinstance(way, float | int) and 0 < way < np.inf):
            raise InputError(f"way: expected a positive number, such as 0.5; got {way!r:.40}.")
        exact = {"risk": risk, "delta": delta, "tests": tests, "scales": tuple(scales.tolist())}
        exact |= {"way": float(way), "looks": looks}
        for name, value in exact.items():
            object.__setattr__(self, name, value)


class Step(NamedTuple):
    """A test of the sequence: the scale of the tube, tests in its set, and how many of them failed,
    in this set or one before it, whichever is more.
    """

    scale: float
    n: int
    failed: int


@dataclass(frozen=True, eq=False)
class Validation:
    """The result of a validation. Made by `Planner.solve(..., validate=)`.

    answer: of the largest set that was accepted, an answer of its own, whose claim is the sentence
        (V) and whose `sample` draws by the law of the tests; None where no set was accepted.
    steps: of the tests that were made, in order; the last one was not accepted, unless all were.
    asked: its settings. refused: corridors of the accepted set that the exact checker refused,
        and with them the set, of which a part would have another law.
    """

    answer: Answer | None
    steps: tuple[Step, ...]
    asked: Validate
    refused: int = 0

    def summary(self) -> str:
        """The sentence (V) in short."""
        if self.answer is None:
            return self.sentence
        found, claim = self.answer, self.answer.model.claim
        p, share, held = claim.premises, found.share, found.coverage
        at_least = Fraction(share.at_least) * Fraction(held.at_least)
        both = Fraction(str(share.confidence)) + Fraction(str(held.confidence)) - 1
        of_all, sure = all_plans(found.scene.at is not None, claim.law.box), rounded_down(both, 10)
        if found.cover.within is not None:
            sure += ", counting only those around what a search found"
        drawn = "drawn from them"
        if recorded(claim):
            start = "a start drawn for it" if found.scene.at is None else "this start"
            drawn = f"for k of one run, drawn from a new recording's with k in K, from {start},"
        return (
            f"Validated in this scene, by {claim.law.describe()}: at least "
            f"{rounded_down(100 * at_least, 3)} % of {of_all}, with confidence {sure}. A plan "
            f"{drawn} fails in its {p['lasts']} with probability at most "
            f"{probability(p['risk'], 2)}, confidence {confidence_of(p)}."
        )

    def details(self) -> str:
        """The sentence (V) and what its scene rests on, or why there is none."""
        rests = [] if self.answer is None else resting_on(self.answer.scene.nominal)
        return " ".join([self.sentence, *rests])

    @property
    def sentence(self) -> str:
        """The sentence (V), or why there is none."""
        if self.answer is not None:
            return f"(V) {self.answer.model.claim.details()}"
        asked, none = self.asked, "(V) No set was validated:"
        risk, least = rounded_up(asked.risk), required_runs(asked.risk, asked.delta)
        if not self.steps:
            return f"{none} no draw met a plan that is proved under the smallest tube."
        first = self.steps[0]
        if first.n < least:
            return (
                f"{none} the first one holds {first.n:,} of {asked.tests:,} tests, where a risk of "
                f"{risk} takes {least:,}. Allow more tests (recordings), or more risk."
            )
        if self.refused:
            return (
                f"{none} the exact checker refused {self.refused:,} corridors of the one that "
                "passed. Validate with another key."
            )
        few = " Or more tests (recordings): these are few." * (first.failed < asked.risk * first.n)
        allowed = most_discards(first.n, float(asked.risk), float(asked.delta))
        return (
            f"{none} of {first.n:,} tests of the first one {first.failed:,} failed, where a risk "
            f"of {risk} allows {allowed:,}. "
            f"{UNLIKE if 2 * first.failed > first.n else f'Allow more risk.{few}'}"
        )
