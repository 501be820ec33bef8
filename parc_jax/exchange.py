"""Files of other tools, in and out: scenes and networks, bags, questions for other verifiers, C for
a robot's own computer.
"""

from parc_jax.bags.load import load_bags
from parc_jax.bags.write import write_mcap
from parc_jax.io.network_file import load_network
from parc_jax.io.onnx_write import write_onnx
from parc_jax.io.problem_file import load_problem, problem_of_text, save_problem
from parc_jax.io.question import safety_question, vnnlib, write_question
from parc_jax.network.fold import Normalisation
from parc_jax.onboard.header import write_c

__all__ = [
    "Normalisation",
    "load_bags",
    "load_network",
    "load_problem",
    "problem_of_text",
    "safety_question",
    "save_problem",
    "vnnlib",
    "write_c",
    "write_mcap",
    "write_onnx",
    "write_question",
]
