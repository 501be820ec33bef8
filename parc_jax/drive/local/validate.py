"""Validated sets: learn, then test. Nested certified sets under falling scales of the tube, of
which fresh runs in this one scene accept as many as show the risk that was asked for. [T42]
"""

import hashlib
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.checker.answer import canonical
from parc_jax.checker.claim import hash_of_set
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.common.options import check_count
from parc_jax.common.spelling import hex_text, rounded_down, rounded_up
from parc_jax.learning.bound.calibrate import ledger_of_tests, scaled
from parc_jax.learning.bound.claim import scene_claim, stand_in
from parc_jax.learning.bound.counts import (
    as_probability,
    most_discards,
    required_runs,
    wrong_claim_probability,
)
from parc_jax.learning.bound.start_gap import off_from_start
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.law import law_of
from parc_jax.learning.system import System, check_system
from parc_jax.planner import Prepared, answered
from parc_jax.problem.robust.nominal import Query
from parc_jax.proof.certificate.write import corridor_part, problem_part
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.safe_plans import SafePlans
from parc_jax.safe_set.corridors.sampling import points
from parc_jax.safe_set.corridors.search import draw_safe_plans
from parc_jax.safe_set.corridors.stopping import Limit, stopping_rule
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.outcomes import reached_and_touched
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.pointwise import predictions
from parc_jax.safe_set.verdict.scene import Scene, lowered, padded
from parc_jax.statement import IN_THE_BOX

# tests by default: so many, or so many times as many as suffice where none fails
LEAST_TESTS, TIMES = 14_000, 10
# of the claim's tube, down to a fifth of it
SCALES = tuple(round(0.93**i, 3) for i in range(23))
SEEDS = 1000  # plans drawn before any test, one of which each corridor of a set needs inside
APART = 2**32 - 1  # beyond every number of a row
CHUNK = 256  # runs per compiled call, as of all large collections
COVERED_BY = 20_000  # plans drawn to tell how much of the safe set is held


@dataclass(frozen=True)
class Validate:
    """How a set of plans is validated in one scene, fixed before its runs are made. [T42]

    system: the black box of the model; each test is a run of it.
    risk: most probability with which a plan drawn from the set may fail. delta: that of saying so
        falsely.
    tests: plans drawn and run once each; None for 14,000, or ten times as many as suffice where
        none fails if that is more (23,000 for 0.003).
    scales: of the tube, falling; sets are tested in this order.
    Raises InputError.
    """

    system: System
    risk: Fraction | float | str = 0.003
    delta: Fraction | float | str = 1e-3
    tests: int | None = None
    scales: Sequence[float] = SCALES

    def __post_init__(self) -> None:
        check_system(self.system)
        risk, delta = as_probability("risk", self.risk), as_probability("delta", self.delta)
        least = required_runs(risk, delta)
        tests = max(LEAST_TESTS, TIMES * least) if self.tests is None else self.tests
        check_count("tests", tests, 1, "plans that are run once each")
        if tests < least:
            raise InputError(
                f"tests: expected at least {least:,}, which show a risk of {rounded_up(risk)} "
                f"where none fails; got {tests:,}. Ask for more of them, or for more risk."
            )
        scales = np.asarray(self.scales, float)
        if scales.ndim != 1 or not len(scales) or not (np.diff(scales, append=0) < 0).all():
            raise InputError(
                f"scales: expected falling positive numbers, such as (1.0, 0.8, 0.6); got "
                f"{self.scales!r:.60}."
            )
        exact = {"risk": risk, "delta": delta, "tests": tests, "scales": tuple(scales.tolist())}
        for name, value in exact.items():
            object.__setattr__(self, name, value)


class Step(NamedTuple):
    """A test of the sequence: the scale of the tube, drawn plans that lie in its set, and how many
    of their runs failed.
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
            return "Validated: no set."
        share, held, safe = self.answer.share, self.answer.coverage.share, ""
        if share is not None:
            of_all = IN_THE_BOX if self.answer.scene.at is None else "all k in K"
            safe = f"{rounded_down(100 * share.share * held, 3)} % of {of_all}. "
        return (
            f"Validated in this scene: {safe}A plan drawn from them fails with probability at most "
            f"{rounded_up(self.asked.risk)}, confidence {rounded_down(1 - self.asked.delta, 10)}."
        )

    def details(self) -> str:
        """The sentence (V), or why there is none."""
        if self.answer is not None:
            return f"(V) {self.answer.model.claim.details()}"
        asked = self.asked
        risk, least = rounded_up(asked.risk), required_runs(asked.risk, asked.delta)
        if not self.steps:
            return (
                f"(V) No set was validated: none holds {least:,} of the {asked.tests:,} plans "
                f"drawn, which a risk of {risk} takes. Allow more tests, or more risk."
            )
        if self.refused:
            return (
                f"(V) No set was validated: the exact checker refused {self.refused:,} corridors "
                "of the one that passed. Validate with another key."
            )
        first = self.steps[0]
        allowed = most_discards(first.n, float(asked.risk), float(asked.delta))
        return (
            f"(V) No set was validated: of {first.n:,} plans drawn from the first one "
            f"{first.failed:,} failed, where a risk of {risk} allows {allowed:,}. Allow more risk."
        )


def validated(
    answer: Answer, key: jax.Array, settings: Settings, asked: Validate, quiet: bool = True
) -> Answer:
    """The answer with its `validation`: nested sets of plans of its query are tested by fresh runs,
    and as many accepted as show the risk. [T42]

    key: its SCENE stream is used, and nothing else. settings: of the search under the smallest
    tube. Raises InputError for a problem under uncertainty, another system, and a set too small to
    draw from.
    """
    query = answer.scene.nominal.query
    if query.problem.uncertainty is not None or query.model.claim.subject.given:
        raise InputError(
            "validate: expected a problem without uncertainty and a model without given "
            "parameters, whose law nobody stated; got one. Solve it without validate=."
        )
    require_same(asked.system, query.model)
    # apart from the runs, whose keys count up from the first row
    own = jax.random.fold_in(stream(key, Stage.SCENE), APART)
    seeds, draws, after = (generator(jax.random.fold_in(own, i)) for i in range(3))
    sets = _sets(query, own, seeds, settings, asked)
    largest = sets[-1]
    if not len(largest.corridors):
        return replace(answer, validation=Validation(None, (), asked))
    p0, k = np.split(largest.sample(draws, asked.tests), [query.model.n_p], axis=1)
    failed, lost = _failures(asked.system, largest.scene, key, p0, k, quiet)
    steps, passed = fixed_sequence(asked, _inside(sets, p0, k), failed)
    if not passed:
        return replace(answer, validation=Validation(None, steps, asked))
    chosen = sets[asked.scales.index(steps[passed - 1].scale)]
    under = query.of(_accepted_model(query.model, chosen, steps[:passed], asked, lost))
    found = replace(_as_answer(under, chosen, settings, own, after), looks=answer.looks)
    refused = len(chosen.corridors) - len(found.corridors)
    validation = Validation(None if refused else found, steps, asked, refused)
    return replace(answer, validation=validation)


def _failures(
    system: System, scene: Scene, key: jax.Array, p0: np.ndarray, k: np.ndarray, quiet: bool
) -> tuple[np.ndarray, np.ndarray]:
    """(tests,) bool: which plans miss the goal, touch something or do not return, run once each, by
    any that begins where they do as far as the claim declares; and (tests,) how often each was
    lost, as of `RolloutBatch`.
    """
    failed, lost, first = [], [], 0
    off = off_from_start(scene.model.claim)
    for runs in stream_rollouts(system, key, len(k), Stage.SCENE, k=k, chunk=CHUNK, quiet=quiet):
        reached, touched = reached_and_touched(scene, runs, p0[first : first + runs.n], off)
        failed.append(~reached | touched)
        lost.append(np.zeros(runs.n) if runs.lost is None else runs.lost)
        first += runs.n
    return np.concatenate(failed), np.concatenate(lost)


def _inside(sets: Sequence[SafePlans], p0: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(sets, tests) bool: which plans of the last set lie in which; by halving, for sets are
    nested.
    """
    outside, inside = np.full(len(k), -1), np.full(len(k), len(sets) - 1)
    while (inside - outside > 1).any():
        middle = (inside + outside) // 2
        for i in np.unique(middle[inside - outside > 1]):
            rows = np.flatnonzero((middle == i) & (inside - outside > 1))
            held = sets[i].contains(p0[rows], k[rows])
            inside[rows[held]], outside[rows[~held]] = i, i
    return np.arange(len(sets))[:, None] >= inside


def fixed_sequence(
    asked: Validate, inside: np.ndarray, failed: np.ndarray
) -> tuple[tuple[Step, ...], int]:
    """Fixed-sequence testing: the tests that are made, and how many of them pass. [T42]

    inside: (sets, tests) bool, in the order of the scales. failed: (tests,) bool.
    The sequence begins with the first set in which so many plans lie that none may fail: membership
    decides that, not failures. It ends with the first test that does not pass.
    """
    least, steps = required_runs(asked.risk, asked.delta), []
    risk = math.nextafter(float(asked.risk), 0.0)
    for scale, among in zip(asked.scales, inside, strict=True):
        step = Step(scale, int(among.sum()), int((among & failed).sum()))
        if not steps and step.n < least:
            continue
        steps.append(step)
        if wrong_claim_probability(step.n, risk, step.failed) > asked.delta:
            return tuple(steps), len(steps) - 1
    return tuple(steps), len(steps)


def _sets(
    query: Query, key: jax.Array, rng: np.random.Generator, settings: Settings, asked: Validate
) -> list[SafePlans]:
    """The nested sets in the order of the scales, fixed before any test: the corridors are those of
    the last one, of which each set has those that hold one of SEEDS plans, its seed there.
    """
    scenes = []
    for scale in asked.scales:
        tube = query.model.tube
        tube = scaled(tube, np.full(tube.n_bins, scale), np.zeros(tube.n_c))
        model = query.model.replace(claim=stand_in(query.model.claim, tube))
        # all obstacles: those that no plan of one tube comes near may be near plans of another
        scenes.append(padded(lowered(query.of(model).nominal())))
    cover = Prepared(scenes[-1]).solve(key, settings.replace(proof=False)).cover
    last = SafePlans(scenes[-1], Corridors(scenes[-1].model.tube, cover.corridors), cover.within)
    if not len(last.corridors):
        return [last]
    p0, k = np.split(last.sample(rng, SEEDS), [query.model.n_p], axis=1)
    return [
        SafePlans(scene, _seeded(scene, last.corridors.all, p0, k), cover.within)
        for scene in scenes
    ]


def _seeded(
    scene: Scene, corridors: Sequence[Corridor], p0: np.ndarray, k: np.ndarray
) -> Corridors:
    """The corridors in which one of the plans lies under the tube of the scene, with that plan."""
    tube, e = scene.model.tube, predictions(scene, p0, k)
    safe = points(p0, k, e).at(e.reaches)
    kept = Corridors(tube, corridors).kept(safe.path, safe.bin)
    seeds = zip(corridors, kept.argmax(axis=0), kept.any(axis=0), strict=True)
    return Corridors(
        tube, [one._replace(p0=safe.p0[i], k=safe.k[i]) for one, i, held in seeds if held]
    )


def _accepted_model(
    model: TrajectoryModel,
    chosen: SafePlans,
    steps: tuple[Step, ...],
    asked: Validate,
    lost: np.ndarray,
) -> TrajectoryModel:
    """The model under the tube of the accepted set, with (V) as its claim."""
    last, scene = steps[-1], chosen.scene
    part = canonical(problem_part(scene.problem, scene.model))
    within = None if chosen.within is None else [hex_text(side) for side in chosen.within]
    evidence = {
        "of": model.claim.hash,
        "scale": str(last.scale),
        "tests": asked.tests,
        "steps": [[str(step.scale), step.n, step.failed] for step in steps],
        "scene": hashlib.sha256(part.encode()).hexdigest(),
        "corridors": len(chosen.corridors),
        "within": within,
        "set": hash_of_set(
            [corridor_part(one, scene.problem) for one in chosen.corridors.all], within
        ),
    }
    shown = {"eps": asked.risk, "delta": asked.delta, "n": last.n, "discard": last.failed}
    shown["assumptions"] = ledger_of_tests(model.claim, lost)
    law = law_of(asked.system)
    return model.replace(claim=scene_claim(model.claim, scene.model.tube, law, evidence, **shown))


def _as_answer(
    query: Query,
    chosen: SafePlans,
    settings: Settings,
    key: jax.Array,
    rng: np.random.Generator,
) -> Answer:
    """The answer whose corridors are those of the set, proved as any other."""
    begin = time.perf_counter()
    scene = padded(lowered(query.nominal()))
    plans = SafePlans(scene, Corridors(scene.model.tube, chosen.corridors.all), chosen.within)
    limit = Limit(settings.budget_s)
    drawn = draw_safe_plans(scene, key, rng, COVERED_BY, settings.confidence, limit, chosen.within)
    held = plans.has(drawn.points)
    rule = stopping_rule(settings.target, settings.confidence)
    cover = drawn._replace(
        points=drawn.points.at(held),
        coverage=rule.after(held).coverage,
        corridors=plans.corridors.all,
    ).pick(rng, settings.samples)
    return answered(scene, cover, None, settings, begin)
