"""What `import parc_jax` offers, for type checkers: at run time the names are loaded on first use."""

from parc_jax.answer import Answer as Answer
from parc_jax.error.bound import assumed_claim as assumed_claim
from parc_jax.error.bound import bound_error as bound_error
from parc_jax.error.claim import ErrorClaim as ErrorClaim
from parc_jax.error.tube import Tube as Tube
from parc_jax.error.tube import tube as tube
from parc_jax.errors import InputError as InputError
from parc_jax.errors import SoundnessError as SoundnessError
from parc_jax.model import TrajectoryModel as TrajectoryModel
from parc_jax.model import load as load
from parc_jax.model import trajectory_model as trajectory_model
from parc_jax.network.relu import ReLUNetwork as ReLUNetwork
from parc_jax.network.relu import relu_network as relu_network
from parc_jax.network.train import train as train
from parc_jax.planner import Planner as Planner
from parc_jax.problem import Disc as Disc
from parc_jax.problem import Polygon as Polygon
from parc_jax.problem import ReachAvoid as ReachAvoid
from parc_jax.problem import reach_avoid as reach_avoid
from parc_jax.pwa import RegionTable as RegionTable
from parc_jax.pwa import enumerate_regions as enumerate_regions
from parc_jax.pwa import march as march
from parc_jax.rollout.batch import RolloutBatch as RolloutBatch
from parc_jax.rollout.collect import collect as collect
from parc_jax.rollout.loaders import load_rollouts as load_rollouts
from parc_jax.sets.box import Box as Box
from parc_jax.sets.box import box as box
from parc_jax.sets.hpolytope import HPolytope as HPolytope
from parc_jax.sets.hpolytope import hpolytope as hpolytope
from parc_jax.system import BlackBoxSystem as BlackBoxSystem
from parc_jax.system import TimeGrid as TimeGrid
from parc_jax.system import Trajectory as Trajectory
from parc_jax.system import time_grid as time_grid

__all__: list[str]
__version__: str
