"""The main job: one command from rollouts to a proved safe set, its replay, the pictures, and the
plan that is executed. [T23]
"""

import json
import platform
import shutil
import sys
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.replay import replay, tally
from parc_jax.app.study.report import METRICS, VALIDATED_SET, Studied, facts_of, final_error
from parc_jax.app.study.report import figures as draw_figures
from parc_jax.app.study.settings import Study
from parc_jax.common.errors import InputError
from parc_jax.common.keys import key_of
from parc_jax.common.spelling import rounded_up
from parc_jax.common.stopwatch import Stopwatch
from parc_jax.drive.local.localise import Local, key_of_trial
from parc_jax.drive.local.validate import validated
from parc_jax.drive.local.validation import Validate
from parc_jax.learning.bound.start_gap import invariances, trial_of, try_starts
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.learn import learn_report
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.files import write_atomic
from parc_jax.learning.runs.law import Subject, law_of, subject_of
from parc_jax.learning.systems.chained import hand_over_of
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem
from parc_jax.problem.uncertainty import FREE, Uncertainty
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.verdict.outline import require_fit, require_same

LOOKS = 2  # a test of the plan to drive, and a claim near it
# what fields of a study ask for
MADE = {"risk": "the validated set", "driven": "the plan to drive", "repeats": "the replay"}
UNFINISHED = "unfinished"  # folder of finished runs, until the answer is there


def run_study(
    system,
    problem: Problem,
    study: Study,
    out: Path,
    seed: int,
    model: TrajectoryModel | None = None,
    quiet: bool = False,
    learn_from=None,
    figures: bool = False,
    during: Callable[[str], AbstractContextManager] = nullcontext,
    asked: Collection[str] = (),
) -> Studied:
    """Learn (unless a model is given), solve, replay, and write it all below `out`.

    learn_from: the same system on another plant, for the many runs of training and bound; the
        replay is of `system`.
    figures: draw the pictures, a first one below `out`/unfinished before the many runs of a model
        that is learned: of plans proved under a bound of few runs.
    quiet: no progress bars, and no word about places of files on stderr.
    during: entered for each stage, by its name.
    asked: fields of the study that are asked for by name: refused where they cannot be made, while
        others are left out, with a word.

    The files of an earlier study stay until the answer of this one is on disk, and so do the
    finished runs below `out`/unfinished, from which a stopped study continues, and its model.
    Raises InputError for settings or scenes that make no sense, before the first run, and
    SoundnessError when a replay contradicts a proof.
    """
    require_fit(problem, subject_of(system))
    source = system if learn_from is None else learn_from
    k_law = getattr(source, "k_law", "") if model is None else model.claim.law.k_law
    cannot = unmade(problem, subject_of(system), k_law)
    wanted = {"risk": study.risk is not None, "driven": study.driven, "repeats": True}
    for name, why in cannot.items():
        if wanted[name] and name in asked:
            raise InputError(
                f"{name}: expected a problem of which it can be made; got one {why}. Leave it out."
            )
    key, watch, out = key_of(seed), Stopwatch(during), Path(out)
    settings, cold = study.settings, None
    start = None  # of the replay, whatever was seen on another plant
    if model is not None:
        require_same(system, model)
        start = trial_of(model.claim, system, key_of_trial(key))
    elif learn_from is not None and learn_from is not system:
        with watch("other starts"):
            start = try_starts(system, key_of_trial(key), study.bound.gap)

    def first_query(model: TrajectoryModel, picture: bool = True) -> None:
        """Compile for the queries to come; with a picture, prove and draw the answer."""
        nonlocal cold
        with watch("first query (cold)"):
            cold = Planner(model).warm_up(problem, settings, proof=picture)
        if picture and len(cold.samples):
            from parc_jax.app.plot.samples import samples

            samples(cold, None, first := out / UNFINISHED / "samples.png")
            if not quiet:
                under = f"proved under a tube {in_short(cold.model.claim)}, so far"
                print(f"{system.name}: first plans are in {first}, {under}.", file=sys.stderr)

    given = model is not None
    if model is None:
        work = out / UNFINISHED
        query = first_query if figures and settings.proof else None
        learned = learn_report(source, key, study, path=work, quiet=quiet, watch=watch, first=query)
        model = learned.model
        model.save(work / "model.npz")
        del learned  # with its runs, which take hundreds of MB
    if cold is None:
        first_query(model, picture=False)
    with watch("regions"):
        table = enumerate_regions(model.net, model.domain)
    with watch("safe set"):
        answer = Planner(model).solve(problem, key, settings)
    if study.risk is not None and "risk" not in cannot:
        with watch("validated set"):
            test = Validate(system, study.risk, study.bound.delta)
            answer = validated(answer, key, settings, test, quiet)
    from parc_jax.app.plot.of_answer import pictures

    older = [out / name for name in (METRICS, "near.json", VALIDATED_SET)]
    for place in [*older, *pictures(out)]:  # of an older study
        place.unlink(missing_ok=True)
    # before the replay: if that finds a contradiction, the evidence is on disk
    model.save(out / "model.npz")
    answer.save(out / "answer.json")
    if answer.validation is not None and answer.validation.answer is not None:
        answer.validation.answer.save(out / VALIDATED_SET)
    if not given:
        shutil.rmtree(out / UNFINISHED, ignore_errors=True)
    driven = study.driven and answer.status.found and "driven" not in cannot
    runs = None
    if len(answer.samples) and "repeats" not in cannot:
        with watch("replay"):
            plans = np.repeat(answer.samples, study.repeats, axis=0)
            runs = replay(system, answer.scene, plans, key, quiet)
    tried = start and start.said_in(invariances(model.claim.subject.rotation))
    of_them = {"start": tried, "law": law_of(system, "given by the plans").describe()}
    metrics = {"system": system.name, "seed": seed, "device": jax.devices()[0].device_kind}
    metrics |= {"jax": jax.__version__, "python": platform.python_version()}
    metrics |= {
        "regions": table.count,
        "final_error": final_error(model).tolist(),
        **facts_of(answer, cold.cover.timings["first_sample_s"]),
        "share_of_k": answer.share_of_k(),
        "replay": runs and tally(runs, study.repeats, study.bound.delta) | of_them,
        "driven": None,
        "not_made": {MADE[name]: why for name, why in cannot.items() if wanted[name]},
        "stages": watch.stages,
        "claim": model.claim.to_json(),
    }
    outcome = Studied(answer, runs, table, finish(out, metrics))
    if figures:
        metrics["figures"] = [file.name for file in draw_figures(outcome, out)]
        finish(out, metrics)
    # now, since the plan to execute takes as long as the rest
    if driven and not quiet:
        print(f"{system.name}: the answer is in {out}.", file=sys.stderr)
    if driven:
        with watch("the plan that is driven"):
            metrics["driven"] = drive(system, answer, study, key, out, quiet)
        answer.save(out / "answer.json")  # again, with the looks that are taken
        finish(out, metrics)
    return outcome


def unmade(problem: Problem, about: Subject, k_law: str) -> dict[str, str]:
    """What a study cannot make of a problem, by the field that asks for it, and of what problem."""
    known = problem.uncertainty or Uncertainty()
    doubt = "" if known.is_nothing else "under an uncertainty"
    boxes = [value for _, value in (*known.given, *known.unknown) if value != FREE]
    # a plan has several realisations, and no one run to replay
    several = known.heading or any(off for _, off in known.k) or any(lo < hi for lo, hi in boxes)
    # runs of a chosen k are refused
    moving = "" if hand_over_of(k_law) is None else "of a robot that moves at the start"
    given = "with parameters that are measured at the start" if about.given else ""
    reasons = doubt or given, doubt or moving, doubt if several else moving
    return {name: why for name, why in zip(MADE, reasons, strict=True) if why}


def drive(system, answer: Answer, study: Study, key: jax.Array, out: Path, quiet: bool) -> dict:
    """Test and localise the plan with most room: plan and sentences (D). Writes the answer under
    the local claim as near.json. [T23]
    """
    bound = study.bound
    chosen = answer.choose(delta=bound.delta, looks=LOOKS)
    chosen = chosen.test(system, key, eps=bound.eps, quiet=quiet)
    chosen = chosen.localise(system, key, Local(eps=bound.eps, gap=bound.gap), quiet=quiet)
    near = chosen.near
    if near.answer is not None:
        near.answer.save(out / "near.json")
    made = chosen.tested
    tested = {"runs": made.n, "failures": made.failures, "sure": made.look.sure}
    beside = [entry for entry in made.assumed if entry not in answer.model.claim.assumptions]
    tested |= {"at_most": rounded_up(made.eps), "law": made.law, "beside": beside}
    shares = {"share_of_k": float(near.share), "proved_share_of_near": float(near.held)}
    widths = {"narrower_at_end": near.at_end, "narrower_on_the_way": near.on_the_way}
    return {"plan": chosen.plan.tolist(), "statement": chosen.details()} | tested | shares | widths


def finish(out: Path, metrics: dict) -> dict:
    """Write metrics.json and hand the metrics back."""
    write_atomic(out / METRICS, json.dumps(metrics, indent=1).encode())
    return metrics
