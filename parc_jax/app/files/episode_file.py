"""An episode again from its file, for pictures and bags: nothing else is needed."""

import json
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from parc_jax.app.files.answer_file import model_of_file, problem_of_file
from parc_jax.checker import Rejected, check_episode, load, number
from parc_jax.checker.answer import allowance_of
from parc_jax.checker.episode import EPISODE, KIND, summary_of_episode
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import nearest_floats
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.pose import Pose


class Manoeuvre(NamedTuple):
    """What was committed to. begin: [s] of the loop's clock. problem: told from the pose where it
    has a heading, else in the world. p0 (n_p,), k (n_k,): the plan there.
    """

    begin: Fraction
    pose: Pose
    problem: Problem
    p0: np.ndarray
    k: np.ndarray


class Episode(NamedTuple):
    """An episode. model: of the plain questions. statement: what is proved and assumed. meta: of
    the file, which nobody checks.
    """

    model: TrajectoryModel
    manoeuvres: tuple[Manoeuvre, ...]
    statement: str
    meta: Any = None


def is_episode(path) -> bool:
    """Does the file say that it is an episode, of whatever version? False for what cannot be
    read.
    """
    try:
        with open(path, "rb") as file:
            return KIND.encode() in file.read(200)
    except OSError:
        return False


def load_episode(path) -> Episode:
    """The episode of a file of `save_episode`, checked anew in exact arithmetic before anything is
    believed. Raises InputError when the file is no episode or its proof fails.
    """
    try:
        data = load(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    except Rejected as why:
        raise InputError(f"{path}: expected a file of `save_episode`; {why}.") from None
    return episode_of(data, str(path))


def episode_of(data: dict, name: str) -> Episode:
    """The same of the parsed file. Raises InputError, which begins with `name`."""
    try:
        report = check_episode(data, allowance_of)
    except Rejected as why:
        raise InputError(
            f"{name}: expected an episode ({EPISODE}) whose proofs hold; the checker says: {why}."
        ) from None
    try:
        entries = data["manoeuvres"]
        model = model_of_file(data | {"problem": entries[0]["problem"]})
        manoeuvres = tuple(_manoeuvre(entry, model.n_p) for entry in entries)
    except (KeyError, TypeError, IndexError, AttributeError, json.JSONDecodeError) as error:
        raise InputError(
            f"{name}: expected a file of `save_episode`; {type(error).__name__}: {error}."
        ) from None
    return Episode(model, manoeuvres, "\n".join(summary_of_episode(report)), data.get("meta"))


def _manoeuvre(entry: dict, n_p: int) -> Manoeuvre:
    values = np.array(nearest_floats(entry["pose"]))
    pose = Pose(values[:n_p], float(values[n_p]) if len(values) > n_p else None)
    p0, k = (np.array(nearest_floats(entry["sample"][name])) for name in ("p0", "k"))
    problem = problem_of_file(entry["problem"])
    return Manoeuvre(number(entry["begin"]), pose, problem, p0, k)
