"""Drives of a robot that is a number, for episodes in worker processes: imports as little as it
can.
"""

import os
from dataclasses import dataclass

import numpy as np

import parc_jax as pj


def law(seed) -> float:
    """A world: how hard it is."""
    return float(np.random.default_rng(seed).uniform())


@dataclass(frozen=True)
class Toy:
    """Leaves its tube in worlds harder than `left`, touches in those harder than `touched`."""

    left: float = 2.0
    touched: float = 2.0
    breaks: float = 2.0
    dies: float = 2.0

    def __call__(self, world: float, seed) -> pj.drive.Outcome:
        if world > self.dies:
            os._exit(7)
        if world > self.breaks:
            raise ValueError("the wheels came off")
        draw = np.random.default_rng(seed).uniform()
        return pj.drive.Outcome(
            world > self.touched, world > self.left, {"world": world, "draw": draw}
        )


def no_outcome(world, seed):
    return world > 0.5
