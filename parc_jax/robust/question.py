"""A question under doubt as a plain question: whatever is safe in the plain one withstands the
doubt. [T21, T22]

The scene grows or shrinks, the tube grows, the network says the same for several executions at
once. Nothing else has to know of doubt: samples, corridors, polytopes, batches, volumes and
certificates are those of the plain question, and what the checker proves of it is the robust
statement.
"""

from collections.abc import Sequence
from typing import NamedTuple

from parc_jax.claim.claim import weaker
from parc_jax.doubt import Doubt
from parc_jax.errors import InputError
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid
from parc_jax.robust.copies import copied_model, copied_problem
from parc_jax.robust.executions import executions_of
from parc_jax.robust.scene import doubted_scene
from parc_jax.robust.turn import no_turn
from parc_jax.robust.widths import moved_tube
from parc_jax.robust.withstood import Withstood, withstood

KEPT = 16  # models under doubt that a planner remembers


class Plain(NamedTuple):
    """A plain question, and the doubt that its answers withstand; None where there was none."""

    problem: ReachAvoid
    model: TrajectoryModel
    doubt: Withstood | None = None


def plain(
    problem: ReachAvoid, model: TrajectoryModel, known: dict[tuple, TrajectoryModel] | None = None
) -> Plain:
    """The plain question of one under doubt. Raises InputError where the doubt does not fit the
    model, or leaves nothing of the goal.

    known: models under doubt that were made before, which are remembered there.
    """
    doubt = problem.doubt
    if doubt is None:
        return Plain(problem, model)
    if doubt.is_nothing:
        return Plain(problem.replace(doubt=None), model)
    _check(problem, doubt, model)
    executions = executions_of(doubt, model)
    turn = no_turn(model.n_p, model.n_q)
    asked = doubted_scene(problem, doubt, model.layout)
    asked = copied_problem(asked, model, len(executions.corners), len(turn.maps))
    known = {} if known is None else known
    under = known.get(doubt.of_model)
    if under is None:
        while len(known) >= KEPT:
            known.pop(next(iter(known)))
        simple = executions.plain and len(turn.maps) == 1
        copies = model if simple else copied_model(model, executions, turn)
        under = known[doubt.of_model] = moved(copies, doubt)
    return Plain(asked, under, withstood(doubt, model))


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


def moved(model: TrajectoryModel, doubt: Doubt) -> TrajectoryModel:
    """The model with a tube that allows for the doubt of the start."""
    start = doubt.shifts(model.n_p)
    if not start.any():
        return model
    wider = moved_tube(model.tube, start)
    return model.replace(claim=weaker(model.claim, wider, start_doubt=start.tolist()))


def _check(problem: ReachAvoid, doubt: Doubt, model: TrajectoryModel) -> None:
    if problem.goal.n != model.n_c + model.n_q:
        raise InputError(
            f"goal: expected a set over {model.n_c + model.n_q} coordinates, as the model has "
            f"them; got {problem.goal.n}."
        )
    doubt.shifts(model.n_p)
