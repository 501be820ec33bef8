"""The last word: the independent checker, in exact arithmetic, on everything that is returned."""

import hashlib

import jax
import numpy as np

from parc_jax import checker
from parc_jax.common.errors import InputError
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.proof.certificate.write import (
    corridor_part,
    polytope_part,
    problem_part,
    question_parts,
)


def prove(
    problem: Problem, model: TrajectoryModel, samples: list[dict], corridors=(), polytopes=()
):
    """Which sample certificates, which corridors and which polytopes the checker accepts: three
    bool arrays.

    A corridor is certified as a sample is: directions that hold for all plans, and one plan that
    keeps to them. Raises InputError for a problem or a model beyond the limits of the checker.
    """
    if not (len(samples) or len(corridors) or len(polytopes)):
        return tuple(np.zeros(0, bool) for _ in range(3))
    context = _context(problem, model)
    asked = (
        (context.check_sample, samples),
        (context.check_sample, [corridor_part(c, problem) for c in corridors]),
        (context.check_set, [polytope_part(p) for p in polytopes]),
    )
    return tuple(
        np.array([_accepts(check, part) for part in parts], bool) for check, parts in asked
    )


def proves_box(problem: Problem, model: TrajectoryModel, part: dict) -> bool:
    """Whether the checker accepts a box of plans, each of them safe: a part as `check_doubt` takes
    it. [T21] Raises InputError as `prove` does.
    """
    context = _context(problem, model)
    return _accepts(lambda entry: checker.check_doubt(context, entry), part)


def _context(problem: Problem, model: TrajectoryModel) -> checker.Context:
    """The checker's exact form of the question. Networks and tubes of the last few models are read
    once.
    """
    question = problem_part(problem, model)
    asked = [question[part] for part in _SIZES]
    if model.tube.templates is not None:
        asked.append(question["goal"])  # the tube names multipliers for its rows
    name = hashlib.sha256(repr(asked).encode())
    for array in jax.tree.leaves(
        (model.net, model.tube)
    ):  # by every bit: an array changed in place is another model
        name.update(
            repr(np.shape(array)).encode() + np.ascontiguousarray(array, np.float64).tobytes()
        )
    known = _RECENT.pop(name.digest(), None)
    if known is None:
        try:
            known = checker.Context(*question_parts(problem, model))
        except checker.Rejected as error:
            raise InputError(
                f"proof: expected a question within the limits of the exact checker; {error}. "
                "Ask with proof=False, or for a smaller model."
            ) from None
        if len(_RECENT) >= _KEPT:
            _RECENT.pop(next(iter(_RECENT)), None)
    _RECENT[name.digest()] = known
    return known.about(question)


# all that a network and a tube have to do with a problem
_SIZES = ("n_p", "n_q", "n_k", "points", "steps", "domain")
_KEPT = 4  # models
_RECENT: dict[bytes, checker.Context] = {}  # the oldest first


def _accepts(check, part: dict) -> bool:
    try:
        check(part)
    except checker.Rejected:
        return False
    return True
