"""What differs from run to run, and from moment to moment. Each robot has its own random stream."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import generator
from sims.jackal import params as c

BLOCK = 64  # ticks of slip drawn at a time; no number depends on it


@dataclass(frozen=True)
class Law:
    """Ranges (lo, hi) of uniform laws; our choice, declared with every claim.

    friction: of each tyre. mass: factor on chassis and payload. travel: of each wheel, way driven
    per turn, as a factor (air in the tyre). slip: standard deviation of the same factor from moment
    to moment, remembered for `memory` [s]. sensed: [m/s], [rad/s] by which measured speeds are off,
    at most, uniform.
    """

    friction: tuple[float, float] = (0.45, 0.55)
    mass: tuple[float, float] = (0.97, 1.03)
    travel: tuple[float, float] = (0.995, 1.005)
    slip: float = 0.01
    memory: float = 0.2
    sensed: tuple[float, float] = c.SENSED


NONE = Law((0.5, 0.5), (1.0, 1.0), (1.0, 1.0), 0.0, 0.2, (0.0, 0.0))
LAWS = {"floor": Law(), "none": NONE}


def named_law(name: str) -> Law:
    """One of LAWS. Raises InputError."""
    if name not in LAWS:
        raise InputError(f"jackal law: expected one of {', '.join(LAWS)}; got {name!r}.")
    return LAWS[name]


class Draws(NamedTuple):
    """Of B robots: friction (B, 4), mass (B,), travel (B, 4), and their streams for what follows:
    `before`, what was driven before the start, `slips`, `sensors`.
    """

    friction: np.ndarray
    mass: np.ndarray
    travel: np.ndarray
    before: list[np.random.Generator]
    slips: list[np.random.Generator]
    sensors: list[np.random.Generator]


def draw(law: Law, keys) -> Draws:
    """Draws of B robots from their keys (B, 2); each depends on its own key alone."""
    streams = [generator(key) for key in keys]
    friction = np.array([s.uniform(*law.friction, 4) for s in streams]).reshape(-1, 4)
    mass = np.array([s.uniform(*law.mass) for s in streams])
    travel = np.array([s.uniform(*law.travel, 4) for s in streams]).reshape(-1, 4)
    three = [s.spawn(3) for s in streams]
    return Draws(friction, mass, travel, *(list(part) for part in zip(*three, strict=True)))


class Travel:
    """Way that the wheels drive per turn, as a factor of what it should be, tick by tick."""

    def __init__(self, law: Law, draws: Draws):
        self.law, self.steady, self.streams = law, draws.travel, draws.slips
        self.slip = np.array([s.standard_normal(4) for s in self.streams]).reshape(-1, 4)
        self.ahead = iter(())

    def next(self) -> np.ndarray:
        """(B, 4) of the next tick. Every tick's law is the same: steady plus a normal one."""
        fresh = next(self.ahead, None)
        if fresh is None:
            blocks = [s.standard_normal((BLOCK, 4)) for s in self.streams]
            self.ahead = iter(np.stack(blocks, axis=1))
            fresh = next(self.ahead)
        keep = math.exp(-c.TICK / self.law.memory)
        self.slip = keep * self.slip + math.sqrt(1 - keep**2) * fresh
        return self.steady + self.law.slip * self.slip
