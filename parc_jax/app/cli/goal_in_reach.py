"""Scenes that cannot have a plan for a reason one can say in a sentence: a goal under an obstacle,
or out of reach.
"""

import itertools

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.vertices import vertices
from parc_jax.learning.labels import degrees_hint
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import outputs
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem, box_of_rows, finite_box, goal_box

ODD = 1000  # a body smaller than all else by this factor gets a word
MOST_CORNERS = 729  # of K, where ways of a model are looked at
MOST_PARAMETERS = 6  # of the exact enumeration of regions


def require_goal_in_reach(problem: Problem, planner: Planner) -> None:
    """Raise InputError when the goal lies inside one obstacle, or no plan of the model ends in it
    at all.

    Only for messages: a scene that passes may still have no safe plan, and what is said of it then
        is proved.
    """
    model, goal = planner.model, problem.goal
    if goal.n != model.n_c + model.n_q:
        return  # the planner says it better
    lo, hi = goal_box(goal, model.layout)
    corners = _corners_of_first(goal, model)
    for j, (obstacle, span) in enumerate(zip(problem.obstacles, problem.spans, strict=True)):
        at_the_end = span is None or span[1] >= model.time.n_steps - 1
        if (
            at_the_end
            and obstacle.n == model.n_p
            and len(corners)
            and obstacle.contains(corners).all()
        ):
            raise InputError(
                f"goal: expected some room outside the obstacles; all of it lies in obstacle {j}. "
                "Move one of them."
            )
    if model.n_k > MOST_PARAMETERS:
        return
    end_lo, end_hi = _ends(problem, planner)
    missed = (lo > end_hi) | (hi < end_lo)
    if missed.any():
        axis = int(np.argmax(missed))
        kind = _name(model, axis)
        raise InputError(
            f"goal: expected some of it within reach; it asks for {kind} in [{lo[axis]:.5g}, "
            f"{hi[axis]:.5g}] and the "
            f"plans of this model end in [{end_lo[axis]:.5g}, {end_hi[axis]:.5g}]. Move the "
            "goal"
            f"{' or the start set' if axis < model.n_c else ''}, or learn over a wider K."
            f"{degrees_hint(kind, lo[axis], hi[axis])}"
        )


def odd_size(problem: Problem, model: TrajectoryModel) -> str | None:
    """A word where the body is larger than all else, or next to nothing beside it: as if its size
    were told in another unit than metres. None where it is not.
    """
    sides = [row.tolist() for row in (model.domain.lo, model.domain.center, model.domain.hi)]
    k = np.array(list(itertools.product(*np.transpose(sides)))[:MOST_CORNERS])
    way = float(np.abs(outputs(model.net, k, slice(0, model.layout.n_offsets))).max())
    boxes = [box_of_rows(obstacle) for obstacle in problem.obstacles]
    lo, hi = goal_box(problem.goal, model.layout)
    boxes.append((lo[: model.n_p], hi[: model.n_p]))
    wide = [float(side) for lo, hi in boxes for side in hi - lo if np.isfinite(side)]
    body = max(float(part.shape.radius) for part in problem.parts)
    most = max([way, *wide])
    if body > most or 0 < body < most / ODD:
        word = "more than all that" if body > most else f"less than a {ODD:,}th of what"
        return (
            f"body: its size of {body:g} m is {word} the ways of this model, the goal and the "
            f"obstacles measure, up to {most:.3g} m; is it in metres?"
        )
    return None


def _ends(problem: Problem, planner: Planner) -> tuple[np.ndarray, np.ndarray]:
    """Box of predicted final (p, q): a piecewise affine map takes its extremes at vertices of its
    regions.
    """
    model = planner.model
    n_c = model.n_c
    k = np.asarray(planner.regions.points)
    final = outputs(model.net, k, slice(model.layout.n_offsets - n_c, None))
    lo, hi = final.min(axis=0), final.max(axis=0)
    if problem.start is None or problem.start.n != model.n_p:
        lo[:n_c], hi[:n_c] = -np.inf, np.inf
        return lo, hi
    start_lo, start_hi = finite_box(problem.start, "start")
    lo[:n_c] += np.tile(start_lo, model.n_points)
    hi[:n_c] += np.tile(start_hi, model.n_points)
    return lo, hi


def _corners_of_first(goal: HPolytope, model: TrajectoryModel) -> np.ndarray:
    """(v, n_p) corners of where the goal lets the first reference point end; none where it asks for
    several points together.
    """
    if model.n_points == 1:
        return vertices(goal)[:, : model.n_p]
    first = (goal.A[:, : model.n_p] != 0).any(axis=1)
    if (goal.A[first, model.n_p :] != 0).any():
        return np.zeros((0, model.n_p))
    return vertices(HPolytope(goal.A[first, : model.n_p], goal.b[first]))


def _name(model: TrajectoryModel, axis: int) -> str:
    """What a coordinate of the goal is called."""
    if axis >= model.n_c:
        return model.labels.q[axis - model.n_c]
    label = model.labels.p[axis % model.n_p]
    return label if model.n_points == 1 else f"{label} of {model.points[axis // model.n_p]}"
