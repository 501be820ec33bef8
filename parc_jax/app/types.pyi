"""What the room offers: the one list, for type checkers and for the module beside it."""

from parc_jax.answer.answer import Answer as Answer
from parc_jax.common.errors import BudgetError as BudgetError
from parc_jax.common.sets.box import Box as Box
from parc_jax.common.sets.hpolytope import HPolytope as HPolytope
from parc_jax.common.status import Ended as Ended
from parc_jax.common.status import Status as Status
from parc_jax.drive.local.choice import Choice as Choice
from parc_jax.learning.bound.claim import ErrorClaim as ErrorClaim
from parc_jax.learning.bound.counts import NoStatement as NoStatement
from parc_jax.learning.bound.monitor import Monitor as Monitor
from parc_jax.learning.bound.settings import AccelerationBound as AccelerationBound
from parc_jax.learning.bound.settings import SpeedBound as SpeedBound
from parc_jax.learning.bound.tube import Tube as Tube
from parc_jax.learning.model import TrajectoryModel as TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork as ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch as RolloutBatch
from parc_jax.learning.system import BlackBoxSystem as BlackBoxSystem
from parc_jax.learning.system import TimeGrid as TimeGrid
from parc_jax.method import Exact as Exact
from parc_jax.method import FirstProved as FirstProved
from parc_jax.planner import Prepared as Prepared
from parc_jax.problem.body import Body as Body
from parc_jax.problem.problem import Problem as Problem
from parc_jax.proof.regions import RegionTable as RegionTable
from parc_jax.safe_set.batch.box_scenes import BoxScenes as BoxScenes
