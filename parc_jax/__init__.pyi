"""What `import parc_jax` offers: the one list, for type checkers and for `__init__.py`, which
loads each name on first use.
"""

from parc_jax import neuralparc as neuralparc
from parc_jax import ros as ros
from parc_jax.app import exchange as exchange
from parc_jax.app import figures as figures
from parc_jax.app import types as types
from parc_jax.app.files.answer_file import load_answer as load_answer
from parc_jax.app.study.replay import replay as replay
from parc_jax.app.study.replay import replay_recorded as replay_recorded
from parc_jax.common.errors import InputError as InputError
from parc_jax.common.errors import SoundnessError as SoundnessError
from parc_jax.common.sets.box import box as box
from parc_jax.common.sets.hpolytope import hpolytope as hpolytope
from parc_jax.drive import loop as loop
from parc_jax.drive.local.localise import Local as Local
from parc_jax.learning.bound.claim import load_claim as load_claim
from parc_jax.learning.bound.counts import required_runs as required_runs
from parc_jax.learning.bound.declared import assumed_claim as assumed_claim
from parc_jax.learning.bound.declared import declared_claim as declared_claim
from parc_jax.learning.bound.monitor import monitor as monitor
from parc_jax.learning.bound.monitor import refit as refit
from parc_jax.learning.bound.monitor import update as update
from parc_jax.learning.bound.pipeline import bound_error as bound_error
from parc_jax.learning.bound.tube import tube as tube
from parc_jax.learning.learn import learn as learn
from parc_jax.learning.model import load as load
from parc_jax.learning.model import trajectory_model as trajectory_model
from parc_jax.learning.network.relu import relu_network as relu_network
from parc_jax.learning.network.train import train as train
from parc_jax.learning.runs.collect import collect as collect
from parc_jax.learning.runs.loaders import load_rollouts as load_rollouts
from parc_jax.learning.system import Trajectory as Trajectory
from parc_jax.learning.system import time_grid as time_grid
from parc_jax.learning.systems.chained import chained as chained
from parc_jax.learning.systems.environment import EnvironmentRun as EnvironmentRun
from parc_jax.learning.systems.fmu import fmu_system as fmu_system
from parc_jax.learning.systems.invariance import translation_gap as translation_gap
from parc_jax.learning.systems.python_system import python_system as python_system
from parc_jax.method import Exact as Exact
from parc_jax.planner.planner import Planner as Planner
from parc_jax.problem import world as world
from parc_jax.problem.body import body_of as body_of
from parc_jax.problem.body import hull as hull
from parc_jax.problem.doubt import Doubt as Doubt
from parc_jax.problem.problem import goal_of_points as goal_of_points
from parc_jax.problem.problem import reach_avoid as reach_avoid
from parc_jax.problem.world.moving import moving as moving
from parc_jax.proof.regions import enumerate_regions as enumerate_regions
from parc_jax.proof.regions import march as march
from parc_jax.safe_set.batch.box_scenes import box_scenes as box_scenes
from parc_jax.safe_set.settings import Settings as Settings

__version__: str
