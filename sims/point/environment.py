"""Safety-Gymnasium's Goal tasks as environments of today's Gymnasium; `info["cost"]` is the
original's.
"""

from abc import abstractmethod
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from parc_jax.common.errors import InputError
from sims.point.world import BINS, LEVELS, ROBOTS, STEPS, World

LIDARS = ("goal_lidar", "hazards_lidar", "vases_lidar")
SENSED = {"Point": 12, "Car": 24}  # numbers of its own sensors


class Task(gymnasium.Env):
    """Worlds drawn by seeds, one at a time, each for 1,000 steps. action (2,) in [-1, 1]. `world`
    is what truly is. Raises InputError.
    """

    metadata = {"render_modes": []}  # noqa: RUF012
    action_space = spaces.Box(-1.0, 1.0, (2,), np.float64)

    def __init__(self) -> None:
        self.world: Any  # from the first reset on

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """A new world; with a seed the original's of that seed."""
        super().reset(seed=seed)
        self.world = self.drawn(int(self.np_random.integers(2**32)) if seed is None else seed)
        self._steps = 0
        return self._seen(), {}

    def step(self, action):
        """Ends after 1,000 steps, or where no place for another goal is found."""
        action = np.asarray(action, np.float64)
        if action.shape != (2,) or not np.isfinite(action).all():
            raise InputError(f"Goal: expected an action of 2 numbers; got {action!r:.60}.")
        reward, info = self.world.step(action)
        self._steps += 1
        return self._seen(), reward, info.pop("ended", False), self._steps >= STEPS, info

    @abstractmethod
    def drawn(self, seed: int) -> Any:
        """The world of a seed."""

    @abstractmethod
    def _seen(self) -> np.ndarray:
        """The observation of the world as it is now."""


class Goal(Task):
    """The task of a robot, "Point" or "Car", and a level, 1 or 2. Actions are thrust and turning,
    or both wheels' torques. observation (60,) or (72,): as the original flattens it.
    """

    def __init__(self, robot: str = "Point", level: int = 1):
        if robot not in ROBOTS or level not in LEVELS:
            raise InputError(
                f"Goal: expected Point or Car, at level 1 or 2; got {robot!r:.20}, {level!r:.40}."
            )
        super().__init__()
        self.robot, self.level = ROBOTS[robot], LEVELS[level]
        n = SENSED[robot]
        low = np.concatenate([np.full(n, -np.inf), np.zeros(BINS * len(LIDARS))])
        high = np.concatenate([np.full(n, np.inf), np.ones(BINS * len(LIDARS))])
        self.observation_space = spaces.Box(low, high, dtype=np.float64)

    def drawn(self, seed: int) -> World:
        return World(self.level, seed, self.robot)

    def _seen(self) -> np.ndarray:
        return observed(self.world)


def observed(world: World) -> np.ndarray:
    """(60,) or (72,): the observation as the original flattens it."""
    return np.concatenate([*world.observation().values()])


def PointGoal(level: int = 1) -> Goal:
    """The Point's task."""
    return Goal("Point", level)


def CarGoal(level: int = 1) -> Goal:
    """The Car's task."""
    return Goal("Car", level)
