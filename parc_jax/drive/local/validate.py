"""Validated sets: learn, then test. Nested certified sets under falling scales of the tube, of
which tests in this one scene accept as many as show the risk that was asked for. [T42]
"""

import time
from dataclasses import replace
from fractions import Fraction
from itertools import takewhile
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Look, Looks
from parc_jax.checker.entries import hash_of
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, folded, generator, key_of, stream
from parc_jax.common.spelling import hex_text
from parc_jax.drive.local.nested import (
    SEEDS,
    first_set,
    fixed_sequence,
    level,
    levels_of,
    nested_sets,
)
from parc_jax.drive.local.trials import (
    UNSEEN,
    Trial,
    by_recordings,
    ledger_of_tests,
    one_of_each,
    run_once,
)
from parc_jax.drive.local.validation import OF_RECORDINGS, Step, Validate, Validation
from parc_jax.learning.bound.calibrate import BEGINS, begins, lost_among
from parc_jax.learning.bound.claim import scene_claim
from parc_jax.learning.bound.counts import RECORDED_IDS, NoStatement, required_runs
from parc_jax.learning.bound.fresh import (
    CALIBRATION,
    SEEN,
    entry_of,
    identity_of,
    ledger_of,
    left_out_beside,
    not_named,
)
from parc_jax.learning.bound.start_gap import declared_gap, trial_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import seed_of
from parc_jax.learning.runs.law import law_of
from parc_jax.learning.system import System
from parc_jax.planner import answered
from parc_jax.problem.robust.nominal import Query
from parc_jax.proof.certificate.write import corridor_part, problem_part
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.safe_plans import SafePlans
from parc_jax.safe_set.corridors.search import draw_safe_plans
from parc_jax.safe_set.corridors.stopping import Limit, stopping_rule
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.scene import lowered, padded

TESTS = "validation"  # the use of these runs in a ledger
APART = 2**32 - 1  # beyond every number of a row
COVERED_BY = 20_000  # plans drawn to tell how much of the safe set is held
TRIED = 200  # k drawn from K, which tell how many recordings a set may have starts for


def validated(
    answer: Answer,
    key: jax.Array,
    settings: Settings,
    asked: Validate | None = None,
    quiet: bool = True,
) -> Answer:
    """The answer with its `validation`: nested sets of plans of its query are tested, and as many
    accepted as show the risk. [T42]

    key: its SCENE stream is used; by later looks, that of a key from its DRIVEN stream. settings:
    of the search under the smallest tube. asked: by default the recordings that the model keeps,
    where they can show more than its claim. Raises InputError for a problem under uncertainty,
    another system, and recordings that do not fit or were seen in training.
    """
    query = answer.scene.nominal.query
    lawless = query.problem.uncertainty is not None or query.model.given
    if asked is None:
        asked = None if lawless else _by_kept(answer)
        if asked is None:
            return answer
        # by the recordings: a solve that is repeated makes the same tests, and is no second look
        key = key_of(int(identity_of(asked.source)[:7], 16))
    if lawless:
        raise InputError(
            "validate: expected a problem without uncertainty and a model without given "
            "parameters, whose law nobody stated; got one. Solve it without validate=, "
            "--validate, --runs and --risk."
        )
    source, K = asked.source, query.model.domain
    if asked.looks.taken:  # by which what is tested now may have been chosen
        key = folded(stream(key, Stage.DRIVEN), asked.looks.taken)
    # apart from the runs, whose keys count up from the first row
    own = folded(stream(key, Stage.SCENE), APART)
    seeds, draws, after = (generator(folded(own, i)) for i in range(3))
    if isinstance(source, RolloutBatch):
        source = one_of_each(query.model, source, draws)
    else:
        require_same(source, query.model)
        if K.text != (own_K := source.domain.text):
            told = f"validate: expected a system with the K of the model, {K.text}; got {own_K}"
            raise InputError(f"{told}. Give it that domain.")
    start = trial_of(query.model.claim, source, jax.random.fold_in(own, 3))
    look = asked.looks.take(answer.looks)
    if isinstance(source, RolloutBatch):
        how = asked.risk, look.delta, asked.scales, asked.way, settings, seed_of(key)
        at = np.asarray(answer.scene.at).tolist()  # spelled whole
        what = query.model.claim.hash, identity_of(asked.source), at
        part = problem_part(answer.scene.problem, query.model)
        about = hash_of([part, *map(str, (*what, *how))])
        look = look._replace(others=look.others + _tested_before(asked, about, look.delta))
    asked = replace(asked, delta=look.delta, looks=Looks(look.delta, planned=1, taken=1))
    sets = nested_sets(query, own, seeds, settings, asked)
    if not sets:
        return replace(answer, validation=Validation(None, (), asked))
    # where the sequence begins is settled by draws that are no tests
    least = required_runs(asked.risk, asked.delta)
    if isinstance(source, RolloutBatch):
        others = levels_of(sets, seeds, seeds.uniform(K.lo, K.hi, (TRIED, K.n)))[1].min(axis=1)
        first = first_set(others, len(sets), asked.tests, least)
        trial = by_recordings(source, sets, draws, first)._replace(start=start)
        tests = entry_of(TESTS, source)
    else:
        some, plans = (sets[-1].sample(*x) for x in ((seeds, SEEDS), (draws, asked.tests)))
        others = level(sets, *np.split(some, [query.model.n_p], axis=1))
        first = first_set(others, len(sets), asked.tests, least)
        failed, lost, _ = run_once(source, sets[-1].scene, key, Stage.SCENE, plans, quiet, start)
        # of the last set are all of them, though the rounding of a membership may say otherwise
        levels = level(sets, *np.split(plans, [query.model.n_p], axis=1))
        inside = np.minimum(levels, len(sets) - 1) <= np.arange(len(sets))[:, None]
        trial = Trial(inside, inside & failed, lost, start)
        made = [source.name, list(seed_of(key)), int(Stage.SCENE)]
        tests = [TESTS, *made, [[0, len(plans) - 1]]]
    steps, passed = fixed_sequence(asked, trial.inside, trial.failed, first)
    if not passed:
        return replace(answer, validation=Validation(None, steps, asked))
    chosen = sets[first + passed - 1]
    del sets  # what they know takes hundreds of MB
    about = chosen, steps[:passed], asked, look, source, trial, tests
    under = query.of(_accepted_model(query.model, *about))
    found = replace(_as_answer(under, chosen, settings, own, after), looks=answer.looks)
    refused = len(chosen.corridors) - len(found.corridors)
    return replace(answer, validation=Validation(None if refused else found, steps, asked, refused))


class _Test(NamedTuple):
    """What was tested by which recorded runs, in whose account, with which delta."""

    about: str
    runs: frozenset[str]
    looks: Looks
    delta: Fraction


_TESTS: list[_Test] = []  # of this process


def _tested_before(asked: Validate, about: str, delta: Fraction) -> tuple[Fraction, ...]:
    """Deltas of the tests that some of these runs made before this one, in other accounts."""
    runs = frozenset(asked.source.hashes().tolist())
    tests = [one for one in _TESTS if one.runs & runs]
    if all(one.about != about for one in tests):
        _TESTS.append(_Test(about, runs, asked.looks, delta))
    before = takewhile(lambda one: one.about != about, tests)
    return tuple(one.delta for one in before if one.looks is not asked.looks)


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
        declared_gap(answer.model.claim)
    except InputError:  # such as: they cannot be told from those of training
        return None
    return Validate(held)


def _accepted_model(
    model: TrajectoryModel,
    chosen: SafePlans,
    steps: tuple[Step, ...],
    asked: Validate,
    look: Look,
    source: System | RolloutBatch,
    trial: Trial,
    tests: list,
) -> TrajectoryModel:
    """The model under the tube of the accepted set, with (V) as claim. tests: of its ledger."""
    last, scene = steps[-1], chosen.scene
    within = None if chosen.within is None else [hex_text(side) for side in chosen.within]
    evidence = {
        SEEN: [*ledger_of(model.claim), tests],
        "of": model.claim.hash,
        "scale": str(last.scale),
        "way": str(asked.way),
        "tests": asked.tests,
        "steps": [[str(step.scale), step.n, step.failed] for step in steps],
        "scene": hash_of(problem_part(scene.problem, scene.model)),
        "corridors": len(chosen.corridors),
        "within": within,
        "at": None if scene.at is None else hex_text(scene.at),
        "set": hash_of(
            [[corridor_part(one, scene.problem) for one in chosen.corridors.all], within]
        ),
    }
    shown = {"eps": asked.risk, "delta": asked.delta, "n": last.n, "discard": last.failed}
    # of the start the assumptions tell
    start = trial.start.record if trial.start else model.claim.evidence.get("start")
    evidence |= lost_among(trial.lost) | ({"start": start} if start else {})
    if isinstance(source, RolloutBatch):
        law, tested, gaps = source.law, tests[4], left_out_beside(model.claim, asked.source)
        evidence |= {RECORDED_IDS: tested, "recordings": hash_of(tested)}
        evidence |= {"shape": "shape" in model.claim.evidence}
        evidence |= {"left_out": gaps} if gaps else {}
        # runs of which the error shape is told may be those that size it
        sized = {CALIBRATION} if "shape" in model.claim.evidence else set()
        fresh = ", ".join(not_named(model.claim, True, sized))
        more = (UNSEEN, *look.ledger[1:], f"FRESH({fresh})")
        about = model.claim.subject
        if about.rotation is not None and not begins(about):  # they are logged, its runs were not
            more += (BEGINS,)
        if model.claim.subject.unordered(source.subject):
            more += ("ORDER_OF_K(that of the model; not all have names)",)
    else:
        law, gaps, more = law_of(source), 0, look.ledger
    shown["assumptions"] = ledger_of_tests(model.claim, trial.lost, gaps, trial.start) + more
    claim = scene_claim(model.claim, scene.model.tube, law, evidence, **shown)
    return model.replace(claim=claim, held=None)


def _as_answer(
    query: Query, chosen: SafePlans, settings: Settings, key: jax.Array, rng: np.random.Generator
) -> Answer:
    """The answer whose corridors are those of the set, proved as any other."""
    begin = time.perf_counter()
    scene = padded(lowered(query.nominal()))
    plans = SafePlans(scene, Corridors(scene.model.tube, chosen.corridors.all), chosen.within)
    limit = Limit(settings.budget_s)
    drawn = draw_safe_plans(scene, key, rng, COVERED_BY, settings.confidence, limit, chosen.within)
    held = plans.has(drawn.points)
    some = rng.permutation(np.flatnonzero(held))[: settings.samples]
    cover = drawn._replace(
        points=drawn.points.at(some),
        coverage=stopping_rule(settings.target, settings.confidence).after(held).coverage,
        corridors=plans.corridors.all,
    )
    return answered(scene, cover, None, settings, begin)
