"""Where manoeuvres may end, for a robot at a pose: a goal in the words of a question."""

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.rounding import rounding_bound
from parc_jax.problem.robust.pose import ROUNDING


def any_goal(model: TrajectoryModel) -> HPolytope:
    """A goal of one row, for as long as the question is told in the world."""
    row = np.zeros((1, model.n_c + model.n_q))
    row[0, 0] = 1.0
    return hpolytope(row, [1e6])


def moved_goal(goal: HPolytope, model: TrajectoryModel, place: np.ndarray) -> HPolytope:
    """The goal of a robot at a place (n_p,): all its points move alike. It shrinks by rounding."""
    rows = goal.A[:, : model.n_c].reshape(-1, model.n_points, model.n_p)
    terms = np.abs(rows).sum(axis=(1, 2)) * np.abs(place).sum() + np.abs(goal.b)
    return HPolytope(goal.A, goal.b + (rows @ place).sum(axis=1) - ROUNDING * terms)


def everywhere(model: TrajectoryModel) -> HPolytope:
    """A box that holds every end of a robot at the origin, with every error of the tube."""
    tube = model.tube
    widest = tube.final[tube.claimed].max(initial=0.0)
    far = 2.0 * (float(rounding_bound(model.net, model.domain).magnitude.max()) + widest)
    n = model.n_c + model.n_q
    return from_box(box([-far] * n, [far] * n))
