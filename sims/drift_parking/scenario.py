"""The parking task: stop in the gap between two parked cars, turned by half a circle."""

import math

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import Problem, reach_avoid
from sims import rectangle
from sims.drift_parking import params as c

GOAL = (
    (29.7, -16.8, -7 * math.pi / 6),
    (31.3, -15.2, -5 * math.pi / 6),
)  # over (x, y, final yaw); the yaw is not wrapped
PARKED_CARS = (((22.9665, -16.994), (27.2335, -15.006)), ((33.7665, -16.994), (38.0335, -15.006)))
APART = PARKED_CARS[1][0][0] - PARKED_CARS[0][1][0]  # [m] between the parked cars, as published
BODY_RADIUS = 0.5 * math.hypot(c.BODY_LENGTH, c.BODY_WIDTH)  # circle about the centre of mass [m]
BODIES = (rectangle.BODY, "disc")


def problem(body: str = "disc", apart: float = APART) -> Problem:
    """The scene with the true rectangle that turns with the car ("rectangle"), or the circle around
    it ("disc").

    apart: [m] between the parked cars; for less than published they are moved together about the
    middle of their gap. The goal is over the centre of mass and the yaw, whatever the body. Raises
    InputError for any other body, and for cars that touch.
    """
    rectangle.require_body(body, BODIES)
    if not (math.isfinite(apart) and apart > 0):
        raise InputError(f"apart: expected metres > 0 between the parked cars; got {apart}.")
    inward = (0.5 * (APART - apart), -0.5 * (APART - apart))
    cars = [box(*_moved(car, x)) for car, x in zip(PARKED_CARS, inward, strict=True)]
    if body == rectangle.BODY:
        return reach_avoid(rectangle.goal_of_centre(*GOAL), cars, rectangle.rectangle())
    return reach_avoid(goal=box(*GOAL), obstacles=cars, body=BODY_RADIUS)


def _moved(car, x: float):
    """Corners of a parked car that stands x [m] further along the first axis."""
    return tuple((corner[0] + x, corner[1]) for corner in car)
