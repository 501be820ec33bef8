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
from parc_jax.answer.looks import Looks
from parc_jax.checker.answer import canonical
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.common.options import check_count
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.bound.calibrate import scaled
from parc_jax.learning.bound.claim import scene_claim, stand_in
from parc_jax.learning.bound.counts import (
    as_probability,
    most_discards,
    required_runs,
    wrong_claim_probability,
)
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.law import law_of
from parc_jax.learning.system import System, check_system
from parc_jax.planner import Prepared, answered
from parc_jax.problem.robust.nominal import Query
from parc_jax.proof.certificate.write import problem_part
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.place import Place
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
        known = {"risk": risk, "delta": delta, "tests": tests, "scales": tuple(scales.tolist())}
        for name, value in known.items():
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
    asked: how it was asked. refused: corridors of the accepted set that the exact checker refused,
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
        share, held = self.answer.share, self.answer.coverage.share
        of_all = IN_THE_BOX if self.answer.scene.at is None else "all k in K"
        part = None if share is None else f"{rounded_down(100 * share.share * held, 3)} %"
        safe = "" if part is None else f"{part} of {of_all}. "
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


class Nested(NamedTuple):
    """One set of the sequence: plans that reach the goal under the scaled tube and keep to one of
    these corridors under it.
    """

    scene: Scene
    corridors: tuple[Corridor, ...]
    within: Place | None

    @property
    def plans(self) -> SafePlans:
        """As a set to draw from, and to ask."""
        return SafePlans(self.scene, Corridors(self.scene.model.tube, self.corridors), self.within)


def validated(
    answer: Answer, key: jax.Array, settings: Settings, asked: Validate, quiet: bool = True
) -> Answer:
    """The answer with its `validation`. Arguments as of `validate`."""
    query = answer.scene.nominal.query
    found = validate(query, key, settings, asked, answer.looks, quiet)
    return replace(answer, validation=found)


def validate(
    query: Query,
    key: jax.Array,
    settings: Settings,
    asked: Validate,
    looks: Looks | None = None,
    quiet: bool = True,
) -> Validation:
    """Test nested sets of plans of a query by fresh runs, and accept as many as show the risk.

    key: its SCENE stream is used, and nothing else.
    settings: of the search under the smallest tube. looks: the account that the answer shares.
    Raises InputError for a problem under uncertainty, another system, and a set too small to draw
    from.
    """
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
    if not largest.corridors:
        return Validation(None, (), asked)
    plans = largest.plans.sample(draws, asked.tests)
    p0, k = np.split(plans, [query.model.n_p], axis=1)
    failed = _failures(asked.system, largest.scene, key, p0, k, quiet)
    steps, passed = fixed_sequence(asked, _inside(sets, p0, k), failed)
    if not passed:
        return Validation(None, steps, asked)
    last = steps[passed - 1]
    chosen = sets[asked.scales.index(last.scale)]
    model = _told(query.model, chosen, steps[:passed], asked)
    answer = _as_answer(query.of(model), chosen, settings, own, after, looks)
    refused = len(chosen.corridors) - len(answer.corridors)
    return Validation(None if refused else answer, steps, asked, refused)


def _failures(
    system: System, scene: Scene, key: jax.Array, p0: np.ndarray, k: np.ndarray, quiet: bool
) -> np.ndarray:
    """(tests,) bool: which plans miss the goal, touch something or do not return, run once each."""
    failed: list[np.ndarray] = []
    for runs in stream_rollouts(system, key, len(k), Stage.SCENE, k=k, chunk=CHUNK, quiet=quiet):
        first = sum(map(len, failed))
        reached, touched = reached_and_touched(scene, runs, p0[first : first + runs.n])
        failed.append(~reached | touched)
    return np.concatenate(failed)


def _inside(sets: Sequence[Nested], p0: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(sets, tests) bool: which plans of the last set lie in which; by halving, for sets are
    nested.
    """
    outside, inside = np.full(len(k), -1), np.full(len(k), len(sets) - 1)
    while (inside - outside > 1).any():
        middle = (inside + outside) // 2
        for i in np.unique(middle[inside - outside > 1]):
            rows = np.flatnonzero((middle == i) & (inside - outside > 1))
            held = sets[i].plans.contains(p0[rows], k[rows])
            inside[rows[held]], outside[rows[~held]] = i, i
    return np.arange(len(sets))[:, None] >= inside


def fixed_sequence(
    asked: Validate, inside: np.ndarray, failed: np.ndarray
) -> tuple[tuple[Step, ...], int]:
    """Fixed-sequence testing: the tests that are made, and how many of them pass. [T42]

    inside: (sets, tests) bool, in the order of the scales. failed: (tests,) bool.
    The sequence begins with the first set in which so many plans lie that none may fail: who lies
    where decides that, not who fails. It ends with the first test that does not pass.
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
) -> list[Nested]:
    """The nested sets in the order of the scales, fixed before any test: the corridors are those of
    the last one, of which each set has those that hold one of SEEDS plans, its seed there.
    """
    scenes = [_scene(query, scale) for scale in asked.scales]
    found = Prepared(scenes[-1]).solve(key, settings.replace(proof=False))
    cover = found.cover
    if not len(cover.corridors):
        return [Nested(scene, (), cover.within) for scene in scenes]
    last = Nested(scenes[-1], tuple(cover.corridors), cover.within)
    p0, k = np.split(last.plans.sample(rng, SEEDS), [query.model.n_p], axis=1)
    return [Nested(scene, _seeded(scene, last.corridors, p0, k), cover.within) for scene in scenes]


def _scene(query: Query, scale: float) -> Scene:
    """The problem under the scaled tube, all obstacles: those that no plan of one tube comes near
    may be near plans of another.
    """
    claim = query.model.claim
    tube = scaled(claim.tube, np.full(claim.tube.n_bins, scale), np.zeros(claim.tube.n_c))
    model = query.model.replace(claim=stand_in(claim, tube))
    return padded(lowered(query.of(model).nominal()))


def _seeded(
    scene: Scene, corridors: tuple[Corridor, ...], p0: np.ndarray, k: np.ndarray
) -> tuple[Corridor, ...]:
    """The corridors in which one of the plans lies under the tube of the scene, with that plan."""
    e = predictions(scene, p0, k)
    safe = points(p0, k, e).at(e.reaches)
    kept = Corridors(scene.model.tube, corridors).kept(safe.path, safe.bin)
    return tuple(
        one._replace(p0=safe.p0[row], k=safe.k[row])
        for one, row, held in zip(corridors, kept.argmax(axis=0), kept.any(axis=0), strict=True)
        if held
    )


def _told(
    model: TrajectoryModel, chosen: Nested, steps: tuple[Step, ...], asked: Validate
) -> TrajectoryModel:
    """The model under the tube of the set that was accepted, with (V) as its claim."""
    last, tube = steps[-1], chosen.scene.model.tube
    part = canonical(problem_part(chosen.scene.problem, chosen.scene.model))
    evidence = {
        "of": model.claim.hash,
        "scale": str(last.scale),
        "tests": asked.tests,
        "steps": [[str(step.scale), step.n, step.failed] for step in steps],
        "scene": hashlib.sha256(part.encode()).hexdigest(),
    }
    shown = {"eps": asked.risk, "delta": asked.delta, "n": last.n, "discard": last.failed}
    return model.replace(
        claim=scene_claim(model.claim, tube, law_of(asked.system), evidence, **shown)
    )


def _as_answer(
    query: Query,
    chosen: Nested,
    settings: Settings,
    key: jax.Array,
    rng: np.random.Generator,
    looks: Looks | None,
) -> Answer:
    """The answer whose corridors are those of the set, proved as any other."""
    begin = time.perf_counter()
    scene = padded(lowered(query.nominal()))
    limit = Limit(settings.budget_s)
    drawn = draw_safe_plans(scene, key, rng, COVERED_BY, settings.confidence, limit, chosen.within)
    held = chosen._replace(scene=scene).plans.has(drawn.points)
    rule = stopping_rule(settings.target, settings.confidence)
    cover = drawn._replace(
        points=drawn.points.at(held),
        coverage=rule.after(held).coverage,
        corridors=chosen.corridors,
    ).pick(rng, settings.samples)
    return answered(scene, cover, None, settings, looks, begin)
