"""The task: through a window in a wall, and hover behind it."""

from parc_jax.common.sets.box import box
from parc_jax.problem.body import hull
from parc_jax.problem.problem import Problem, goal_of_points, reach_avoid
from sims.drone.system import CORNERS, POINTS

WALL = (-1.6, -1.4)  # [m] along x
WINDOW = ((-0.6, -0.4), (0.6, 0.4))  # [m] over (y, z)
FAR = 3.0  # [m] how far the wall reaches
GOAL = ((-0.8, -0.8, -0.6), (0.8, 0.8, 0.6))  # [m] for the whole box


def problem() -> Problem:
    """The box is the hull of its corners; all of it must end behind the wall."""
    (left, low), (right, high) = WINDOW
    around = [
        ((-FAR, -FAR), (left, FAR)),
        ((right, -FAR), (FAR, FAR)),
        ((left, -FAR), (right, low)),
        ((left, high), (right, FAR)),
    ]
    wall = [box([WALL[0], *lo], [WALL[1], *hi]) for lo, hi in around]
    return reach_avoid(goal_of_points(POINTS, box(*GOAL)), wall, hull(*CORNERS))
