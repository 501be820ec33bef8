"""The task: between two parked cars, all of the car inside the bay, and not onto the kerb."""

from parc_jax.problem import ReachAvoid, goal_of_points, reach_avoid
from parc_jax.sets.box import box
from sims.rectangle import CORNERS, POINTS, rectangle

ROOM = 9.0  # [m] between the parked cars
CAR = (4.5, 1.8)  # [m] length and width of a parked car
BAY = 1.15  # [m] half the width of the bay; the kerb is at its right edge
HEADING = 0.15  # [rad] most that the car may stand askew
START = ((-30.0, 2.0), (-8.0, 5.0))  # [m] of the centre: in the lane, before the bay


def problem() -> ReachAvoid:
    """The bay's middle is the origin, the kerb below. The body is the true rectangle."""
    half, long, wide = ROOM / 2, CAR[0], CAR[1] / 2
    obstacles = [
        box([-half - long, -wide], [-half, wide]),
        box([half, -wide], [half + long, wide]),
        box([-half - long, -BAY - 0.3], [half + long, -BAY]),
    ]
    bay = box([-half, -BAY], [half, BAY])
    where = dict.fromkeys((POINTS[0], *CORNERS), bay)
    goal = goal_of_points(POINTS, where, box([-HEADING], [HEADING]))
    return reach_avoid(goal, obstacles, rectangle(), box(*START))
