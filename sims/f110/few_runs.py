"""What sixty runs are worth: `python -m sims.f110.few_runs` learns the car from few and from many runs and tests both.

Each row of the table is another laboratory that had `runs` runs and no more; sims/f110/lesson.py says what it did with
them. The plan that a claim allows is then driven again, 10 and 1,000 times, and so are 1,000 runs of other safe plans.
"""

import json
import time
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer import Answer
from parc_jax.certify.replay import Replay, replay
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.planner import Planner
from parc_jax.rollout.collect import collect
from parc_jax.rollout.files import write_atomic
from sims.f110.lesson import Model, models
from sims.f110.rows import MANY, REPEATS, Row, sentence, table
from sims.f110.scenario import problem
from sims.f110.system import F110, system

SIZES = (60, 250, 1000, 7000)
BUDGET = 3.0  # [s] most time to cover one safe set
PLANS = 100  # safe plans asked for; the first is the one that is repeated


class Tried(NamedTuple):
    """A row with what was behind it, for figures: answer and repeats are None without a plan."""

    row: Row
    model: Model
    answer: Answer | None
    repeats: Replay | None


def few_runs(
    out: Path = Path("runs/f110_few_runs"), seed: int = 0, sizes: tuple[int, ...] = SIZES, figures: bool = True,
    quiet: bool = False,
) -> list[Tried]:  # fmt: skip
    """Run the whole study and write rows.json, table.txt and figures below `out`. Raises InputError.

    Args:
        out: Folder for everything written.
        seed: Everything random follows from it.
        sizes: Numbers of runs of the laboratories, at least 30 each.
        figures: Draw the figures.
        quiet: No progress.
    """
    if not sizes or min(sizes) < 30:
        raise InputError(f"sizes: expected numbers of runs, at least 30 each; got {sizes}.")
    begin, car, key = time.perf_counter(), system(), jax.random.PRNGKey(seed)
    runs = collect(car, key, max(sizes), Stage.TRAIN, quiet=quiet)
    tried = []
    for n in sizes:
        for model in models(car, runs.select(slice(0, n)), key):
            tried.append(attempt(car, n, model, key))
            if not quiet:
                print(f"[{time.perf_counter() - begin:4.0f} s] {sentence(tried[-1].row)}", flush=True)
    rows = [t.row for t in tried]
    text = "\n".join([*table(rows), "", *map(sentence, rows), "", f"{time.perf_counter() - begin:.0f} s in all", ""])
    write_atomic(out / "rows.json", json.dumps([row._asdict() for row in rows], indent=1).encode())
    write_atomic(out / "table.txt", text.encode())
    if figures:
        from sims.f110.figures import draw_all

        draw_all(car, runs, tried, key, out)
    if not quiet:
        print(text)
    return tried


def attempt(car: F110, n: int, learned: Model, key: jax.Array) -> Tried:
    """Look for safe plans under the model's claim, drive the first one 1,000 times, and others 1,000 times in all."""
    model, claim = learned.model, learned.model.claim
    eps = None if claim.eps is None else float(claim.eps)
    width = tuple(np.median(model.tube.final, axis=0).tolist())
    row = Row(n, learned.claim, learned.fitted, eps, claim.discard if eps else 0, width)
    planner = Planner(model)
    try:
        answer = planner.solve(problem(), key, n_samples=PLANS, budget_s=BUDGET)
    except InputError as error:  # the goal is narrower than the tube: no plan can be safe
        return Tried(row._replace(why=str(error)), learned, None, None)
    if not answer.found:
        return Tried(row._replace(why=answer.statement().splitlines()[0]), learned, None, None)
    first = planner.solve(problem(), key, n_samples=PLANS, budget_s=0.0)  # a first look: no clock decides its plans
    plans = first.samples if first.found else answer.samples
    plan = plans[0]
    repeats = replay(car, model, answer.scene, np.tile(plan, (MANY, 1)), key)
    others = replay(car, model, answer.scene, np.resize(plans, (MANY, len(plan))), jax.random.fold_in(key, 1))
    row = row._replace(
        safe=answer.safe_share, share_of_k=answer.share_of_k,
        promise=None if eps is None else min(1.0, float(getattr(answer.risk(), "bound", 1.0))),
        plan=tuple(plan.tolist()), failed_10=int(repeats.failed[:REPEATS].sum()),
        failed_1000=int(repeats.failed.sum()), touched_1000=int(repeats.touched.sum()),
        left_1000=int((~repeats.inside).sum()), failed_random=int(others.failed.sum()),
        left_random=int((~others.inside).sum()),
    )  # fmt: skip
    return Tried(row, learned, answer, repeats)


if __name__ == "__main__":
    import tyro

    tyro.cli(few_runs)
