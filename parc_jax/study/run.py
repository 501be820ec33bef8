"""The main job: one command from rollouts to a proved safe set, its replay in the black box, and the pictures."""

import json
import platform
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer import Answer
from parc_jax.certify.draw import draw, generator
from parc_jax.certify.replay import Replay
from parc_jax.certify.scene import scene
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel
from parc_jax.planner import Planner
from parc_jax.problem import ReachAvoid
from parc_jax.pwa import RegionTable, enumerate_regions
from parc_jax.rollout.files import write_atomic
from parc_jax.study.learn import Learned, Lesson, final_error, learn
from parc_jax.study.settings import Study, checked
from parc_jax.study.stopwatch import Stopwatch
from parc_jax.study.trial import first_of, tally, trial

COMPARED = 32_768  # points drawn to estimate the safe share of every row of the comparison


class Outcome(NamedTuple):
    """Everything a study produced. lesson is None when the model came from a file.

    runs: of every returned plan, study.repeats each, grouped by plan; None when there is no plan.
    """

    answer: Answer
    runs: Replay | None
    table: RegionTable
    lesson: Lesson | None
    metrics: dict


def run_study(
    system, problem: ReachAvoid, study: Study, out: Path, seed: int, model: TrajectoryModel | None = None,
    quiet: bool = False, learn_from=None,
) -> Outcome:  # fmt: skip
    """Learn (unless a model is given), solve, replay, and write it all below `out`.

    learn_from: the same system on another plant, for the many runs of training and claims; the replay is of `system`.

    Raises InputError for settings or scenes that make no sense, SoundnessError when a replay contradicts a proof.
    """
    checked(study)
    key, watch, out = jax.random.PRNGKey(seed), Stopwatch(), Path(out)
    lesson = None
    if model is None:
        lesson = learn(learn_from or system, study, key, watch, out / "unfinished", quiet)
        model = lesson.main
        model.save(out / "model.npz")
    rows = []
    with watch("regions"):
        table = enumerate_regions(model.net, model.domain)
    if lesson is not None:
        with watch("comparison"):
            rows = [row for learned in lesson.models for row in compare(learned, problem, key)]
    planner = Planner(model)
    options = {
        "n_samples": study.samples, "target": study.target, "confidence": study.confidence, "budget_s": study.budget_s
    }  # fmt: skip
    apart = jax.random.fold_in(stream(key, Stage.SEARCH), 1)
    with watch("first query (cold)"):
        cold = planner.solve(problem, apart, **options | {"budget_s": 0.0, "proof": False, "no_plan_budget_s": 0.0})
    with watch("safe set"):
        answer = planner.solve(problem, key, **options)
    answer.save(out / "answer.json")  # before the replay: if that finds a contradiction, the evidence is on disk
    runs = None
    if len(answer.samples):
        with watch("replay"):
            runs = trial(system, model, answer.scene, answer.samples, key, study.repeats, quiet)
    metrics = {
        "system": system.name, "seed": seed, "jax": jax.__version__, "python": platform.python_version(),
        "device": jax.devices()[0].device_kind, "regions": table.count, "final_error": final_error(model).tolist(),
        "counts": answer.counts, "safe_share": answer.safe_share, "polytopes": len(answer.pieces),
        "coverage": answer.coverage._asdict(), "level": answer.level, "refused": answer.refused,
        "volume": answer.volume(), "share_of_k": answer.share_of_k,
        "first_sample_cold_s": cold.timings["first_sample_s"], "timings": answer.timings,
        "replay": None if runs is None else tally(runs, study.repeats, study.delta),
        "comparison": rows, "stages": watch.stages, "claim": model.claim.to_json(),
    }  # fmt: skip
    return Outcome(answer, runs, table, lesson, finish(out, metrics))


def finish(out: Path, metrics: dict) -> dict:
    """Write metrics.json and hand the metrics back."""
    write_atomic(out / "metrics.json", json.dumps(metrics, indent=1).encode())
    return metrics


def compare(learned: Learned, problem: ReachAvoid, key: jax.Array) -> list[dict]:
    """A row per claim of one network, the assumed one first: regions, error at the end, safe share."""
    rows = []
    regions = enumerate_regions(learned.honest.net, learned.honest.domain).count
    for model in (learned.assumed, *learned.claimed):
        row = {
            "network": learned.name, "claim": model.claim.kind, "by_bin": model.claim.bin_eps is not None,
            "unclaimed_bins": int((~model.tube.claimed).sum()), "regions": regions,
            "final_error": final_error(model).tolist(),
        }  # fmt: skip
        laid_out = scene(problem, model)
        seen = draw(model, laid_out, generator(stream(key, Stage.SEARCH)), COMPARED)
        box = float(model.domain.volume * np.prod(laid_out.z_hi - laid_out.z_lo))
        share = seen.volume / box / seen.drawn
        rows.append(row | {"reaching": seen.reaching * share, "safe": len(seen.safe.k) * share})
    return rows


def safe_share(row: dict) -> float:
    """Share of the goal-reaching set that is safe."""
    return row["safe"] / row["reaching"] if row["reaching"] else float("nan")


def figures(outcome: Outcome, study: Study, out: Path) -> list[Path]:
    """Draw everything that this outcome supports; returns the files."""
    from parc_jax.plot.errors import Entry, errors
    from parc_jax.plot.regions import regions
    from parc_jax.plot.samples import samples
    from parc_jax.plot.spread import spread as spread_of_runs
    from parc_jax.plot.verdicts import region_seconds, region_verdicts

    answer, drawn = outcome.answer, []
    if answer.found:
        drawn.append(out / "samples.png")
        samples(answer, first_of(outcome.runs, study.repeats), drawn[-1], heading=study.heading)
        if study.repeats > 1:
            drawn.append(out / "spread.png")
            spread_of_runs(answer, outcome.runs, study.repeats, drawn[-1])
    if 2 <= answer.model.n_k <= 3:
        drawn.append(out / "regions.png")
        verdicts, when = region_verdicts(answer, outcome.table), region_seconds(answer, outcome.table)
        regions(outcome.table, verdicts, when, drawn[-1], names=study.parameters or None)
    if outcome.lesson is not None:
        drawn.append(out / "errors.png")
        entries = [Entry(m.name, m.assumed.claim, m.honest.claim) for m in outcome.lesson.models]
        errors(entries, answer.model.time, drawn[-1])
    return drawn


def seconds(value: float | None) -> str:
    """A time for people."""
    if value is None:
        return "-"
    return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"


def spread(values: np.ndarray, names: tuple[str, ...]) -> str:
    """Half widths with their units."""
    return ", ".join(f"±{v:.2f} {n}" for v, n in zip(values, names or ("",) * len(values), strict=False))
