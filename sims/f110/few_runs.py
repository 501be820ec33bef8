"""What a number of runs is worth: a laboratory that had so many and no more, its claims, and how
its plans fare.

sims/f110/lesson.py says what a laboratory does with its runs. The plan that a claim allows is then
driven again, 10 and 1,000 times, and so are 1,000 runs of other safe plans.
"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.replay import Replay, replay
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.settings import Settings
from sims.f110.lesson import Model
from sims.f110.rows import MANY, REPEATS, Row
from sims.f110.system import F110, body_of

WORK = 0.2  # to cover one safe set
PLANS = 100  # safe plans asked for; the first is the one that is repeated


class Tried(NamedTuple):
    """A row with what was behind it. repeats: of the one plan; None when there is no safe plan."""

    row: Row
    model: Model
    answer: Answer
    repeats: Replay | None


def attempt(
    car: F110, scene: Problem, n: int, learned: Model, key: jax.Array, quiet: bool = True
) -> Tried:
    """Look for safe plans under the model's claim, drive the first one 1,000 times, and others
    1,000 times in all.
    """
    model, claim = learned.model, learned.model.claim
    eps = None if claim.eps is None else float(claim.eps)
    width = tuple(np.median(model.tube.final, axis=0)[[0, 1, -1]].tolist())
    row = Row(
        n,
        learned.claim,
        learned.fitted,
        eps,
        claim.discard if eps else 0,
        width,
        body=body_of(car),
    )
    planner = Planner(model)
    settings = Settings(samples=PLANS, work=WORK)
    answer = planner.solve(scene, key, settings)
    if not answer.status.found:
        none = answer.absence
        return Tried(
            row._replace(why=none.details() if none else answer.status.text),
            learned,
            answer,
            None,
        )
    first = planner.solve(
        scene, key, Settings(samples=PLANS, samples_only=True)
    )  # a first look: no clock decides its plans
    plans = first.samples if first.status.found else answer.samples
    plan = plans[0]
    repeats = replay(car, answer.scene, np.tile(plan, (MANY, 1)), key, quiet)
    others = replay(
        car,
        answer.scene,
        np.resize(plans, (MANY, len(plan))),
        jax.random.fold_in(key, 1),
        quiet,
    )
    row = row._replace(
        safe=answer.share.share,
        share_of_k=answer.share_of_k(),
        promise=None if eps is None else min(1.0, float(getattr(answer.risk(), "bound", 1.0))),
        plan=tuple(plan.tolist()),
        failed_10=int(repeats.failed[:REPEATS].sum()),
        failed_1000=int(repeats.failed.sum()),
        touched_1000=int(repeats.touched.sum()),
        left_1000=int((~repeats.inside).sum()),
        failed_random=int(others.failed.sum()),
        left_random=int((~others.inside).sum()),
    )
    return Tried(row, learned, answer, repeats)
