"""What the query near the driven plan compiles, compiled while that plan is chosen and run."""

import contextlib
import threading

import jax
import numpy as np

from parc_jax.claim.pipeline import learn_profiles
from parc_jax.local.local_model import BINS, Local, guessed_claim
from parc_jax.local.local_runs import on_box
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.fit import fit
from parc_jax.planner.planner import Planner
from parc_jax.problem.problem import ReachAvoid
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.sets.box import Box

NEAREST = 60  # training runs around a plan: enough for an affine map, and for a narrow tube


def compile_near(problem: ReachAvoid, train: RolloutBatch, k: np.ndarray) -> threading.Thread:
    """Begin to compile what a query near k (n_k,) needs; join the thread before that. Programs
    depend on shapes alone, so a stand-in does for the model; what is found with it is dropped.
    """

    def work() -> None:
        # whatever fails here fails in the query too, and is told there
        with contextlib.suppress(Exception):
            Planner(guessed_near(train, k)).warm_up(problem)

    thread = threading.Thread(target=work)
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
