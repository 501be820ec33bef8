"""What the room offers: the one list, for type checkers and for `__init__.py`."""

from parc_jax.learning.bound.counts import required_runs as required_runs
from parc_jax.learning.bound.declared import assumed_claim as assumed_claim
from parc_jax.learning.bound.declared import declared_claim as declared_claim
from parc_jax.learning.bound.pipeline import bound_error as bound_error
from parc_jax.learning.bound.pipeline import update as update
from parc_jax.learning.bound.start_gap import translation_gap as translation_gap
from parc_jax.learning.bound.tube import tube as tube
from parc_jax.learning.model import trajectory_model as trajectory_model
from parc_jax.learning.network.relu import relu_network as relu_network
from parc_jax.learning.network.train import train as train
from parc_jax.learning.runs.collect import collect as collect
from parc_jax.learning.system import time_grid as time_grid
from parc_jax.learning.systems.chained import chained as chained
