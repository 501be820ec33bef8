"""The task: after 4 s the robot stands between three walls, with all of its footprint, and has
touched none.
"""

from parc_jax.common.sets.box import box
from parc_jax.problem.problem import Problem, goal_of_points, reach_avoid
from sims.foreign.husky import params as c
from sims.rectangle import POINTS, rectangle

BAY_WIDTH, BAY_LENGTH = 1.6, 2.2  # [m]
WALL = 0.3  # [m] thickness
FAR = 3.0  # [m] no run is longer than 1.6 m


def problem(width: float = BAY_WIDTH, length: float = BAY_LENGTH, outside: bool = False) -> Problem:
    """A bay, open behind the robot: walls on its left and right and ahead. Starts are anywhere, or
    wholly outside, before the open side. The frame is the robot's own as it stands at the start,
    ahead along x.
    """
    x, y = 0.5 * length, 0.5 * width
    walls = (
        ((-x, y), (x, y + WALL)),
        ((-x, -y - WALL), (x, -y)),
        ((x, -y - WALL), (x + WALL, y + WALL)),
    )
    goal = goal_of_points(POINTS, box([-x, -y], [x, y]))
    before = -x - 0.5 * c.LENGTH
    start = box([before - FAR, -FAR], [before, FAR]) if outside else None
    return reach_avoid(goal, [box(*wall) for wall in walls], rectangle(), start)
