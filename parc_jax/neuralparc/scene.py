"""A problem laid out for the published method: shrunken goals and grown obstacles, per bin and
interval.
"""

from dataclasses import dataclass

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.bounding_box import bounding_box
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.bound.tube import Tube
from parc_jax.neuralparc.lp_batch import GrownPolytopes, grown_polytopes
from parc_jax.neuralparc.sets.operations import shrink
from parc_jax.problem.body import Body
from parc_jax.problem.problem import Problem


@dataclass(frozen=True)
class PaperScene:
    """What the search needs of a problem.

    goals: shrunken goals over (p, q), b of shape (n_bins, g). goal_box: around the goal.
    grown: obstacles. start: P0 or None. n_k: number of parameters.
    """

    goals: HPolytope
    goal_box: Box
    grown: GrownPolytopes
    start: HPolytope | None
    n_k: int

    @property
    def n_p(self) -> int:
        """Workspace dimension."""
        return self.grown.corners.shape[-1]


def paper_scene(problem: Problem, tube: Tube) -> PaperScene:
    """Shrink the goal and grow the obstacles, for every bin and interval. Raises InputError."""
    boxes = isinstance(tube.errors, ErrorBox)
    if tube.n_points > 1 or tube.n_p != 2 or not boxes or isinstance(problem.body, Body):
        raise InputError(
            "published method: expected one point in the plane with a disc or a polygon that does "
            f"not turn, and a tube of boxes; got {tube.n_points} points in {tube.n_p} dimensions "
            f"with {problem.body!r}. Use the method Exact()."
        )
    n_goal = tube.n_p + tube.n_q
    if problem.goal.n != n_goal:
        raise InputError(
            f"goal: expected {n_goal} dimensions (p, q), as the tube has; got {problem.goal.n}."
        )
    goal_box = bounding_box(problem.goal)
    if not (np.isfinite(goal_box.lo).all() and np.isfinite(goal_box.hi).all()):
        raise InputError(
            "goal: expected a bounded set; its rows leave a direction open. Add the missing rows."
        )
    interval, final = tube.finite_widths
    goals = shrink(problem.goal, final)
    grown = grown_polytopes(problem, tube.replace(interval=interval, final=final))
    return PaperScene(goals, goal_box, grown, problem.start, len(tube.edges))
