"""What `import parc_jax` offers, for type checkers: at run time the names are loaded on first
use.
"""

from parc_jax.answer import Answer as Answer
from parc_jax.batch.box_scenes import BoxScenes as BoxScenes
from parc_jax.batch.box_scenes import box_scenes as box_scenes
from parc_jax.body import Body as Body
from parc_jax.body import Disc as Disc
from parc_jax.body import Part as Part
from parc_jax.body import Polygon as Polygon
from parc_jax.body import body_of as body_of
from parc_jax.body import hull as hull
from parc_jax.claim.claim import ErrorClaim as ErrorClaim
from parc_jax.claim.counts import required_runs as required_runs
from parc_jax.claim.declared import assumed_claim as assumed_claim
from parc_jax.claim.declared import declared_claim as declared_claim
from parc_jax.claim.monitor import monitor as monitor
from parc_jax.claim.pipeline import bound_error as bound_error
from parc_jax.claim.risk import Density as Density
from parc_jax.claim.risk import NoStatement as NoStatement
from parc_jax.claim.risk import Point as Point
from parc_jax.claim.risk import Uniform as Uniform
from parc_jax.claim.tube import Tube as Tube
from parc_jax.claim.tube import tube as tube
from parc_jax.claim.update import refit as refit
from parc_jax.claim.update import update as update
from parc_jax.claim.validate import validate_choice as validate_choice
from parc_jax.doubt import Doubt as Doubt
from parc_jax.errors import InputError as InputError
from parc_jax.errors import SoundnessError as SoundnessError
from parc_jax.experiment.replay import replay as replay
from parc_jax.io.answer_file import load_answer as load_answer
from parc_jax.io.network_file import load_network as load_network
from parc_jax.io.onnx_write import write_onnx as write_onnx
from parc_jax.io.problem_file import load_problem as load_problem
from parc_jax.io.problem_file import problem_of_text as problem_of_text
from parc_jax.io.problem_file import save_problem as save_problem
from parc_jax.io.question import safety_question as safety_question
from parc_jax.io.question import vnnlib as vnnlib
from parc_jax.io.question import write_question as write_question
from parc_jax.labels import labels_of as labels_of
from parc_jax.methods import Exact as Exact
from parc_jax.methods import Published as Published
from parc_jax.model import TrajectoryModel as TrajectoryModel
from parc_jax.model import load as load
from parc_jax.model import trajectory_model as trajectory_model
from parc_jax.network.fold import Normalisation as Normalisation
from parc_jax.network.relu import ReLUNetwork as ReLUNetwork
from parc_jax.network.relu import relu_network as relu_network
from parc_jax.network.train import train as train
from parc_jax.obstacles.moving import moving as moving
from parc_jax.planner import Planner as Planner
from parc_jax.problem import ReachAvoid as ReachAvoid
from parc_jax.problem import goal_of_points as goal_of_points
from parc_jax.problem import reach_avoid as reach_avoid
from parc_jax.pwa import RegionTable as RegionTable
from parc_jax.pwa import enumerate_regions as enumerate_regions
from parc_jax.pwa import march as march
from parc_jax.rollout.batch import RolloutBatch as RolloutBatch
from parc_jax.rollout.collect import collect as collect
from parc_jax.rollout.environment import Episode as Episode
from parc_jax.rollout.invariance import translation_gap as translation_gap
from parc_jax.rollout.loaders import load_rollouts as load_rollouts
from parc_jax.rollout.python_system import python_system as python_system
from parc_jax.sets.box import Box as Box
from parc_jax.sets.box import box as box
from parc_jax.sets.hpolytope import HPolytope as HPolytope
from parc_jax.sets.hpolytope import hpolytope as hpolytope
from parc_jax.settings import Settings as Settings
from parc_jax.status import Status as Status
from parc_jax.system import BlackBoxSystem as BlackBoxSystem
from parc_jax.system import TimeGrid as TimeGrid
from parc_jax.system import Trajectory as Trajectory
from parc_jax.system import time_grid as time_grid

__all__: list[str]
__version__: str
