"""The plan that a study would drive: what its query compiles, compiled while it is chosen and run;
then run afresh, claimed near. Sentence (D). [T23]
"""

import contextlib
from pathlib import Path
from threading import Thread

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.settings import Study
from parc_jax.common.sets.box import Box
from parc_jax.drive.local.local_model import BINS, Local, guessed_claim, on_box
from parc_jax.learning.bound.pipeline import learn_profiles
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import fit
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem

NEAREST = 60  # training runs around a plan: enough for an affine map, and for a narrow tube
LOOKS = 2  # this very plan, and a claim near it


def drive(
    system,
    answer: Answer,
    study: Study,
    key: jax.Array,
    out: Path,
    quiet: bool,
    ahead: Thread | None = None,
) -> dict:
    """What is known of the plan with most room: plan and sentences. The answer under the local
    claim is written as near.json, for the checker. ahead: what compiles for its query.
    """
    chosen = answer.choose(delta=study.delta, looks=LOOKS)
    chosen = chosen.run(system, key, eps=study.eps, quiet=quiet)
    if ahead is not None:
        ahead.join()
    chosen = chosen.claim_near(system, key, Local(eps=study.eps, gap=study.gap), quiet=quiet)
    near = chosen.near
    if near.answer is not None:
        near.answer.save(out / "near.json")
    return {
        "plan": chosen.plan.tolist(),
        "runs": chosen.tested.n,
        "failures": chosen.tested.failures,
        "share_of_k": float(near.share),
        "proved_share_of_near": float(near.held),
        "narrower_at_end": near.widths.times_end,
        "narrower_on_the_way": near.widths.times_path,
        "statement": chosen.statement(),
    }


def compile_near(problem: Problem, train: RolloutBatch, k: np.ndarray) -> Thread:
    """Begin to compile what a query near k (n_k,) needs; join the thread before that. Programs
    depend on shapes alone, so a stand-in does for the model; what is found with it is dropped.
    """

    def work() -> None:
        # whatever fails here fails in the query too, and is told there
        with contextlib.suppress(Exception):
            Planner(guessed_near(train, k)).warm_up(problem)

    thread = Thread(target=work)
    thread.start()
    return thread


def guessed_near(train: RolloutBatch, k: np.ndarray) -> TrajectoryModel:
    """What a local model around k (n_k,) looks like, from the training runs nearest to it."""
    side = train.domain.hi - train.domain.lo
    away = np.abs((train.k - k) / side).max(axis=1)
    near = train.select(np.argsort(np.where(train.failed, np.inf, away))[:NEAREST])
    near = on_box(near, train.law, Box(near.k.min(axis=0), near.k.max(axis=0)))
    net = fit(near, Local(), jax.random.PRNGKey(0))
    profile = learn_profiles([net], near, (), (BINS,) * train.n_k)[0]
    return trajectory_model(net, guessed_claim(net, near, profile))
