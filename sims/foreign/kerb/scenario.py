"""The task: between two parked cars, all of the car inside the bay, and not onto the kerb."""

from parc_jax.common.sets.box import box
from parc_jax.problem.problem import Problem, goal_of_points, reach_avoid
from sims.rectangle import CORNERS, POINTS, rectangle

ROOM = 9.5  # [m] between the parked cars
CAR = (4.5, 1.8)  # [m] length and width of a parked car
KERB = 1.15  # [m] from the middle of the parked cars to the kerb
OUT = 1.5  # [m] from there to how far out into the lane the car may stand
HEADING = 0.15  # [rad] most that the car may stand askew
START = ((-30.0, 2.0), (-8.0, 5.0))  # [m] of the centre: in the lane, before the bay


def problem() -> Problem:
    """The origin is between the parked cars, on the line through their middles, the kerb below. The
    body is the true rectangle.
    """
    half, long, wide = ROOM / 2, CAR[0], CAR[1] / 2
    obstacles = [
        box([-half - long, -wide], [-half, wide]),
        box([half, -wide], [half + long, wide]),
        box([-half - long, -KERB - 0.3], [half + long, -KERB]),
    ]
    bay = box([-half, -KERB], [half, OUT])
    where = dict.fromkeys((POINTS[0], *CORNERS), bay)
    goal = goal_of_points(POINTS, where, box([-HEADING], [HEADING]))
    return reach_avoid(goal, obstacles, rectangle(), box(*START))
