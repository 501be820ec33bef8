"""Files of other tools, in and out: scenes and networks, bags, queries for other verifiers, C for
the computer of a robot.
"""

from parc_jax.app.files.network_file import load_network, write_onnx
from parc_jax.app.files.question import safety_question, vnnlib, write_question
from parc_jax.drive.onboard.header import write_c
from parc_jax.learning.network.relu import Normalisation
from parc_jax.problem.problem_file import load_problem, problem_of_text, save_problem
from parc_jax.ros.bags.load import load_bags
from parc_jax.ros.bags.write import write_mcap

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
