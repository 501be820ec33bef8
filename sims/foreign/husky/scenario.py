"""The task: after 4 s the robot stands between three walls, with all of its footprint, and has
touched none.
"""

from parc_jax.problem import ReachAvoid, goal_of_points, reach_avoid
from parc_jax.sets.box import box
from sims.rectangle import POINTS, rectangle

BAY_WIDTH, BAY_LENGTH = 1.6, 2.2  # [m]
WALL = 0.3  # [m] thickness


def problem(width: float = BAY_WIDTH, length: float = BAY_LENGTH) -> ReachAvoid:
    """A bay, open behind the robot: walls on its left and right and ahead, starts anywhere. The
    frame is the robot's own as it stands at the start, ahead along x.
    """
    x, y = 0.5 * length, 0.5 * width
    walls = (
        ((-x, y), (x, y + WALL)),
        ((-x, -y - WALL), (x, -y)),
        ((x, -y - WALL), (x + WALL, y + WALL)),
    )
    goal = goal_of_points(POINTS, box([-x, -y], [x, y]))
    return reach_avoid(goal, [box(*wall) for wall in walls], rectangle())
