"""The main job: one command from rollouts to a proved safe set, its replay in the black box, and the pictures."""

import json
import platform
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer import Answer
from parc_jax.certify.draw import draw, generator
from parc_jax.certify.replay import Replay, replay
from parc_jax.certify.scene import scene
from parc_jax.errors import InputError
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel
from parc_jax.planner import Planner
from parc_jax.problem import ReachAvoid
from parc_jax.pwa import RegionTable, enumerate_regions
from parc_jax.rollout.files import write_atomic
from parc_jax.study.learn import Learned, Lesson, final_error, learn
from parc_jax.study.settings import Study, checked
from parc_jax.study.stopwatch import Stopwatch

COMPARED = 32_768  # points drawn to estimate the safe share of every row of the comparison


class Outcome(NamedTuple):
    """Everything a study produced. lesson is None when the model came from a file."""

    answer: Answer
    replay: Replay
    table: RegionTable
    lesson: Lesson | None
    metrics: dict


def run_study(
    system, problem: ReachAvoid, study: Study, out: Path, seed: int, model: TrajectoryModel | None = None,
    quiet: bool = False,
) -> Outcome:  # fmt: skip
    """Learn (unless a model is given), solve, replay, draw, and write it all below `out`.

    Raises InputError for settings or scenes that make no sense, SoundnessError when a replay contradicts a proof.
    """
    checked(study)
    key, watch, out = jax.random.PRNGKey(seed), Stopwatch(), Path(out)
    lesson = None
    if model is None:
        lesson = learn(system, study, key, watch, out / "unfinished", quiet)
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
    with watch("first query (cold)"):
        cold = planner.solve(problem, jax.random.fold_in(key, 1), **options | {"budget_s": 0.0, "proof": False})
    with watch("safe set"):
        answer = planner.solve(problem, key, **options)
    if answer.found:
        with watch("replay"):
            replayed = replay(system, model, answer.scene, answer.samples, key)
    else:
        replayed = None
    answer.save(out / "answer.json")
    metrics = {
        "system": system.name, "seed": seed, "jax": jax.__version__, "python": platform.python_version(),
        "device": jax.devices()[0].device_kind, "regions": table.count, "final_error": final_error(model).tolist(),
        "counts": answer.counts, "safe_share": answer.safe_share, "polytopes": len(answer.pieces),
        "coverage": answer.coverage._asdict(), "level": answer.level, "refused": answer.refused,
        "volume": answer.volume(), "share_of_k": answer.share_of_k,
        "first_sample_cold_s": cold.timings["first_sample_s"], "timings": answer.timings,
        "replay": None if replayed is None else {
            "plans": len(answer.samples), "reached": int(replayed.reached.sum()),
            "touched": int(replayed.touched.sum()), "left_tube": int((~replayed.inside).sum()),
        },
        "comparison": rows, "stages": watch.stages, "claim": model.claim.to_json(),
    }  # fmt: skip
    return Outcome(answer, replayed, table, lesson, finish(out, metrics))


def finish(out: Path, metrics: dict) -> dict:
    """Write metrics.json and hand the metrics back."""
    write_atomic(out / "metrics.json", json.dumps(metrics, indent=1).encode())
    return metrics


def compare(learned: Learned, problem: ReachAvoid, key: jax.Array) -> list[dict]:
    """Two rows for one network: regions, error at the end, and safe share, under the assumed and the honest claim."""
    rows = []
    regions = enumerate_regions(learned.honest.net, learned.honest.domain).count
    for model in (learned.assumed, learned.honest):
        row = {
            "network": learned.name, "claim": model.claim.kind, "regions": regions,
            "final_error": final_error(model).tolist(),
        }  # fmt: skip
        try:
            seen = draw(model, scene(problem, model), generator(stream(key, Stage.SEARCH)), COMPARED)
            row |= {"reaching": seen.reaching / seen.drawn, "safe": len(seen.safe.k) / seen.drawn}
        except InputError as error:  # the goal is narrower than this model's error: nothing can be safe
            row |= {"reaching": 0.0, "safe": 0.0, "why": str(error)}
        rows.append(row)
    return rows


def safe_share(row: dict) -> float:
    """Share of the goal-reaching set that is safe."""
    return row["safe"] / row["reaching"] if row["reaching"] else float("nan")


def figures(outcome: Outcome, study: Study, out: Path) -> list[Path]:
    """Draw everything that this outcome supports; returns the files."""
    from parc_jax.plot.errors import Entry, errors
    from parc_jax.plot.regions import regions
    from parc_jax.plot.samples import samples
    from parc_jax.plot.verdicts import region_seconds, region_verdicts

    answer, drawn = outcome.answer, []
    if answer.found:
        drawn.append(out / "samples.png")
        samples(answer, outcome.replay, drawn[-1], heading=study.heading)
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
