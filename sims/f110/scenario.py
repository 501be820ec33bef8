"""The parking task: come to rest between two parked cars, turned by about half a circle."""

import math

from parc_jax.common.sets.box import box
from parc_jax.problem.problem import Problem, reach_avoid
from sims import rectangle
from sims.f110 import params as c

SPACE = (
    6.5,
    -0.7,
)  # [m] middle of the space, in the middle of where the family comes to rest when started at (0, 0)
BODIES = (rectangle.BODY, "disc")
GOAL_SIZE = (0.56, 0.61, 2 * math.pi / 3)  # [m, m, rad] about the space, heading about pi


def problem(body: str = "disc") -> Problem:
    """Two parked cars of the car's own size, 1.2 m apart along x, the goal between them. Raises
    InputError.

    body: "disc", the circle around the car: its radius of 0.322 m leaves 0.556 m between the cars,
    and whoever is in the middle of the space in x has parked. "rectangle": the true outline, which
    turns with the car.
    """
    rectangle.require_body(body, BODIES)
    middle, half = (*SPACE, math.pi), [s / 2 for s in GOAL_SIZE]
    lo = [m - h for m, h in zip(middle, half, strict=True)]
    hi = [m + h for m, h in zip(middle, half, strict=True)]
    parked = [_car(SPACE[0] + side * (c.GAP + c.BODY_LENGTH) / 2) for side in (-1, 1)]
    if body == rectangle.BODY:
        return reach_avoid(rectangle.goal_of_centre(lo, hi), parked, rectangle.rectangle())
    return reach_avoid(box(lo, hi), parked, c.BODY_RADIUS)


def _car(x: float):
    return box(
        [x - c.BODY_LENGTH / 2, SPACE[1] - c.BODY_WIDTH / 2],
        [x + c.BODY_LENGTH / 2, SPACE[1] + c.BODY_WIDTH / 2],
    )
