"""The worlds: cylinders on loops of key frames, a start, a goal; and the judge of a drive.

Between key frames a mover goes straight, at a constant speed; Gazebo, where they come from, bends
a spline through them. At the end of its loop it vanishes at the border of the field and appears
where the loop begins, at the border too.
"""

import functools
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from sims.barn.contact import distance_to_cylinders
from sims.jackal.params import TICK

FILE = Path(__file__).with_name("worlds.json")
RADIUS = 0.5  # [m] of the cylinders
FIELD = 10.0  # [m] half width of the square in which they walk
START, GOAL, NEAR = (11.0, 0.0, np.pi), (-9.0, 0.0), 1.0  # [m], [rad]
TIMEOUT = 100.0  # [s]
PHASES = 100.0  # [s] among which an episode begins
KINDS = {"easy": range(20), "medium": range(20, 40), "hard": range(40, 60)}


class Track(NamedTuple):
    """One loop of a mover: times (n,) [s] from 0, places (n, 2) [m]."""

    times: np.ndarray
    places: np.ndarray

    @property
    def length(self) -> float:
        """[s]"""
        return float(self.times[-1])

    def at(self, times) -> np.ndarray:
        """Places (..., 2) at times (...) [s] of the loop."""
        x, y = self.places.T
        return np.stack([np.interp(times, self.times, x), np.interp(times, self.times, y)], -1)


@dataclass(frozen=True, eq=False)
class World:
    """A world from a moment on. number: as published, or of the one that it resembles. phase: [s]
    of the loops when it begins.
    """

    number: int
    phase: float
    tracks: tuple[Track, ...] = field(repr=False)

    @property
    def kind(self) -> str:
        """easy, medium or hard."""
        return next(kind for kind, numbers in KINDS.items() if self.number in numbers)

    def movers(self, seconds) -> np.ndarray:
        """Places (..., movers, 2) [m] of all movers at times (...) [s] from the beginning."""
        now = self.phase + np.asarray(seconds)
        return np.stack([track.at(np.mod(now, track.length)) for track in self.tracks], axis=-2)

    def since(self, seconds: float) -> np.ndarray:
        """(movers,) [s] for which each has walked since it appeared."""
        return np.mod(self.phase + seconds, [track.length for track in self.tracks])

    def nearest(self, seen) -> int:
        """Number of the mover that a sighting is of, by its place at its moment."""
        return int(np.argmin(np.linalg.norm(self.movers(seen.at) - seen.place, axis=1)))

    def first_steps(self, step: float) -> np.ndarray:
        """(movers, 2) [m] of the way of each in the first seconds after it appeared."""
        return np.stack([track.at(step) - track.at(0.0) for track in self.tracks])


@functools.cache
def _stored() -> dict[int, tuple[Track, ...]]:
    worlds = json.loads(FILE.read_text())["worlds"]
    return {int(number): tuple(map(_track, movers)) for number, movers in worlds.items()}


def _track(mover: dict) -> Track:
    keys = np.array(mover["keys"])
    return Track(keys[:, 0], keys[:, 1:])


def numbers() -> tuple[int, ...]:
    """Numbers of the worlds that there are."""
    return tuple(_stored())


def world(number: int, phase: float = 0.0) -> World:
    """The world of that number, from a moment [s] of its loops on. Raises InputError."""
    if number not in _stored():
        raise InputError(
            f"DynaBARN world: expected one of the 40 of sims.dynabarn.numbers(); got {number!r}."
        )
    return World(number, float(phase), _stored()[number])


def half_of(number: int) -> int:
    """0 or 1: to which half of the worlds a world belongs."""
    return numbers().index(number) % 2


@dataclass(frozen=True)
class Law:
    """The law of fresh worlds: as many movers as a random one of the 40 of these kinds has, each on
    a track of a random mover of the worlds of its kind and half, the field turned and mirrored for
    it, all from a moment of their loops that is uniform.
    """

    kinds: tuple[str, ...] = tuple(KINDS)

    def __call__(self, seed) -> World:
        """A world; its number is that of the one that it resembles."""
        draw = np.random.default_rng(seed)
        number = int(draw.choice([n for n in numbers() if world(n).kind in self.kinds]))
        like = [n for n in numbers() if half_of(n) == half_of(number)]
        kind = world(number).kind
        tracks = [track for n in like if world(n).kind == kind for track in world(n).tracks]
        chosen = draw.integers(len(tracks), size=len(world(number).tracks))
        walked = [Track(tracks[i].times, tracks[i].places @ _turn(draw)) for i in chosen]
        return World(number, draw.uniform(0.0, 10 * PHASES), tuple(walked))


def _turn(draw: np.random.Generator) -> np.ndarray:
    """(2, 2) one of `turned`."""
    return np.eye(2)[draw.permutation(2)] * draw.choice([-1.0, 1.0], 2)


def turned() -> list[np.ndarray]:
    """(2, 2) each, the eight by which a square becomes itself."""
    signs = [np.array([x, y]) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    return [axes * each for axes in (np.eye(2), np.eye(2)[::-1]) for each in signs]


def reached(place) -> bool:
    """Is a place (2,) near enough to the goal?"""
    return bool(np.linalg.norm(np.asarray(place)[:2] - GOAL) <= NEAR)


def clearances(world: World, path: np.ndarray, size, first: int = 0) -> np.ndarray:
    """The judge: distance (n,) [m] of the true outline, size [m], at true poses (n, 3), one a tick
    from the beginning, to the nearest mover at that tick; 0 or less is contact. first: tick.
    """
    movers = world.movers(TICK * np.arange(first, len(path)))
    pairs = zip(path[first:], movers, strict=True)
    return np.array([distance_to_cylinders(pose, size, m, RADIUS)[0] for pose, m in pairs])
