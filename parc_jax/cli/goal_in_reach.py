"""Scenes that cannot have a plan for a reason one can say in a sentence: a goal under an obstacle,
or out of reach.
"""

import numpy as np

from parc_jax.errors import InputError
from parc_jax.network.predict import outputs
from parc_jax.planner import Planner
from parc_jax.problem import ReachAvoid
from parc_jax.pwa.table import RegionTable
from parc_jax.sets.vertices import vertices
from parc_jax.verdict.scene import finite_box

MOST_PARAMETERS = 6  # of the exact enumeration of regions


def require_goal_in_reach(problem: ReachAvoid, planner: Planner) -> None:
    """Raise InputError when the goal lies inside one obstacle, or no plan of the model ends in it
    at all.

    Only for messages: a scene that passes may still have no safe plan, and what is said of it then
        is proved.
    """
    model, goal = planner.model, problem.goal
    if goal.n != model.n_p + model.n_q:
        return  # the planner says it better
    lo, hi = finite_box(goal, "goal")
    corners = vertices(goal)[:, : model.n_p]
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
    end_lo, end_hi = _ends(planner.regions, problem, planner)
    missed = (lo > end_hi) | (hi < end_lo)
    if missed.any():
        axis = int(np.argmax(missed))
        kind = model.labels.goal[axis]
        raise InputError(
            f"goal: expected some of it within reach; it asks for {kind} in [{lo[axis]:.5g}, "
            f"{hi[axis]:.5g}] and the "
            f"plans of this model end in [{end_lo[axis]:.5g}, {end_hi[axis]:.5g}]. Move the "
            "goal"
            f"{' or the start set' if axis < model.n_p else ''}, or learn over a wider K."
        )


def _ends(
    table: RegionTable, problem: ReachAvoid, planner: Planner
) -> tuple[np.ndarray, np.ndarray]:
    """Box of predicted final (p, q): a piecewise affine map takes its extremes at vertices of its
    regions.
    """
    model = planner.model
    T, n_p = model.time.n_steps, model.n_p
    final = outputs(model.net, np.asarray(table.points), slice((T - 1) * n_p, None))
    lo, hi = final.min(axis=0), final.max(axis=0)
    if problem.start is None or problem.start.n != n_p:
        lo[:n_p], hi[:n_p] = -np.inf, np.inf
        return lo, hi
    start_lo, start_hi = finite_box(problem.start, "start")
    lo[:n_p], hi[:n_p] = lo[:n_p] + start_lo, hi[:n_p] + start_hi
    return lo, hi
