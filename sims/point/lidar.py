"""The Point by its own sensors alone: `pj.drive.Shield(Remembers(env), model, **lidar.door())`.

The pseudo lidar tells of 16 sectors how near the nearest hazard is, and a share of it to the
sectors beside. So each reading rules places out: a hazard there would have been told of. What no
reading of an episode has ruled out may hold a hazard, and is kept clear of. Memory needs odometry:
the compass, and velocities summed up.
"""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

import parc_jax as pj
from parc_jax.common.errors import InputError
from sims.point import sensing
from sims.point.environment import LIDARS
from sims.point.guide import CELL, Guide
from sims.point.manoeuvre import MASS_AHEAD
from sims.point.world import BINS, FAR, HAZARD, POINT, STEP, VASE

DRIFT = 0.003  # [m] assumed: odometry is nowhere farther off in an episode; `episodes` measures it
SURE = 1e-9  # [1] more than readings round by
FLOOR, LEAST, SHARE = 6.4, 0.005, 0.01  # [m] half the edge of all; of a square; per distance
SQUARE, BLOCK = 0.16, 0.04  # [m] half the edge of the first squares; edge of what becomes one box
NEAR = 0.75  # [m] farther away than hazard, robot and manoeuvre, or vase, reach together
DETAIL = 1.3  # [m] up to where squares are split
LATE = 0.55  # share of the velocity at a step's end in its mean: the engine moves by the later one
# [m] by which the middle of a vase turned any way grows, so that HAZARD holds the robot's outline
TURNED_VASE = np.sqrt(2) * VASE + sensing.OUTLINE - HAZARD
EIGHT = np.stack([f(np.pi / 4 * np.arange(8)) for f in (np.cos, np.sin)], axis=1)
QUARTERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
AFTER, BEFORE = np.roll(np.arange(BINS), -1), np.roll(np.arange(BINS), 1)  # of each sector


class Places:
    """Where the middles of things of one kind may be: squares, middle (n, 2) and half (n,) [m]."""

    def __init__(self):
        axis = np.arange(-FLOOR + SQUARE, FLOOR, 2 * SQUARE)
        self.middle = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        self.half = np.full(len(self.middle), SQUARE)

    def look(self, pose: np.ndarray, reading: np.ndarray) -> None:
        """Leave out what a reading (BINS,) at a pose (3,) rules out; near squares are split."""
        middle, half, kept = self.middle, self.half, []
        while len(half):
            there = ~ruled_out(middle, half, pose, reading)
            middle, half = middle[there], half[there]
            away = np.hypot(*(middle - pose[:2]).T)
            coarse = (away < DETAIL) & (half > LEAST) & (half > SHARE * away)
            kept.append((middle[~coarse], half[~coarse]))
            half = np.repeat(half[coarse] / 2, 4)
            corners = np.tile(QUARTERS, (len(half) // 4, 1))
            middle = np.repeat(middle[coarse], 4, axis=0) + corners * half[:, None]
        self.middle, self.half = map(np.concatenate, zip(*kept, strict=True))

    def hold(self, places: np.ndarray) -> np.ndarray:
        """Whether one of them may be at each of some places (m, 2), up to DRIFT."""
        x, y = np.abs(places[:, :, None] - self.middle.T).swapaxes(0, 1)
        return (np.maximum(x, y) <= self.half + DRIFT).any(axis=1)

    def near(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners (m, 2) of boxes that hold all squares near a place."""
        x, y = np.maximum(np.abs(self.middle - place).T - self.half, 0.0)
        some = np.hypot(x, y) < NEAR
        middle, half = self.middle[some], self.half[some, None]
        small = half < BLOCK / 2  # by the block that they are in; each of the others alone
        block = np.where(small, np.floor(middle / BLOCK), np.round(middle / LEAST))
        order = np.lexsort([~small[:, 0], *block.T[::-1]])
        key = np.column_stack([block, small])[order]
        new = np.flatnonzero((np.diff(key, axis=0, prepend=np.inf) != 0).any(axis=1))
        lo, hi = (middle - half)[order], (middle + half)[order]
        return np.minimum.reduceat(lo, new, axis=0), np.maximum.reduceat(hi, new, axis=0)


def ruled_out(
    middle: np.ndarray, half: np.ndarray, pose: np.ndarray, reading: np.ndarray
) -> np.ndarray:
    """(n,) whether anything in a square, grown by DRIFT, would have been told of otherwise."""
    x, y = (middle - pose[:2]).T
    away, grown = np.hypot(x, y), np.sqrt(2) * half + DRIFT
    close = (FAR - away - grown) / FAR - SURE  # of the farthest place of it
    ruled = close > reading.max()
    asked = np.flatnonzero((close > reading.min()) & ~ruled)  # others are beyond every reading
    x, y, away, grown, close = (of[asked] for of in (x, y, away, grown, close))
    width = 2 * np.pi / BINS
    spread = np.arcsin(np.minimum(grown / np.maximum(away, grown), 1.0)) / width + SURE
    angle = (np.arctan2(y, x) - pose[2]) / width
    first, last = angle - spread, angle + spread
    sector, end = np.floor(first), np.floor(last)

    def told_less(sector, lo, hi):
        """In this sector, between these shares of it."""
        at = sector.astype(int) % BINS
        own, after, before = reading[at], reading[AFTER[at]], reading[BEFORE[at]]
        return (close > own) | (lo * close > after) | ((1 - hi) * close > before)

    whole = sector == end
    one = told_less(sector, first - sector, np.where(whole, last - sector, 1.0))
    other = told_less(end, 0.0, last - end)
    ruled[asked] = (end - sector <= 1) & one & (whole | other)  # over more only if by all
    return ruled


def guesses(reading: np.ndarray) -> np.ndarray:
    """(m, 2) [m] in the robot's frame: where one of each sector may be that tells of more than both
    beside it, by the share that the next sector has of it, and by that of the one before. Other
    things may have a part in one of these. For a driver; it proves nothing.
    """
    after, before = reading[AFTER], reading[BEFORE]
    at = np.flatnonzero((reading > 0) & (reading >= after) & (reading >= before))
    away = FAR * (1 - reading[at])
    shares = after[at] / reading[at], 1 - before[at] / reading[at]
    places = [(away, 2 * np.pi / BINS * (at + share)) for share in shares]
    return np.concatenate([(far * [np.cos(to), np.sin(to)]).T for far, to in places])


class Memory:
    """What an episode has told so far, in the frame of odometry, which begins at the start: pose
    (3,), speeds (3,) as measured; where hazards and vases may be; and what a driver takes for true:
    hazards, vases, goal, which `Guide` reads as those of a world.
    """

    robot = POINT

    def __init__(self, observation: np.ndarray):
        self.speeds, self._velocity, heading, readings = self._measured(observation)
        self.pose = np.array([0.0, 0.0, heading])
        self._from_mass = MASS_AHEAD * np.array([np.cos(heading), np.sin(heading)])
        self.hazards, self._vases = np.zeros((0, 2)), np.zeros((0, 2))
        self.layout = {"goal": np.zeros(2)}
        self.of_hazards, self.of_vases = Places(), Places()
        self._look(readings)

    def step(self, observation: np.ndarray) -> None:
        """One step of the environment later."""
        self.speeds, velocity, heading, readings = self._measured(observation)
        ahead = np.array([np.cos(heading), np.sin(heading)])
        moved = STEP * ((1 - LATE) * self._velocity + LATE * velocity)
        place = self.pose[:2] + self._from_mass + moved - MASS_AHEAD * ahead
        self.pose, self._velocity = np.array([*place, heading]), velocity
        self._from_mass = MASS_AHEAD * ahead
        self._look(readings)

    @property
    def place(self) -> np.ndarray:
        """(2,) [m]."""
        return self.pose[:2]

    def vase_boxes(self) -> np.ndarray:
        """(n, 4, 2) [m] as a world's, of two for each vase, since none knows how it is turned."""
        corners = self._vases[:, None] + np.sqrt(2) * VASE * EIGHT
        return np.concatenate([corners[:, ::2], corners[:, 1::2]])

    def obstacles(self) -> list:
        """Polygons that hold all that may be near, which a shield keeps clear of."""
        if np.abs(self.place).max() > FLOOR - NEAR:
            raise InputError(f"lidar: expected a robot within {FLOOR - NEAR:g} m of its start.")
        found = []
        for places, more in ((self.of_hazards, DRIFT), (self.of_vases, DRIFT + TURNED_VASE)):
            lo, hi = places.near(self.place)
            # eight sides hold a box grown by a disc
            far = np.maximum(lo[:, None] * EIGHT, hi[:, None] * EIGHT).sum(axis=2) + more
            found += [pj.hpolytope(EIGHT, b) for b in far]
        return found

    def _measured(self, observation: np.ndarray):
        """Speeds (3,), velocity (2,) of the middle of the mass, heading, readings of lidars."""
        n = 3 * len(POINT.senses)
        _, speeds, gyro, compass = observation[:n].reshape(-1, 3)
        heading = np.arctan2(-compass[0], -compass[1])
        cos, sin = np.cos(heading), np.sin(heading)
        ahead, aside = speeds[0], speeds[1] + MASS_AHEAD * gyro[2]
        velocity = np.array([cos * ahead - sin * aside, sin * ahead + cos * aside])
        readings = observation[n:].reshape(len(LIDARS), BINS)
        return np.array([*speeds[:2], gyro[2]]), velocity, heading, readings

    def _look(self, readings: np.ndarray) -> None:
        self._readings = _, hazards, vases = readings
        self.of_hazards.look(self.pose, hazards)
        self.of_vases.look(self.pose, vases)

    def guess(self) -> None:
        """Bring up to date what a driver takes for true; before each of its actions."""
        goal, hazards, vases = self._readings
        self.hazards = self._guessed(self.hazards, hazards, self.of_hazards)
        self._vases = self._guessed(self._vases, vases, self.of_vases)
        (*seen,) = self._in_world(guesses(goal))
        if seen and np.linalg.norm(seen[0] - self.layout["goal"]) > 4 * DRIFT:
            self.layout["goal"] = seen[0]

    def _in_world(self, places: np.ndarray) -> np.ndarray:
        cos, sin = np.cos(self.pose[2]), np.sin(self.pose[2])
        return self.place + places @ np.array([[cos, sin], [-sin, cos]])

    def _guessed(self, known: np.ndarray, reading: np.ndarray, places: Places) -> np.ndarray:
        """What was guessed and is still possible, and what a reading adds."""
        seen = self._in_world(guesses(reading))
        off = np.linalg.norm(known - seen[:, None], axis=2)
        for place in seen[~(off < HAZARD / 2).any(axis=1)]:  # seldom one
            if not (np.linalg.norm(known - place, axis=1) < HAZARD / 2).any():
                known = np.concatenate([known, place[None]])
        return known[places.hold(known)]


class WaryGuide(Guide):
    """A driver by memory: what may hold a hazard is larger than the hazard."""

    keep, rest, more = 0.29, 0.0, -CELL / 8

    def __call__(self, worlds: Sequence[Memory]) -> np.ndarray:
        """As of `Guide`."""
        for memory in worlds:
            memory.guess()
        return super().__call__(worlds)


class Remembers(gymnasium.Wrapper):
    """A PointGoal that also sums up in `memory` what it has told."""

    def reset(self, **options: Any) -> tuple[Any, dict]:
        """Forget, and begin."""
        observation, info = self.env.reset(**options)
        self.memory = Memory(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict]:
        """As without it."""
        observation, *told = self.env.step(action)
        self.memory.step(observation)
        return observation, *told


def door() -> dict:
    """Arguments of `pj.drive.Shield`."""
    door = sensing.door()
    off = f"nowhere farther off than {DRIFT:g} m in an episode, by which all is grown"
    return door | {"sense": sense, "assumed": door["assumed"] | {"odometry": off}}


def sense(env, observation) -> pj.drive.Sensed:
    """Pose, speeds, and what may stand in the way, from what was observed alone."""
    memory = env.get_wrapper_attr("memory")
    return pj.drive.Sensed(memory.pose, memory.speeds, memory.obstacles(), drift=DRIFT)
