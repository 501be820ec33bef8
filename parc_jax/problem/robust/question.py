"""A question under doubt as a plain question: whatever is safe in the plain one withstands the
doubt. [T21, T22]

The scene grows or shrinks, the tube grows, the network says the same for several executions at
once. Nothing else has to know of doubt: samples, corridors, polytopes, batches, volumes and
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
from parc_jax.problem.doubt import Doubt
from parc_jax.problem.problem import ReachAvoid, require_points
from parc_jax.problem.robust.copies import copied_model, copied_problem
from parc_jax.problem.robust.executions import Executions, executions_of, require_given
from parc_jax.problem.robust.pose import Pose, from_here, pose_of, require_rotation
from parc_jax.problem.robust.scene import doubted_scene
from parc_jax.problem.robust.turn import Turn, no_turn, turn_by
from parc_jax.problem.robust.withstood import Withstood, withstood

KEPT = 16  # models under doubt that a planner remembers


@dataclass(frozen=True, eq=False)
class Question:
    """All that is asked, as it was asked. Whoever asks it again asks all of it. Made by `question`.

    problem: told in the world, with its doubt and its start set. model: that it is asked of.
    pose: where the robot is; None for plans from any start.
    """

    problem: ReachAvoid
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
        doubt that were made before, which are remembered there. Raises InputError where the doubt
        does not fit the model, or leaves nothing of the goal.
        """
        known = {} if known is None else known
        problem, model, pose = self.problem, self.model, self.pose
        doubt = problem.doubt
        require_given(doubt, model)
        if doubt is None or doubt.is_nothing:
            doubt = None
            problem = problem.replace(doubt=None) if problem.doubt is not None else problem
        if doubt is None and pose is None:
            return Plain(problem, model, question=self)
        _check(problem, model)
        under, said = model, None
        if doubt is not None:
            copies = _copies(doubt, model)
            problem = doubted_scene(problem, doubt, model.layout, whole=pose is not None)
        here = None
        if pose is not None:
            problem = from_here(problem, model, pose)
            here = pose.place if pose.heading is None else np.zeros(model.n_p)
        if doubt is not None:
            problem = copied_problem(problem, model, *copies.counts)
            name = (*doubt.of_model, pose is None)
            if name not in known:
                while len(known) >= KEPT:
                    known.pop(next(iter(known)))
                # told from a pose, the scene itself allows for the doubt of the start
                start = doubt.shifts(model.n_p) if pose is None else np.zeros(model.n_p)
                known[name] = copies.model_of(model, start)
            under = known[name]
            said = withstood(doubt, copies.executions, model, max(copies.counts) > 1)
        return Plain(problem, under, said, here, pose, self)


@dataclass(frozen=True, eq=False)
class Plain:
    """A plain question; the doubt that its answers withstand, None where there was none; the one
    start of its plans, None for any, and the pose that it is. question: as it was asked; None where
    only the plain one is known, of a file. All that is derived of it hangs from its scene.
    """

    problem: ReachAvoid
    model: TrajectoryModel
    doubt: Withstood | None = None
    at: np.ndarray | None = None
    pose: Pose | None = None
    question: Question | None = None


def question(problem: ReachAvoid, model: TrajectoryModel, at=None) -> Question:
    """Ask a problem of a model. at: the pose of the robot, as of `pose_of`. Raises InputError."""
    return Question(problem, model, None if at is None else pose_of(at, model))


def plain(
    problem: ReachAvoid,
    model: TrajectoryModel,
    known: dict[tuple, TrajectoryModel] | None = None,
) -> Plain:
    """The plain question about plans from any start, as of `Question.plain`."""
    return Question(problem, model).plain(known)


class _Copies(NamedTuple):
    """The executions and turns that stand for all under a doubt."""

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


def _copies(doubt: Doubt, model: TrajectoryModel) -> _Copies:
    turn = no_turn(model.n_p, model.n_q)
    if doubt.heading:
        require_rotation(model, "doubt heading")
        turn = turn_by(doubt.heading, model.rotation or ())
    return _Copies(executions_of(doubt, model), turn)


def plain_problems(
    problems: Sequence[ReachAvoid], model: TrajectoryModel, known: dict[tuple, TrajectoryModel]
) -> tuple[list[ReachAvoid], TrajectoryModel]:
    """The plain problems of several, and the one model that they share. Raises InputError where
    their doubts ask for different models.
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
                "solve_batch: expected problems under one doubt of start, heading and parameters; "
                f"problem {row} is under another one than problem 0. Ask in two batches."
            )
    return [one.problem for one in found], (models[0] if models else model)


def moved(model: TrajectoryModel, start: np.ndarray) -> TrajectoryModel:
    """The model with a tube that allows for starts within half widths (n_p,) [m]."""
    if not start.any():
        return model
    wider = moved_tube(model.tube, start)
    return model.replace(claim=weaker(model.claim, wider, start_doubt=start.tolist()))


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


def _check(problem: ReachAvoid, model: TrajectoryModel) -> None:
    require_points(problem, model.points)
    if problem.goal.n != model.n_c + model.n_q:
        raise InputError(
            f"goal: expected a set over {model.n_c + model.n_q} coordinates, as the model has "
            f"them; got {problem.goal.n}."
        )
