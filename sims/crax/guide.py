"""A driver of CRAX's Point that knows the map, as that of Safety-Gymnasium's."""

from functools import lru_cache

import numpy as np

from sims.crax.judge import SQUARE
from sims.crax.sensing import OUTLINE
from sims.crax.world import THICK, WALL, World
from sims.point.guide import CELL, Guide

AWAY = 0.09  # [m] kept from what costs: creep, tube, and what a shield asks of clearance


class CraxGuide(Guide):
    """A policy for some worlds of a level."""

    knots, knot, held, rest = 14, 0.08, 0.16, 0.0
    apart = 0.0  # another goal is there already
    half, bound = 2.85, WALL - THICK - OUTLINE - AWAY
    more = -CELL / 8

    @classmethod
    def _seen(cls, world: World) -> tuple[np.ndarray, np.ndarray]:
        radius = np.full((len(world.goals), 1), world.level.goal)
        return _discs(world), np.concatenate([world.goals, radius], axis=1)


@lru_cache(maxsize=128)  # as many worlds as are driven in step
def _discs(world: World) -> np.ndarray:
    """(m, 3) as of `Guide._seen`, which do not move."""
    keep = world.sizes + np.where(world.solid, OUTLINE, 0.0) + AWAY
    discs = np.column_stack([world.hazards, keep])
    boxes = world.square & world.solid
    corners = world.hazards[boxes, None] + SQUARE * world.sizes[boxes, None, None]
    around = [[*corner, OUTLINE + AWAY] for corner in corners.reshape(-1, 2)]
    return np.concatenate([discs, np.array(around).reshape(-1, 3)])
