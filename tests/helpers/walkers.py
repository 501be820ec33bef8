"""Robots in NumPy alone, which worker processes load at once: one walks at random, the others do it
in bad company.
"""

import os
import time
from pathlib import Path

import numpy as np

DRIFT = 1.0
ROADS: dict[str, float] = {}


def walk(rng, k):
    """A random walk with drift k in the plane, which slips for large k."""
    if k[0] > 0.9:
        raise ValueError("slipped")
    steps = DRIFT * k[0] + rng.normal(size=(2, 2))
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), [k[0]]


def upright(rng, k):
    """The first one, which never slips."""
    return walk(rng, 0.9 * k)


def remembers(rng, k):
    """The same on a road that each process surveys once, at its first run."""
    ROADS.setdefault("slope", 0.0)
    return upright(rng, k + ROADS["slope"])


def remembers_from(rng, k, p0):
    """The same from p0."""
    p, q = remembers(rng, k)
    return p + p0, q


def logged(rng, k, folder: str):
    """The same, ending its process by chance that is not its seed's, except for the first eight,
    so that the simulator is seen to work; one begun twice is an error that nobody survives.
    """
    diary = Path(folder, k[0].hex())
    with open(diary, "x") as file:
        file.write("begun")
    if len(os.listdir(folder)) > 8 and os.urandom(1)[0] < 77:
        os._exit(9)
    diary.write_text("ended")
    return upright(rng, k)


def unequipped(rng, k):
    """Needs a package that nobody has."""
    import no_such_simulator  # noqa: F401


def slowly(rng, k):
    """The first one, with time to be killed in."""
    time.sleep(0.05)
    return walk(rng, k)


FLOOR = {"slip": 0.1}  # [1] of rows that walk there


def rough(rng, k):
    """A walk on the floor."""
    p, q = walk(rng, k)
    return np.asarray(p) * (1.0 + FLOOR["slip"]), q


def smooth(rng, k):
    """The same on another floor, which stays."""
    FLOOR["slip"] = 0.005
    return rough(rng, k)
