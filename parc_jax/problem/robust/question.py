"""A question under uncertainty as a plain question: whatever is safe in the plain one withstands
the uncertainty. [T21, T22]

The scene grows or shrinks, the tube grows, the network says the same for several executions at
once. Nothing else has to know of uncertainty: samples, corridors, polytopes, batches, volumes and
certificates are those of the plain question, and what the checker proves of it is the robust
statement.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import weaker
from parc_jax.learning.bound.tube import Tube, fitted_tube, tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem, require_points
from parc_jax.problem.robust.nominal import robust_scene
from parc_jax.problem.robust.pose import Pose, from_here, pose_of, require_rotation
from parc_jax.problem.robust.realisations import (
    Executions,
    Robustness,
    Turn,
    executions_of,
    no_turn,
    require_given,
    turn_by,
    withstood,
)
from parc_jax.problem.robust.vertex_model import copied_model, copied_problem
from parc_jax.problem.uncertainty import Uncertainty

KEPT = 16  # models under uncertainty that a planner remembers


@dataclass(frozen=True, eq=False)
class Question:
    """All that is asked, as it was asked. Whoever asks it again asks all of it. Made by `question`.

    problem: told in the world, with its uncertainty and its start set. model: that it is asked of.
    pose: where the robot is; None for plans from any start.
    """

    problem: Problem
    model: TrajectoryModel
    pose: Pose | None = None

    def of(self, model: TrajectoryModel) -> "Question":
        """The same question of another model. Raises InputError where the robot has a heading that
        the model knows nothing of.
        """
        if self.pose is not None and self.pose.heading is not None:
            require_rotation(model, "at")
        return replace(self, model=model)

    def plain(self, known: dict[tuple, TrajectoryModel] | None = None) -> "Plain":
        """The plain question, told in the robot's frame where it has a heading. known: models under
        uncertainty that were made before, which are remembered there. Raises InputError where the
        uncertainty does not fit the model, or leaves nothing of the goal.
        """
        known = {} if known is None else known
        problem, model, pose = self.problem, self.model, self.pose
        uncertainty = problem.uncertainty
        require_given(uncertainty, model)
        if uncertainty is None or uncertainty.is_nothing:
            uncertainty = None
            problem = (
                problem.replace(uncertainty=None) if problem.uncertainty is not None else problem
            )
        if uncertainty is None and pose is None:
            return Plain(problem, model, question=self)
        _check(problem, model)
        under, said = model, None
        if uncertainty is not None:
            copies = _copies(uncertainty, model)
            problem = robust_scene(problem, uncertainty, model.layout, whole=pose is not None)
        here = None
        if pose is not None:
            problem = from_here(problem, model, pose)
            here = pose.place if pose.heading is None else np.zeros(model.n_p)
        if uncertainty is not None:
            problem = copied_problem(problem, model, *copies.counts)
            name = (*uncertainty.of_model, pose is None)
            if name not in known:
                while len(known) >= KEPT:
                    known.pop(next(iter(known)))
                # told from a pose, the scene itself allows for the uncertainty of the start
                start = uncertainty.shifts(model.n_p) if pose is None else np.zeros(model.n_p)
                known[name] = copies.model_of(model, start)
            under = known[name]
            said = withstood(uncertainty, copies.executions, model, max(copies.counts) > 1)
        return Plain(problem, under, said, here, pose, self)


@dataclass(frozen=True, eq=False)
class Plain:
    """A plain question; the uncertainty that its answers withstand, None where there was none; the
    one start of its plans, None for any, and the pose that it is. question: as it was asked; None
    where only the plain one is known, of a file. All that is derived of it hangs from its scene.
    """

    problem: Problem
    model: TrajectoryModel
    uncertainty: Robustness | None = None
    at: np.ndarray | None = None
    pose: Pose | None = None
    question: Question | None = None


def question(problem: Problem, model: TrajectoryModel, at=None) -> Question:
    """Ask a problem of a model. at: the pose of the robot, as of `pose_of`. Raises InputError."""
    return Question(problem, model, None if at is None else pose_of(at, model))


def plain(
    problem: Problem,
    model: TrajectoryModel,
    known: dict[tuple, TrajectoryModel] | None = None,
) -> Plain:
    """The plain question about plans from any start, as of `Question.plain`."""
    return Question(problem, model).plain(known)


class _Copies(NamedTuple):
    """The executions and turns that stand for all under an uncertainty."""

    executions: Executions
    turn: Turn

    @property
    def counts(self) -> tuple[int, int]:
        return len(self.executions.corners), len(self.turn.maps)

    def model_of(self, model: TrajectoryModel, start: np.ndarray) -> TrajectoryModel:
        """The model of all copies, from every start within half widths (n_p,) [m]."""
        if not (self.executions.plain and len(self.turn.maps) == 1):
            model = copied_model(model, self.executions, self.turn)
        return moved(model, start)


def _copies(uncertainty: Uncertainty, model: TrajectoryModel) -> _Copies:
    turn = no_turn(model.n_p, model.n_q)
    if uncertainty.heading:
        require_rotation(model, "uncertainty heading")
        turn = turn_by(uncertainty.heading, model.rotation or ())
    return _Copies(executions_of(uncertainty, model), turn)


def plain_problems(
    problems: Sequence[Problem], model: TrajectoryModel, known: dict[tuple, TrajectoryModel]
) -> tuple[list[Problem], TrajectoryModel]:
    """The plain problems of several, and the one model that they share. Raises InputError where
    their uncertainties ask for different models.
    """
    found = []
    for row, problem in enumerate(problems):
        try:
            found.append(plain(problem, model, known))
        except InputError as error:
            raise InputError(f"problem {row} of the batch: {error}") from None
    models = [one.model for one in found]
    for row, other in enumerate(models):
        if other is not models[0]:
            raise InputError(
                "solve_batch: expected problems under one uncertainty of start, heading and "
                f"parameters; problem {row} is under another one than problem 0. Ask in two "
                "batches."
            )
    return [one.problem for one in found], (models[0] if models else model)


def moved(model: TrajectoryModel, start: np.ndarray) -> TrajectoryModel:
    """The model with a tube that allows for starts within half widths (n_p,) [m]."""
    if not start.any():
        return model
    wider = moved_tube(model.tube, start)
    return model.replace(claim=weaker(model.claim, wider, start_uncertainty=start.tolist()))


def moved_tube(given: Tube, start: np.ndarray) -> Tube:
    """The tube of all points that move by the same vector within half widths start (n_p,) [m],
    before the end: there the goal shrinks instead, which knows that they move alike.
    """
    if given.templates is None:
        wide = given.interval + np.tile(start, given.n_points)
        return tube(given.edges, np.nextafter(wide, np.inf), given.final, given.n_points)
    during, at_end = given.templates
    half = np.nextafter(during.half + during.half_around(start), np.inf)
    return fitted_tube(given.edges, during.with_half(half), at_end)


def _check(problem: Problem, model: TrajectoryModel) -> None:
    require_points(problem, model.points)
    if problem.goal.n != model.n_c + model.n_q:
        raise InputError(
            f"goal: expected a set over {model.n_c + model.n_q} coordinates, as the model has "
            f"them; got {problem.goal.n}."
        )
