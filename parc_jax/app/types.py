"""Classes of arguments and results, for annotations and `isinstance`: the docstring of each names
the function that makes it.
"""

from parc_jax.answer.answer import Answer
from parc_jax.common.errors import BudgetError
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.status import Ended, Status
from parc_jax.drive.local.choice import Choice
from parc_jax.learning.bound.asked import AccelerationBound, SpeedBound
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.counts import NoStatement
from parc_jax.learning.bound.monitor import Monitor
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.system import BlackBoxSystem, TimeGrid
from parc_jax.method import Exact
from parc_jax.planner import Prepared
from parc_jax.problem.body import Body
from parc_jax.problem.problem import Problem
from parc_jax.proof.regions import RegionTable
from parc_jax.safe_set.batch.box_scenes import BoxScenes

__all__ = [
    "AccelerationBound",
    "Answer",
    "BlackBoxSystem",
    "Body",
    "Box",
    "BoxScenes",
    "BudgetError",
    "Choice",
    "Ended",
    "ErrorClaim",
    "Exact",
    "HPolytope",
    "Monitor",
    "NoStatement",
    "Prepared",
    "Problem",
    "ReLUNetwork",
    "RegionTable",
    "RolloutBatch",
    "SpeedBound",
    "Status",
    "TimeGrid",
    "TrajectoryModel",
    "Tube",
]
