"""Validated sets: learn, then test. Nested certified sets under falling scales of the tube, of
which tests in this one scene accept as many as show the risk that was asked for. [T42]
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Looks
from parc_jax.checker.entries import hash_of
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.common.options import check_count
from parc_jax.common.spelling import hex_text, rounded_down, rounded_up
from parc_jax.drive.local.trials import (
    TRIED,
    UNSEEN,
    Trial,
    by_recordings,
    by_runs,
    first_set,
    level,
    levels_of,
    one_of_each,
    order_of_k,
    shape_of,
)
from parc_jax.learning.bound.calibrate import ledger_of_tests, lost_among, scaled
from parc_jax.learning.bound.claim import recorded, scene_claim
from parc_jax.learning.bound.counts import (
    RECORDED_IDS,
    RECORDINGS,
    RUNS,
    NoStatement,
    as_probability,
    most_discards,
    required_runs,
    wrong_claim_probability,
)
from parc_jax.learning.bound.declared import stand_in
from parc_jax.learning.bound.fresh import freshness_of, left_out_beside, names_of
from parc_jax.learning.bound.statement import confidence_of, probability
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.batch import RolloutBatch
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
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.pointwise import predictions
from parc_jax.safe_set.verdict.scene import Scene, lowered, padded
from parc_jax.statement import all_plans

# tests by default: so many, or so many times as many as suffice where none fails
LEAST_TESTS, TIMES = 14_000, 10
# of the claim's tube, down to a fifth of it; of the error shape, which nothing has sized yet
SCALES = tuple(round(0.93**i, 3) for i in range(23))
SCALES_OF_SHAPE = tuple(round(4 * 0.85**i, 3) for i in range(28))
RISK_AND_DELTA, OF_RECORDINGS = (0.003, 1e-3), (0.15, 0.05)  # by default
SEEDS = 1000  # plans drawn before any test, one of which each corridor of a set needs inside
APART = 2**32 - 1  # beyond every number of a row
COVERED_BY = 20_000  # plans drawn to tell how much of the safe set is held


@dataclass(frozen=True)
class Validate:
    """How a set of plans is validated in one scene, fixed before its runs are made. [T42]

    source: the black box of the model, each test a run of it; or recorded runs that its training
        has not seen, such as `split` sets aside: each recording is one test, a run of it moved to a
        start that the set has for its k.
    risk: most probability with which a plan drawn from the set may fail. delta: that of saying so
        falsely. 0.003 and 1e-3 by default, with recordings 0.15 and 0.05, for which 19 suffice
        where none fails.
    tests: plans drawn and run once each; None for 14,000, or ten times as many as suffice where
        none fails if that is more (23,000 for 0.003), or for all recordings.
    scales: of the claim's tube, or with recordings of the error shape, which those that sized the
        tube have not seen; falling: sets are tested in this order. None for 1 to 0.2, 4 to 0.05.
    looks: how often one scene may be tried, each time at its share of delta; once more is refused.
    Raises InputError.
    """

    source: System | RolloutBatch
    risk: Fraction | float | str | None = None
    delta: Fraction | float | str | None = None
    tests: int | None = None
    scales: Sequence[float] | None = None
    looks: int = 1
    _taken: dict[tuple, Looks] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        runs = self.source if isinstance(self.source, RolloutBatch) else None
        if runs is None:
            check_system(self.source)
        usual = RISK_AND_DELTA if runs is None else OF_RECORDINGS
        given = [self.risk, self.delta]
        some = [own if x is None else x for x, own in zip(given, usual, strict=True)]
        risk, delta = as_probability("risk", some[0]), as_probability("delta", some[1])
        check_count("looks", self.looks, 1, "how often a scene may be tried")
        least = required_runs(risk, delta / self.looks)
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
        if scales.ndim != 1 or not len(scales) or not (np.diff(scales, append=0) < 0).all():
            raise InputError(
                f"scales: expected falling positive numbers, such as (1.0, 0.8, 0.6); got "
                f"{self.scales!r:.60}."
            )
        exact = {"risk": risk, "delta": delta, "tests": tests, "scales": tuple(scales.tolist())}
        for name, value in exact.items():
            object.__setattr__(self, name, value)

    def look(self, answer: Answer) -> "Validate":
        """The test of one look at the scene of an answer. Raises InputError when all are spent."""
        at = () if answer.scene.at is None else tuple(answer.scene.at)
        part = problem_part(answer.problem, answer.model)
        of_scene = self._taken.setdefault((hash_of(part), at), Looks())
        share = of_scene.declare(self.delta, self.looks).take().delta
        return replace(self, delta=share, looks=1)


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
            return "Validated: no set."
        found, claim, safe = self.answer, self.answer.model.claim, ""
        p = claim.premises
        share, held = found.share, found.coverage
        if share is not None:
            at_least = Fraction(share.at_least) * Fraction(held.at_least)
            both = Fraction(str(share.confidence)) + Fraction(str(held.confidence)) - 1
            around = "" if found.cover.within is None else "around what a search found, of "
            of_all = around + all_plans(found.scene.at is not None, claim.law.box)
            sure = f"with confidence {rounded_down(both, 10)}"
            safe = f"at least {rounded_down(100 * at_least, 3)} % of {of_all}, {sure}. "
        drawn = "drawn from them"
        if recorded(claim):
            drawn = f"for k as in the log, of {p['tests']:,} recordings,"
        return (
            f"Validated in this scene: {safe}A plan {drawn} fails with probability at most "
            f"{probability(p['risk'], 2)}, confidence {confidence_of(p)}."
        )

    def details(self) -> str:
        """The sentence (V), or why there is none."""
        if self.answer is not None:
            return f"(V) {self.answer.model.claim.details()}"
        asked = self.asked
        risk, least = rounded_up(asked.risk), required_runs(asked.risk, asked.delta)
        if not self.steps:
            return "(V) No set was validated: no plan was found under the smallest tube."
        if self.steps[0].n < least:
            return (
                f"(V) No set was validated: the first one holds {self.steps[0].n:,} of "
                f"{asked.tests:,} tests, where a risk of {risk} takes {least:,}. Allow more tests, "
                "or more risk."
            )
        if self.refused:
            return (
                f"(V) No set was validated: the exact checker refused {self.refused:,} corridors "
                "of the one that passed. Validate with another key."
            )
        first = self.steps[0]
        allowed = most_discards(first.n, float(asked.risk), float(asked.delta))
        return (
            f"(V) No set was validated: of {first.n:,} tests of the first one {first.failed:,} "
            f"failed, where a risk of {risk} allows {allowed:,}. Allow more risk."
        )


def validated(
    answer: Answer,
    key: jax.Array,
    settings: Settings,
    asked: Validate | None = None,
    quiet: bool = True,
) -> Answer:
    """The answer with its `validation`: nested sets of plans of its query are tested, and as many
    accepted as show the risk. [T42]

    key: its SCENE stream is used, and nothing else. settings: of the search under the smallest
    tube. asked: by default the recordings that the model keeps, where they can show more than its
    claim. Raises InputError for a problem under uncertainty, another system, recordings that do not
    fit or were seen in training, and a set too small to draw from.
    """
    query = answer.scene.nominal.query
    lawless = query.problem.uncertainty is not None or query.model.given
    if asked is None:
        asked = None if lawless else _by_kept(answer)
        if asked is None:
            return answer
        # a solve that is repeated makes the same tests: it is no second look
        key = jax.random.PRNGKey(0)
    if lawless:
        raise InputError(
            "validate: expected a problem without uncertainty and a model without given "
            "parameters, whose law nobody stated; got one. Solve it without validate=."
        )
    source = asked.source
    # apart from the runs, whose keys count up from the first row
    own = jax.random.fold_in(stream(key, Stage.SCENE), APART)
    seeds, draws, after = (generator(jax.random.fold_in(own, i)) for i in range(3))
    if isinstance(source, RolloutBatch):
        source = one_of_each(query.model, source, draws)
    else:
        require_same(source, query.model)
    asked = asked.look(answer)
    sets = _sets(query, own, seeds, settings, asked)
    if not len(sets[-1].corridors):
        return replace(answer, validation=Validation(None, (), asked))
    # where the sequence begins is settled by draws that are no tests
    least = required_runs(asked.risk, asked.delta)
    if isinstance(source, RolloutBatch):
        K = query.model.domain
        others = levels_of(sets, seeds, seeds.uniform(K.lo, K.hi, (TRIED, K.n)))[1].min(axis=1)
        first = first_set(others, len(sets), asked.tests, least)
        trial = by_recordings(source, sets, draws, first)
    else:
        plans = [sets[-1].sample(rng, n) for rng, n in ((seeds, SEEDS), (draws, asked.tests))]
        others = level(sets, *np.split(plans[0], [query.model.n_p], axis=1))
        first = first_set(others, len(sets), asked.tests, least)
        trial = by_runs(source, sets, key, plans[1], quiet)
    steps, passed = fixed_sequence(asked, trial.inside, trial.failed, first)
    if not passed:
        return replace(answer, validation=Validation(None, steps, asked))
    chosen = sets[first + passed - 1]
    under = query.of(_accepted_model(query.model, chosen, steps[:passed], asked, source, trial))
    found = replace(_as_answer(under, chosen, settings, own, after), looks=answer.looks)
    refused = len(chosen.corridors) - len(found.corridors)
    validation = Validation(None if refused else found, steps, asked, refused)
    return replace(answer, validation=validation)


def _by_kept(answer: Answer) -> Validate | None:
    """Tests by the recordings that the model keeps; None where they are too few, or a plan drawn
    from the answer fails no more often than they can show.
    """
    held, risk = answer.model.held, answer.risk()
    if held is None or held.recordings < required_runs(*OF_RECORDINGS):
        return None
    if not isinstance(risk, NoStatement) and risk.bound <= OF_RECORDINGS[0]:
        return None
    try:
        one_of_each(answer.model, held, np.random.default_rng(0))
    except InputError:  # such as: they cannot be told from those of training
        return None
    return Validate(held)


def fixed_sequence(
    asked: Validate, inside: np.ndarray, failed: np.ndarray, first: int
) -> tuple[tuple[Step, ...], int]:
    """Fixed-sequence testing: the tests that are made, and how many of them pass. [T42]

    inside, failed: (sets, tests) bool, in the order of the scales. first: set to begin with, fixed
    before any of these tests was looked at. The sequence ends with the first test that does not
    pass.
    """
    steps: list[Step] = []
    risk, most = math.nextafter(float(asked.risk), 0.0), 0
    for scale, among, bad in list(zip(asked.scales, inside, failed, strict=True))[first:]:
        # never fewer than before, though recordings that begin elsewhere may: more is careful
        most = max(most, int((among & bad).sum()))
        steps.append(Step(scale, int(among.sum()), most))
        if wrong_claim_probability(steps[-1].n, risk, steps[-1].failed) > asked.delta:
            return tuple(steps), len(steps) - 1
    return tuple(steps), len(steps)


def _sets(
    query: Query, key: jax.Array, rng: np.random.Generator, settings: Settings, asked: Validate
) -> list[SafePlans]:
    """The nested sets in the order of the scales, fixed before any test: the corridors are those of
    the last one, of which each set has those that hold one of SEEDS plans, its seed there.
    """
    scenes = []
    recorded = isinstance(asked.source, RolloutBatch)
    whole = shape_of(query.model.claim) if recorded else query.model.tube
    for scale in asked.scales:
        tube = scaled(whole, np.full(whole.n_bins, scale), np.zeros(whole.n_c))
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
    if not len(safe.k):
        return Corridors(tube, [])
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
    source: System | RolloutBatch,
    trial: Trial,
) -> TrajectoryModel:
    """The model under the tube of the accepted set, with (V) as its claim."""
    last, scene = steps[-1], chosen.scene
    within = None if chosen.within is None else [hex_text(side) for side in chosen.within]
    evidence = {
        "of": model.claim.hash,
        "scale": str(last.scale),
        "tests": asked.tests,
        "steps": [[str(step.scale), step.n, step.failed] for step in steps],
        "scene": hash_of(problem_part(scene.problem, scene.model)),
        "corridors": len(chosen.corridors),
        "within": within,
        "set": hash_of(
            [[corridor_part(one, scene.problem) for one in chosen.corridors.all], within]
        ),
    }
    shown = {"eps": asked.risk, "delta": asked.delta, "n": last.n, "discard": last.failed}
    gaps = left_out_beside(model.claim, asked.source) if isinstance(source, RolloutBatch) else 0
    shown["assumptions"] = ledger_of_tests(model.claim, trial.lost, gaps)
    if not isinstance(source, RolloutBatch):
        shown["assumptions"] += ("UNSEEN(1 look; no other key was tried in this scene)",)
    evidence |= lost_among(trial.lost)
    if "start" in model.claim.evidence:  # of which the assumptions tell
        evidence["start"] = model.claim.evidence["start"]
    law = source.law if isinstance(source, RolloutBatch) else law_of(source)
    if isinstance(source, RolloutBatch):
        tested = names_of(source)["runs"]
        evidence |= {RECORDED_IDS: tested, "recordings": hash_of(tested)}
        evidence["shape"] = "shape" in model.claim.evidence
        fresh = freshness_of(model.claim.evidence.get("training"), source.groups)
        shown["assumptions"] += (UNSEEN, *fresh, *order_of_k(model, source))
        evidence |= {"left_out": gaps} if gaps else {}
    claim = scene_claim(model.claim, scene.model.tube, law, evidence, **shown)
    return model.replace(claim=claim, held=None)


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
