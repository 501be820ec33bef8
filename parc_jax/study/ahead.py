"""What a query compiles, compiled while runs are made."""

import contextlib
import threading
from collections.abc import Callable

import jax
import numpy as np

from parc_jax.claim.pipeline import learn_profiles
from parc_jax.claim.tube import Tube
from parc_jax.local.local_model import Local, guessed_claim
from parc_jax.local.local_runs import on_box
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.fit import fit
from parc_jax.network.relu import ReLUNetwork
from parc_jax.planner.planner import Planner
from parc_jax.problem.problem import ReachAvoid
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.sets.box import Box
from parc_jax.settings import Settings

NEAREST = 60  # training runs around a plan: enough for an affine map, and for a narrow tube


class Ahead:
    """The programs of a query, compiled in a thread of its own as soon as the shapes of the model
    are known. Programs depend on shapes alone, so a stand-in does for the model; what is found
    with it is dropped.
    """

    def __init__(self, problem: ReachAvoid, settings: Settings):
        self._asked = problem, settings
        self._thread: threading.Thread | None = None

    def begin(self, stand_in: Callable[..., TrajectoryModel], *about) -> None:
        """Compile for the model stand_in(*about)."""
        self._thread = threading.Thread(target=self._compile, args=(stand_in, *about))
        self._thread.start()

    def wait(self) -> None:
        """Until all is compiled; not at all where nothing was begun."""
        if self._thread is not None:
            self._thread.join()

    def _compile(self, stand_in: Callable[..., TrajectoryModel], *about) -> None:
        # whatever fails here fails in the query too, and is told there
        with contextlib.suppress(Exception):
            Planner(stand_in(*about)).warm_up(*self._asked)


def guessed(net: ReLUNetwork, train: RolloutBatch, profile: Tube) -> TrajectoryModel:
    """A network under its profile, about which nothing is claimed."""
    return trajectory_model(net, guessed_claim(net, train, profile))


def guessed_near(train: RolloutBatch, k: np.ndarray) -> TrajectoryModel:
    """What a local model around k (n_k,) looks like, from the training runs nearest to it."""
    side = train.domain.hi - train.domain.lo
    away = np.abs((train.k - k) / side).max(axis=1)
    near = train.select(np.argsort(np.where(train.failed, np.inf, away))[:NEAREST])
    near = on_box(near, train.law, Box(near.k.min(axis=0), near.k.max(axis=0)))
    net = fit(near, Local(), jax.random.PRNGKey(0))
    one_bin = (1,) * train.n_k  # on so small a box the error hardly ever changes
    return guessed(net, near, learn_profiles([net], near, (), one_bin)[0])
