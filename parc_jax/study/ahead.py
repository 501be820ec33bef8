"""What a query compiles, compiled while runs are made."""

import contextlib
import threading

from parc_jax.claim.tube import Tube
from parc_jax.local.local_model import guessed_claim
from parc_jax.model import trajectory_model
from parc_jax.network.relu import ReLUNetwork
from parc_jax.planner.planner import Planner
from parc_jax.problem.problem import ReachAvoid
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.settings import Settings


class Ahead:
    """The programs of a query, compiled in a thread of its own as soon as the shapes of the model
    are known. Programs depend on shapes alone, so a stand-in does for the model; what is found
    with it is dropped.
    """

    def __init__(self, problem: ReachAvoid, settings: Settings):
        self._asked = problem, settings
        self._thread: threading.Thread | None = None

    def begin(self, net: ReLUNetwork, train: RolloutBatch, profile: Tube) -> None:
        """Compile for a network whose tube will have the shape of this profile."""
        self._thread = threading.Thread(target=self._compile, args=(net, train, profile))
        self._thread.start()

    def wait(self) -> None:
        """Until all is compiled; not at all where nothing was begun."""
        if self._thread is not None:
            self._thread.join()

    def _compile(self, net: ReLUNetwork, train: RolloutBatch, profile: Tube) -> None:
        # whatever fails here fails in the query too, and is told there
        with contextlib.suppress(Exception):
            model = trajectory_model(net, guessed_claim(net, train, profile))
            Planner(model).warm_up(*self._asked)
