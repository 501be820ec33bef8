"""One world of the challenge: cylinders on a grid, a start, a goal, and what a drive is worth."""

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError

FILE = Path(__file__).with_name("worlds.npz")
CELL = 0.15  # [m] of the grid
RADIUS = 0.075  # [m] of the cylinders
START = (-2.25, 3.0, np.pi / 2)  # [m], [m], [rad]
GOAL = (-2.25, 13.0)  # [m]
NEAR = 1.0  # [m] from the goal counts as reached
TIMEOUT = 100.0  # [s]
FASTEST = 2.0  # [m/s] that the optimal time is counted with


@dataclass(frozen=True, eq=False)
class World:
    """A world. number: as in the challenge. occupied (30, 64): cells; path_length [m] of the
    published shortest path.
    """

    number: int
    occupied: np.ndarray
    path_length: float

    @property
    def radius(self) -> float:
        """[m] of the cylinders."""
        return RADIUS

    @property
    def cylinders(self) -> np.ndarray:
        """Middles (m, 2) [m]."""
        a, b = np.nonzero(self.occupied)
        return np.stack([-RADIUS - CELL * a, RADIUS + CELL * b], axis=1)

    @property
    def start(self) -> np.ndarray:
        """(3,) x, y [m], heading [rad]."""
        return np.array(START)

    @property
    def goal(self) -> np.ndarray:
        """(2,) [m]."""
        return np.array(GOAL)

    def reached(self, place) -> np.ndarray:
        """Is a place (..., 2) [m] as near to the goal as the challenge asks?"""
        return np.linalg.norm(np.asarray(place)[..., :2] - self.goal, axis=-1) <= NEAR


@functools.cache
def _stored() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    with np.load(FILE) as file:
        bits = np.unpackbits(file["occupied"], count=int(np.prod(file["shape"])))
        occupied = bits.reshape(file["shape"]).astype(bool)
        return file["number"], occupied, file["path_length"]


def numbers() -> list[int]:
    """Numbers of the worlds that there are."""
    return [int(n) for n in _stored()[0]]


def world(number: int) -> World:
    """The world of that number. Raises InputError for one that is not among the 200."""
    known, occupied, lengths = _stored()
    found = np.flatnonzero(known == number)
    if len(found) == 0:
        raise InputError(
            f"BARN world: expected one of {len(known)} numbers from {known.min()} to "
            f"{known.max()}, see sims.barn.numbers(); got {number!r}."
        )
    i = found[0]
    return World(int(number), occupied[i], float(lengths[i]))


def metric(success: bool, seconds: float, path_length: float) -> float:
    """What the challenge gives for a drive: 0 without success, at most 0.5.

    seconds: from the start to the goal. path_length [m] of the world.
    """
    best = path_length / FASTEST
    return float(success) * best / float(np.clip(seconds, 2 * best, 8 * best))
