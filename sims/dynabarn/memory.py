"""Who walks the same way again: what was seen of all, what is known of the other half of the
worlds, and who of them is where one was before.

It is preference: what it gets wrong costs time, or a contact that no claim was about.
"""

from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sims.dynabarn.worlds import half_of, numbers, turned, world

LEAST = 3.0  # [s] since somebody was there: what is newer is the way under way
BESIDE = 0.05  # [m] at most from a way walked before, now and meanwhile
MEANWHILE = 1.0  # [s] for which ways are compared at most
BRIEF = 0.35  # [s] less than which is too little to know a way of another world
BUILT = 1.0  # [s] for which what was seen last is not looked through
WALKS = 3.0  # [m/s] who is faster was not seen walking: it vanished, and appeared elsewhere
ROUNDS = 4  # of a loop that is known: who vanishes appears again
BEFORE = -1e6  # [s] when somebody walked the ways of other worlds
APART = 0.4  # [m] at most between points by which pieces are looked up


@dataclass(eq=False)
class Way:
    """Of one who was seen: times [s], places as complex numbers [m]. loop: [s] after which it
    begins anew; 0 where that is not known.
    """

    times: list[float] = field(default_factory=list)
    places: list[complex] = field(default_factory=list)
    loop: float = 0.0

    def add(self, times, places) -> None:
        """What was seen next: places (n, 2) [m]."""
        self.times.extend(times)
        self.places.extend(np.reshape(places, (-1, 2)) @ [1, 1j])

    def at(self, times) -> np.ndarray:
        """Where it was, or first was, or last."""
        return np.interp(times, self.times, self.places)

    def lately(self) -> tuple[np.ndarray, np.ndarray]:
        """When and where it was seen MEANWHILE, since it appeared."""
        first = np.searchsorted(self.times, self.times[-1] - MEANWHILE - 1e-6)
        times, places = np.array(self.times[first:]), np.array(self.places[first:])
        jumps = np.abs(np.diff(places)) > WALKS * np.diff(times)
        since = int(np.flatnonzero(jumps)[-1]) + 1 if jumps.any() else 0
        return times[since:], places[since:]

    def later(self, ago: float, now: float) -> tuple[np.ndarray, np.ndarray]:
        """When and where one goes on from now on who walks it so many seconds later."""
        times, places = np.array(self.times) + ago, np.array(self.places)
        if self.loop:
            each = self.loop * np.arange(ROUNDS)[:, None]
            times, places = (times + each).ravel(), np.tile(places, ROUNDS)
        first = max(np.searchsorted(times, now) - 1, 0)
        return times[first:], places[first:]


class Pieces(NamedTuple):
    """Of ways, from one time to the next: where it began (complex) and since when, how far it led
    (complex), how long it took, whose it is.
    """

    first: np.ndarray
    since: np.ndarray
    walked: np.ndarray
    took: np.ndarray
    way: np.ndarray


class Known(NamedTuple):
    """Ways, their pieces, and points of these: a tree, and of which piece each is."""

    ways: list[Way]
    pieces: Pieces
    tree: cKDTree
    piece: np.ndarray

    def near(self, here: complex) -> Pieces:
        """All pieces that come within BESIDE of a place, and some more."""
        reach = np.hypot(APART / 2, BESIDE) + 1e-6
        points = self.tree.query_ball_point([here.real, here.imag], reach)
        found = np.unique(self.piece[points])
        return Pieces(*(of[found] for of in self.pieces))


@cache
def known(half: int | None) -> Known:
    """Who walks in the worlds of a half, each way once, turned and mirrored in all eight ways;
    nobody without a half.
    """
    tracks = {
        track.places.tobytes(): track
        for number in numbers()
        if half_of(number) == half
        for track in world(number).tracks
    }
    ways = [
        Way(list(track.times + BEFORE), list(track.places @ turn @ [1, 1j]), track.length + 1e-3)
        for track in tracks.values()
        for turn in turned()
    ]
    pieces = _pieces(ways)
    steps = np.ceil(np.abs(pieces.walked) / APART).astype(int) + 1
    piece = np.repeat(np.arange(len(steps)), steps)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(steps) - steps, steps)
    share = step / np.maximum(steps[piece] - 1, 1)
    points = pieces.first[piece] + share * pieces.walked[piece]
    return Known(ways, pieces, cKDTree(np.stack([points.real, points.imag], axis=1)), piece)


class Memory:
    """All ways seen so far, and those of a half of the worlds, if any."""

    def __init__(self, half: int | None = None):
        self._known = known(half)
        self._ways, self._seen = list(self._known.ways), len(self._known.ways)
        self._until = -np.inf

    def begin(self) -> Way:
        """Of one who is seen from now on."""
        self._ways.append(Way())
        return self._ways[-1]

    def again(self, way: Way) -> tuple[np.ndarray, np.ndarray] | None:
        """When [s] the one of a way is where (complex, [m]) if it goes on as one who was seen here
        before and came from where it comes from; None where nobody was.
        """
        if not way.times:
            return None
        times, places = way.lately()
        now, here = times[-1], places[-1]
        if now > self._until:
            self._pieces = _pieces(self._ways[self._seen :], self._seen)
            self._until = now + BUILT
        both = zip(self._known.near(here), self._pieces, strict=True)
        of = Pieces(*map(np.concatenate, both))
        along = ((here - of.first) * of.walked.conj()).real
        share = np.clip(along / np.maximum(np.abs(of.walked) ** 2, 1e-9), 0.0, 1.0)
        likely = (np.abs(here - of.first - share * of.walked) <= BESIDE) & (of.since <= now - LEAST)
        if now - times[0] < BRIEF:
            likely &= of.way >= self._seen
        # on its piece it was beside as well: few are left, of which all is compared
        earliest = np.searchsorted(times, now - share * of.took - 1e-9)
        back = share - (now - times[earliest]) / np.maximum(of.took, 1e-9)
        there = of.first + back * of.walked
        likely &= np.abs(there - places[earliest]) <= BESIDE + 1e-6
        best, nearest = None, BESIDE
        for i in np.flatnonzero(likely):
            like, ago = self._ways[of.way[i]], now - of.since[i] - share[i] * of.took[i]
            if times[0] - ago < like.times[0] - 0.1:
                continue
            away = np.abs(like.at(times - ago) - places).max()
            if away <= nearest:
                best, nearest = (like, ago), away
        return None if best is None else best[0].later(best[1], now)


def _pieces(ways: list[Way], first: int = 0) -> Pieces:
    """Of all ways; first: number of the first one."""
    found = [_pieces_of(way, number) for number, way in enumerate(ways, first)]
    return Pieces(*map(np.concatenate, zip(_pieces_of(Way(), 0), *found, strict=True)))


def _pieces_of(way: Way, number: int) -> Pieces:
    times, places = np.array(way.times), np.array(way.places, complex)
    led, took = np.diff(places), np.diff(times)
    of = places[:-1], times[:-1], led, took, np.full(len(led), number)
    return Pieces(*(each[np.abs(led) <= WALKS * took] for each in of))
