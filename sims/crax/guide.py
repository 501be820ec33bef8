"""A driver of CRAX's Point that knows the map, as that of Safety-Gymnasium's."""

import numpy as np

from sims.crax.judge import SQUARE
from sims.crax.sensing import OUTLINE
from sims.crax.world import THICK, WALL, World
from sims.point.guide import Guide

AWAY = 0.09  # [m] kept from what costs: creep, tube, and what a shield asks of clearance


class CraxGuide(Guide):
    """A policy for some worlds of a level."""

    knots, knot, held = 14, 0.08, 0.16
    half, bound = 2.85, WALL - THICK - OUTLINE - AWAY

    @classmethod
    def _seen(cls, world: World) -> tuple[np.ndarray, np.ndarray]:
        keep = world.sizes + np.where(world.solid, OUTLINE, 0.0) + AWAY
        discs = np.column_stack([world.hazards, keep])
        boxes = world.square & world.solid
        corners = world.hazards[boxes, None] + SQUARE * world.sizes[boxes, None, None]
        around = [[*corner, OUTLINE + AWAY] for corner in corners.reshape(-1, 2)]
        goals = np.pad(world.goals, ((0, 0), (0, 1)), constant_values=world.level.goal)
        return np.concatenate([discs, np.array(around).reshape(-1, 3)]), goals
