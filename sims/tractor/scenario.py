"""The task: the tractor stands in a bay between two buildings, and the trailer has touched neither
on its shorter way round the corner.
"""

from parc_jax.common.sets.box import box
from parc_jax.problem.body import body_of, hull
from parc_jax.problem.problem import Problem, goal_of_points, reach_avoid
from sims.tractor.system import POINTS, TRACTOR, TRAILER

BAY = ((-2.1, -1.5), (2.1, 3.9))  # [m] where the tractor must stand, all of it
BUILDINGS = (
    ((-7.0, -1.0), (-2.2, 5.0)),
    ((2.2, -1.0), (7.0, 5.0)),
    ((-2.2, 4.0), (2.2, 5.0)),
)  # left and right of the bay, and its end


def problem() -> Problem:
    """Both parts of the body are rectangles between corners; the goal is over those of the
    tractor, and over its rear axle, from whose ends plans are drawn.
    """
    goal = goal_of_points(POINTS, dict.fromkeys((POINTS[0], *TRACTOR), box(*BAY)))
    body = body_of([hull(*TRACTOR), hull(*TRAILER)])
    return reach_avoid(goal, [box(*building) for building in BUILDINGS], body)
