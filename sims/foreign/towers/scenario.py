"""The task: between two rows of towers, through the only gap between them, and on."""

from parc_jax.common.sets.box import box
from parc_jax.problem.body import hull
from parc_jax.problem.problem import Problem, goal_of_points, reach_avoid
from sims.foreign.towers import params as c
from sims.foreign.towers.flight import POINTS

DEEP, LONG = 30.0, 250.0  # [m] of a row of towers
GAP = 50.0  # [m] between the rows
START = ((-620.0, 100.0), (-480.0, 240.0))  # [m] where the nose may start
GOAL = ((520.0, -200.0), (700.0, 200.0))  # [m] where the nose must end
CLIMB = (25.0, 150.0)  # [m]


def problem() -> Problem:
    """Towers that reach higher than the flight, seen from above: their outlines, and that of the
    aeroplane, the hull of its points grown by ROUND.
    """
    towers = [
        box([-DEEP / 2, GAP / 2], [DEEP / 2, GAP / 2 + LONG]),
        box([-DEEP / 2, -GAP / 2 - LONG], [DEEP / 2, -GAP / 2]),
    ]
    goal = goal_of_points(POINTS, {POINTS[0]: box(*GOAL)}, box([CLIMB[0]], [CLIMB[1]]))
    return reach_avoid(goal, towers, hull(*POINTS, radius=c.ROUND), box(*START))
