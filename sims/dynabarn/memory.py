"""Who walks the same way again: what was seen of all, and who of them is where one was before.

It is preference: what it gets wrong costs time, or a contact that no claim was about.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

LEAST = 3.0  # [s] since somebody was there: what is newer is the way under way
BESIDE, CAME = 0.06, 0.12  # [m] from a way walked before, now, and SINCE [s] before now
SINCE = 0.4
BUILT = 1.0  # [s] for which what was seen last is not looked through
NEAREST = 4  # pieces of ways that are looked at
WALKS = 3.0  # [m/s] who is faster was not seen walking: it vanished, and appeared elsewhere


@dataclass(eq=False)
class Way:
    """Of one who was seen: times [s], places as complex numbers [m]."""

    times: list[float] = field(default_factory=list)
    places: list[complex] = field(default_factory=list)

    def add(self, times, places) -> None:
        """What was seen next: places (n, 2) [m]."""
        self.times.extend(times)
        self.places.extend(np.reshape(places, (-1, 2)) @ [1, 1j])

    def at(self, times) -> np.ndarray:
        """Where it was, or first was, or last."""
        return np.interp(times, self.times, self.places)


class Pieces(NamedTuple):
    """Of ways, from one time to the next: where it began (complex) and since when, how far it led
    (complex), how long it took, whose it is.
    """

    first: np.ndarray
    since: np.ndarray
    walked: np.ndarray
    took: np.ndarray
    way: np.ndarray


class Memory:
    """All ways seen so far."""

    def __init__(self):
        self._ways: list[Way] = []
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
        now, here = way.times[-1], way.places[-1]
        if now > self._until:
            self._pieces, self._until = _pieces(self._ways), now + BUILT
        old = Pieces(*(of[self._pieces.since <= now - LEAST] for of in self._pieces))
        along = ((here - old.first) * old.walked.conj()).real
        share = np.clip(along / np.maximum(np.abs(old.walked) ** 2, 1e-9), 0.0, 1.0)
        away = np.abs(here - old.first - share * old.walked)
        came = max(now - SINCE, way.times[0])
        for i in np.argsort(away)[:NEAREST]:
            like, ago = self._ways[old.way[i]], now - old.since[i] - share[i] * old.took[i]
            then = came - ago
            if away[i] > BESIDE or then < like.times[0] - 0.1:
                continue
            if np.abs(like.at(then) - way.at(came)) <= CAME:
                times = np.array(like.times) + ago
                later = max(np.searchsorted(times, now) - 1, 0)
                return times[later:], np.array(like.places[later:])
        return None


def _pieces(ways: list[Way]) -> Pieces:
    """Of all ways."""
    found = []
    for number, way in enumerate(ways):
        times, places = np.array(way.times), np.array(way.places)
        led, took = np.diff(places), np.diff(times)
        of = places[:-1], times[:-1], led, took, np.full(len(led), number)
        found.append([each[np.abs(led) <= WALKS * took] for each in of])
    return Pieces(*(np.concatenate(of) for of in zip(*found, strict=True)))
