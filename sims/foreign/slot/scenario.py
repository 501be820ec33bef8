"""The task: through a slot in a wall, inclined by 60 degrees and lower than the drone is wide, and
hover behind it. In the frame of the slot: through the wall, along the slot, across it.
"""

import numpy as np

from parc_jax.common.sets.box import Box, box
from parc_jax.problem.body import hull
from parc_jax.problem.problem import Problem, goal_of_points, reach_avoid
from sims.foreign.slot.system import CORNERS, POINTS

WIDTH = 0.1  # [m] of the slot; a level drone needs 0.141
LENGTH = 0.7  # [m] of it
THICK = 0.02  # [m] of the wall
FAR = 1.5  # [m] how far the wall reaches
AT = (-0.65, -0.15, 0.004)  # [m] middle of the slot, seen from the middle of the goal
GOAL = (0.15, 0.1, 0.04)  # [m] half of the box in which the centre ends
ROOM = (0.3, 0.2, 0.15)  # [m] half of the one in which all corners do
SPEED = 0.25  # [m/s] most along each axis at the end


def problem(width: float = WIDTH) -> Problem:
    """A wall of four slabs around a slot of this width [m]. All corners of the drone must end
    behind it, at hardly any speed.
    """
    half = width / 2
    long = LENGTH / 2
    wall = [
        slab((-FAR, FAR), (half, FAR)),
        slab((-FAR, FAR), (-FAR, -half)),
        slab((long, FAR), (-half, half)),
        slab((-FAR, -long), (-half, half)),
    ]
    rooms = dict.fromkeys(CORNERS, around(ROOM)) | {POINTS[0]: around(GOAL)}
    still = np.full(3, SPEED)
    goal = goal_of_points(POINTS, rooms, q=box(-still, still))
    return reach_avoid(goal, wall, hull(*CORNERS))


def around(half: tuple[float, ...]) -> Box:
    """The box of these half sides about the origin."""
    return box(-np.array(half), half)


def slab(along: tuple[float, float], across: tuple[float, float]) -> Box:
    """A part of the wall, between bounds [m] along the slot and across it, from its middle."""
    low, high = np.array([(-THICK / 2, THICK / 2), along, across]).T
    return box(AT + low, AT + high)
