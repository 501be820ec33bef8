"""The last word: the independent checker, in exact arithmetic, on everything that is returned."""

import numpy as np

from parc_jax import checker
from parc_jax.certify.certificate import network_part, piece_part, problem_part, tube_part
from parc_jax.certify.piece import Piece
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid


def prove(problem: ReachAvoid, model: TrajectoryModel, samples: list[dict], pieces: list[Piece]):
    """Which sample certificates and which pieces the checker accepts: two bool arrays."""
    context = checker.Context(problem_part(problem, model), network_part(model.net), tube_part(model.tube))
    return (
        np.array([_accepts(context.check_sample, part) for part in samples], bool),
        np.array([_accepts(context.check_set, piece_part(piece)) for piece in pieces], bool),
    )


def _accepts(check, part: dict) -> bool:
    try:
        check(part)
    except checker.Rejected:
        return False
    return True
