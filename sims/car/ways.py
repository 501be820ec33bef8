"""How long the Car takes to a goal from each place and heading of a coarse map. It stops to turn
and drives backwards as fast as forwards, so a way of few turns may end sooner than a shorter one.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.sparse import csr_array

from sims.point.guide import CELL as FINE

FINER = 2  # cells of the map without headings along the edge of one here
CELL, HEADINGS = FINER * FINE, 16  # [m]; of half a turn
AHEAD = 0.15  # [m] of a step to the next places
SWEEPS = 30  # steps looked ahead from times without turns
TURN = 0.5  # [s] that turns on the way take, before it is looked ahead
NARROW, BLOCKED = 1.25, 15.0  # how much dearer than free is what is near, or too near, to anything
WIDE = 0.03  # [m] more than that is free


class Steps(NamedTuple):
    """From each heading and place (h n n) one step ahead, and one back: places (n n, 2); at (2, h n
    n, 2) the ends; of (2,) matrices that give what is known at places its value at the ends.
    """

    places: np.ndarray
    at: np.ndarray
    of: Sequence[csr_array]


def size(half: float) -> int:
    """Places along the edge of a map. half: [m] of it."""
    return round(2 * half / CELL) + 1


@cache
def steps(half: float) -> Steps:
    """Of a map."""
    axis = np.linspace(-half, half, size(half))
    places = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
    angles = np.pi / HEADINGS * np.arange(HEADINGS)
    ways = AHEAD * np.stack([np.cos(angles), np.sin(angles)], -1)[:, None]
    ends = [np.clip(places + way, -half, half).reshape(-1, 2) for way in (ways, -ways)]
    return Steps(places, np.array(ends), [_between(end, half) for end in ends])


def _between(ends: np.ndarray, half: float) -> csr_array:
    """What is known at places, of the same heading, between them at ends (h n n, 2)."""
    n = size(half)
    at = np.minimum((ends + half) / CELL, n - 1.001)
    (i, j), (a, b) = at.astype(int).T, (at % 1.0).T
    first = np.repeat(np.arange(HEADINGS), n * n) * n * n + i * n + j
    columns = np.stack([first, first + n, first + 1, first + n + 1], -1)
    shares = np.stack([(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b], -1)
    rows = np.repeat(np.arange(len(ends)), 4)
    values = shares.ravel().astype(np.float32)
    return csr_array((values, (rows, columns.ravel())), (len(ends), len(ends)))


def dear(discs: np.ndarray, half: float) -> np.ndarray:
    """(2, h n n) [m] of the steps, longer where they come near to discs (m, 3)."""
    known = steps(half)
    ends = known.at
    middles = (ends + np.tile(known.places, (HEADINGS, 1))) / 2
    away = np.full(ends.shape[:2], np.inf)
    for x, y, keep in discs:
        for at in (middles, ends):
            away = np.minimum(away, np.hypot(at[..., 0] - x, at[..., 1] - y) - keep)
    more = np.select([away < 0.0, away < WIDE], [BLOCKED, NARROW], 1.0)
    return (AHEAD * more).astype(np.float32)


def times(
    guess: np.ndarray, dear: np.ndarray, goal: np.ndarray, speeds: tuple[float, float], half: float
) -> np.ndarray:
    """(h, n, n) [s] to a goal (3,) x, y, radius. guess: (n, n) [s] without turns; dear: as of
    `dear`; speeds: [m/s] ahead, [rad/s] on the spot.
    """
    known, n = steps(half), size(half)
    fast, turning = speeds
    met = np.linalg.norm(known.places - goal[:2], axis=1) < goal[2] - 0.02
    begin = np.where(met, 0.0, guess.ravel() + TURN).astype(np.float32)
    found, lost = np.tile(begin, (HEADINGS, 1)), np.float32(np.pi / HEADINGS / turning)
    for _ in range(SWEEPS):
        for of, cost in zip(known.of, dear / np.float32(fast), strict=True):
            found = np.minimum(found, (of @ found.ravel() + cost).reshape(HEADINGS, -1))
        for _ in range(2):
            beside = np.minimum(np.roll(found, 1, axis=0), np.roll(found, -1, axis=0))
            found = np.minimum(found, beside + lost)
        found[:, met] = 0.0
    return found.reshape(HEADINGS, n, n)


def read(found, place, axis, half: float):
    """(k,) of times, at places (2, k) with axes (2, k)."""
    at = jnp.clip((place + half) / CELL, 0, size(half) - 1.001)
    (i, j), (a, b) = at.astype(int), at % 1.0
    heading = jnp.arctan2(axis[1], axis[0]) % np.pi * (HEADINGS / np.pi)
    first = heading.astype(int)
    share, left = heading - first, 0.0
    for h, part in ((first % HEADINGS, 1 - share), ((first + 1) % HEADINGS, share)):
        low = (1 - b) * found[h, i, j] + b * found[h, i, j + 1]
        high = (1 - b) * found[h, i + 1, j] + b * found[h, i + 1, j + 1]
        left += part * ((1 - a) * low + a * high)
    return left
