"""The main job: one command from rollouts to a proved safe set, its replay and the pictures."""

import json
import platform
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.compare import compare
from parc_jax.app.study.driven import compile_near, drive
from parc_jax.app.study.numbers import facts_of
from parc_jax.app.study.replay import Replay, replay, tally
from parc_jax.app.study.settings import Study
from parc_jax.common.keys import key_of
from parc_jax.common.options import part_of
from parc_jax.common.stopwatch import Stopwatch
from parc_jax.learning.learn import Learned, final_error, learn
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.files import write_atomic
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem
from parc_jax.proof.regions import RegionTable, enumerate_regions
from parc_jax.safe_set.settings import Search, Settings
from parc_jax.safe_set.verdict.outline import outline_of, require_fit, require_same

METRICS = "metrics.json"
UNFINISHED = "unfinished"  # folder of finished runs, until the answer is there


class Studied(NamedTuple):
    """Everything a study produced. learned is None when the model came from a file.

    runs: of every returned plan, study.repeats each, grouped by plan; None when there is no plan.
    """

    answer: Answer
    runs: Replay | None
    table: RegionTable
    learned: Learned | None
    metrics: dict


def run_study(
    system,
    problem: Problem,
    study: Study,
    out: Path,
    seed: int,
    model: TrajectoryModel | None = None,
    quiet: bool = False,
    learn_from=None,
    first: Callable[[Answer], None] | None = None,
    early: Callable[[Studied], None] | None = None,
    during: Callable[[str], AbstractContextManager] = nullcontext,
) -> Studied:
    """Learn (unless a model is given), solve, replay, and write it all below `out`.

    learn_from: the same system on another plant, for the many runs of training and claims; the
        replay is of `system`.
    first: called with a first answer, proved after few looks under a claim of few runs, where a
        model is learned, and before its many runs; below `out`/unfinished is room for what it
        tells.
    early: called with all but the plan that is driven, which takes as long as the rest; answer,
        model and metrics are on disk by then.
    during: what is entered for each stage, by its name.

    What an earlier study left there stays whole until the answer of this one is on disk, and so do
    the finished runs below `out`/unfinished, from which a stopped study continues; a model that was
    learned is there too.
    Raises InputError for settings or scenes that make no sense, before the first run, and
    SoundnessError when a replay contradicts a proof.
    """
    require_fit(problem, outline_of(system))
    if model is not None:
        require_same(system, model)
    key = key_of(seed)
    watch = Stopwatch(during)
    out = Path(out)
    settings = Settings(**part_of(study, Search))
    cold = None

    def first_query(model: TrajectoryModel, told: Callable[[Answer], None] | None = None) -> None:
        """What it compiles serves the next one."""
        nonlocal cold
        with watch("first query (cold)"):
            cold = Planner(model).warm_up(problem, settings, proof=told is not None)
        if told is not None and len(cold.samples):
            told(cold)

    learned = None
    if model is None:
        work = out / UNFINISHED
        ask = partial(first_query, told=first) if first is not None and settings.proof else None
        learned = learn(learn_from or system, study, key, watch, work, quiet, ask)
        model = learned.main
        model.save(out / UNFINISHED / "model.npz")
    if cold is None:
        first_query(model)
    with watch("regions"):
        table = enumerate_regions(model.net, model.domain)
    rows = []
    if learned is not None and study.compared:
        with watch("comparison"):
            rows = [row for one in learned.networks for row in compare(one, problem, key)]
    with watch("safe set"):
        answer = Planner(model).solve(problem, key, settings)
    # before the replay: if that finds a contradiction, the evidence is on disk
    _replace_older(out, model, answer)
    if learned is not None:
        shutil.rmtree(out / UNFINISHED, ignore_errors=True)
    driven = study.driven and answer.found and answer.uncertainty is None
    ahead = None
    if driven and learned is not None and len(answer.samples):
        ahead = compile_near(problem, learned.train, answer.samples[0, model.n_p :])
    runs = None
    if len(answer.samples) and not (answer.uncertainty and answer.uncertainty.copies):
        with watch("replay"):
            plans = np.repeat(answer.samples, study.repeats, axis=0)
            runs = replay(system, answer.scene, plans, key, quiet)
    metrics = {
        "system": system.name,
        "seed": seed,
        "jax": jax.__version__,
        "python": platform.python_version(),
        "device": jax.devices()[0].device_kind,
        "regions": table.count,
        "final_error": final_error(model).tolist(),
        **facts_of(answer, cold.timings["first_sample_s"]),
        "share_of_k": answer.share_of_k(),
        "replay": None if runs is None else tally(runs, study.repeats, study.delta),
        "driven": None,
        "comparison": rows,
        "stages": watch.stages,
        "claim": model.claim.to_json(),
    }
    outcome = Studied(answer, runs, table, learned, finish(out, metrics))
    if early is not None:
        early(outcome)
    if driven:
        with watch("the plan that is driven"):
            metrics |= {"driven": drive(system, answer, study, key, out, quiet, ahead)}
        answer.save(out / "answer.json")  # again: the file tells which looks are taken
        finish(out, metrics)
    return outcome


def _replace_older(out: Path, model: TrajectoryModel, answer: Answer) -> None:
    """Put model and answer there, in place of an older study's, whose numbers belong to neither."""
    for name in (METRICS, "near.json"):
        (out / name).unlink(missing_ok=True)
    model.save(out / "model.npz")
    answer.save(out / "answer.json")


def finish(out: Path, metrics: dict) -> dict:
    """Write metrics.json and hand the metrics back."""
    write_atomic(out / METRICS, json.dumps(metrics, indent=1).encode())
    return metrics
