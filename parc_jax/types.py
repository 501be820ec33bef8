"""What comes back and what may be asked with, by its class, for annotations and `isinstance`: each
is made by the function that its own docstring names.
"""

from parc_jax.answer.answer import Answer
from parc_jax.base.status import Ended, Status
from parc_jax.batch.box_scenes import BoxScenes
from parc_jax.claim.claim import ErrorClaim
from parc_jax.claim.intersample import AccelerationBound, SpeedBound
from parc_jax.claim.monitor import Monitor
from parc_jax.claim.risk import NoStatement, Risk
from parc_jax.claim.tube import Tube
from parc_jax.errors import BudgetError
from parc_jax.local.choice import Choice
from parc_jax.model import TrajectoryModel
from parc_jax.network.relu import ReLUNetwork
from parc_jax.planner.prepared import Prepared
from parc_jax.problem.body import Body, Disc, Part, Polygon
from parc_jax.problem.problem import ReachAvoid
from parc_jax.pwa import RegionTable
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.invariance import StartGap
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.system import BlackBoxSystem, TimeGrid

__all__ = [
    "AccelerationBound",
    "Answer",
    "BlackBoxSystem",
    "Body",
    "Box",
    "BoxScenes",
    "BudgetError",
    "Choice",
    "Disc",
    "Ended",
    "ErrorClaim",
    "HPolytope",
    "Monitor",
    "NoStatement",
    "Part",
    "Polygon",
    "Prepared",
    "ReLUNetwork",
    "ReachAvoid",
    "RegionTable",
    "Risk",
    "RolloutBatch",
    "SpeedBound",
    "StartGap",
    "Status",
    "TimeGrid",
    "TrajectoryModel",
    "Tube",
]
