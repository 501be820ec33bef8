"""A puck that is shot and comes back from a cushion, which stands in the world: where it begins
matters. How much a bounce takes, and how hard it is shot, is chance that grows with the shot.

k = (speed [m/s], angle [rad]): ahead along x, turned to the left. It slides for two seconds and
slows down; the cushion is at y = WALL.
"""

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox, toy

K = ((1.0, 0.0), (2.0, 1.2))
WALL = 0.8  # [m]
LEFT = (0.6, 0.8)  # of the speed across it, after a bounce
SLOWER = 0.35  # [1/s] of the speed
SHOT = 0.02  # of the speed, more or less
RECORDS, DT = 20, 0.1  # [s]


def box(variant: str) -> BlackBox:
    """It has no variants. Raises Refused."""
    if variant:
        raise Refused(f"cushion: expected no variant; got {variant!r}.")
    return toy(
        "cushion",
        2,
        _run,
        n_even=2,
        k_lo=K[0],
        k_hi=K[1],
        n_p=2,
        dt=DT,
        records=RECORDS,
        fixed=True,
    )


def _run(p0, k, u):
    t = np.linspace(0.0, RECORDS * DT, RECORDS + 1)[None, :]
    way = (1 - np.exp(-SLOWER * t)) / SLOWER  # [s] of the first speed
    speed = k[:, :1] * (1 + SHOT * (2 * u[:, :1] - 1))
    left = LEFT[0] + (LEFT[1] - LEFT[0]) * u[:, 1:]
    x = p0[:, :1] + speed * np.cos(k[:, 1:]) * way
    y = p0[:, 1:] + speed * np.sin(k[:, 1:]) * way
    beyond = np.where(p0[:, 1:] <= WALL, np.maximum(y - WALL, 0.0), 0.0)
    y = np.where(beyond > 0, WALL - left * beyond, y)
    return np.stack([x, y], axis=2)[:, :, None], np.empty((len(k), 0))
