"""What the room offers: the one list, for type checkers and for the module beside it."""

from parc_jax.app.files.network_file import load_network as load_network
from parc_jax.bags.load import load_bags as load_bags
from parc_jax.drive.onboard.header import write_c as write_c
from parc_jax.learning.network.relu import Normalisation as Normalisation
from parc_jax.problem.problem_file import load_problem as load_problem
from parc_jax.problem.problem_file import save_problem as save_problem
