"""The parking task: come to rest between two parked cars, turned by about half a circle."""

import math

from parc_jax.problem import ReachAvoid, reach_avoid
from parc_jax.sets.box import box
from sims.f110 import params as c

SPACE = (
    6.5,
    -0.7,
)  # [m] middle of the space, in the middle of where the family comes to rest when started at (0, 0)
GOAL_SIZE = (0.56, 0.61, 2 * math.pi / 3)  # [m, m, rad] about the space, heading about pi


def problem() -> ReachAvoid:
    """Two parked cars of the car's own size, 1.2 m apart along x, the goal between them; the body
    is a circle.

    The circle (radius 0.322 m) leaves 0.556 m between the cars: whoever is in the middle of the
    space in x has parked.
    """
    middle, half = (*SPACE, math.pi), [s / 2 for s in GOAL_SIZE]
    goal = box(
        [m - h for m, h in zip(middle, half, strict=True)],
        [m + h for m, h in zip(middle, half, strict=True)],
    )
    parked = [_car(SPACE[0] + side * (c.GAP + c.BODY_LENGTH) / 2) for side in (-1, 1)]
    return reach_avoid(goal, parked, c.BODY_RADIUS)


def _car(x: float):
    return box(
        [x - c.BODY_LENGTH / 2, SPACE[1] - c.BODY_WIDTH / 2],
        [x + c.BODY_LENGTH / 2, SPACE[1] + c.BODY_WIDTH / 2],
    )
