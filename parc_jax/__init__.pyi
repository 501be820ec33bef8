"""What `import parc_jax` offers: the one list, for type checkers and for `__init__.py`, which
loads each name on first use.
"""

from parc_jax import drive as drive
from parc_jax import learning as learning
from parc_jax import problem as problem
from parc_jax import proof as proof
from parc_jax.app import exchange as exchange
from parc_jax.app import figures as figures
from parc_jax.app import types as types
from parc_jax.app.files.answer_file import load_answer as load_answer
from parc_jax.app.study.replay import replay as replay
from parc_jax.common.errors import InputError as InputError
from parc_jax.common.errors import SoundnessError as SoundnessError
from parc_jax.common.sets.box import box as box
from parc_jax.common.sets.hpolytope import hpolytope as hpolytope
from parc_jax.learning.bound.monitor import monitor as monitor
from parc_jax.learning.learn import learn as learn
from parc_jax.learning.model import load as load
from parc_jax.learning.runs.loaders import load_rollouts as load_rollouts
from parc_jax.learning.system import Trajectory as Trajectory
from parc_jax.learning.systems.python_system import python_system as python_system
from parc_jax.planner import Planner as Planner
from parc_jax.problem.body import body_of as body_of
from parc_jax.problem.problem import reach_avoid as reach_avoid
from parc_jax.problem.uncertainty import Uncertainty as Uncertainty
from parc_jax.safe_set.settings import Settings as Settings

__version__: str
