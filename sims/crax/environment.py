"""CRAX's Goal tasks as an environment of Gymnasium; `info["cost"]` is the original's."""

import numpy as np
from gymnasium import spaces

from parc_jax.common.errors import InputError
from sims.crax.world import LEVELS, World
from sims.point.environment import Task

SEEN = 62  # numbers of an observation


class CraxGoal(Task):
    """The Point's task at a level, 1, 2 or 3. action: thrust, turning. observation (62,). Raises
    InputError.
    """

    def __init__(self, level: int = 1):
        if level not in LEVELS:
            raise InputError(f"CraxGoal: expected level 1, 2 or 3; got {level!r:.40}.")
        super().__init__()
        self.level = LEVELS[level]
        self.observation_space = spaces.Box(-np.inf, np.inf, (SEEN,), np.float64)

    def drawn(self, seed: int) -> World:
        return World(self.level, seed)

    def _seen(self) -> np.ndarray:
        return self.world.observation()
