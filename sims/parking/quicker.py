"""A known way made quicker: the quickest way of single manoeuvres between poses along it and near
it, at rest or rolling; then near that one, and so on.
"""

from typing import NamedTuple

import numpy as np

from sims.parking import car as c
from sims.parking.kinematics import (
    MOST,
    UPTO,
    compose,
    ends,
    joined,
    leaves,
    rolls,
    samples_of,
    seconds,
    stand,
    steering,
)
from sims.parking.known import Known
from sims.parking.space import LIKED, Space
from sims.parking.way import Tried, Way, moments

SINGLE = 1.0  # [s] that each further manoeuvre from rest costs beside its time
ROLLED = 0.3  # [s] likewise, of one that begins while the car rolls
# such a one begins with the wheels about where the one before has them: their difference, squared,
# by the speed, turns the car by as much [rad] before they are; and faster than that [m/s]
TURNED, ROLLING = 0.12, 0.5
CORRECTS = 2.0  # of the steering that corrects it, as a share, for each of that and of m of way
BEYOND = 0.4  # [m] of its way, at least, beyond what it takes to stop
SHORTEST = 0.05  # [m] of a manoeuvre
STOPS = 1.5  # [m] of way between poses from which a shorter way may go on
# of poses near a way, one round after another
SPREADS = (0.0, 1.0, 1.0, 1.0, 0.7, 0.7, 0.5, 0.5, 0.35, 0.35, 0.25, 0.2, 0.15)
# [m, m, rad] of such poses, and how many for each of the way
DRAWN, NEARBY = np.array([0.6, 0.4, 0.2]), 12
MOST_NEARBY = 240  # of all poses of a way, about
REPLACED = 4  # manoeuvres that are tried to be replaced by one
UNSURE = 5.0  # [s] that a manoeuvre which may not be driven counts as
DETOUR = 3.0  # [s] that a manoeuvre may take more than what it is in place of
AVOIDED = 2.0  # [s / m] that each m of clearance less than LIKED costs


class Stops(NamedTuple):
    """Poses (s, 3) by which a way may lead, from its start, the first, to its end, the last. order
    (s,): each is before those with more. passed (s,): [s] about, when the way passes there.
    """

    poses: np.ndarray
    order: np.ndarray
    passed: np.ndarray


class Hops(NamedTuple):
    """Manoeuvres k (h, 3) from stops to later ones: begin, end (h,), their numbers. rolls_on (h,):
    does the car roll on at its end?
    """

    k: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    rolls_on: np.ndarray

    def of(self, some: np.ndarray) -> "Hops":
        """Some of them."""
        return Hops(*(each[some] for each in self))


class Quicker:
    """Makes ways quicker that begin at a pose start (3,), at rest, the wheels [rad] as they are.
    space, known, rolling: as of a Guide.
    """

    def __init__(self, space: Space, known: Known, rolling: bool, start, wheels: float):
        self._space, self._known, self._rolling = space, known, rolling
        self._start, self._wheels = start, wheels

    def _mend(self, way: Way) -> Tried:
        """A way as the car can drive it."""
        return self._known.mend(way, self._start, self._wheels, self._space)

    def quicker(self, way: Way, seed: int) -> Tried:
        """The quickest found in all rounds, as the car can drive it. seed: of poses near it."""
        draw = np.random.default_rng(seed)
        best = self._mend(way)
        for spread in SPREADS:
            found = self._quickest(best.way, stops_near(best.way, spread, draw, self._wheels))
            best = min(best, self._mend(found), key=costs)
        return best

    def _quickest(self, way: Way, stops: Stops) -> Way:
        """The quickest way by some of the stops, or the one given where it finds none."""
        hops = self._hops(way, stops)
        clear, at_rest, rolling = self._fits(hops, stops)
        some = at_rest | rolling
        hops, clear, at_rest, rolling = hops.of(some), clear[some], at_rest[some], rolling[some]
        took, before = self._race(hops, stops, AVOIDED * (LIKED - clear), at_rest, rolling)
        finals = np.flatnonzero(hops.end == len(stops.poses) - 1)
        if not len(finals) or not np.isfinite(took[finals]).any():
            return way
        one, rows = finals[np.argmin(took[finals])], []
        while one >= 0:
            rows.append(one)
            one = before[one]
        rows = rows[::-1]
        return Way(hops.k[rows], stops.poses[[0, *hops.end[rows]]], hops.rolls_on[rows])

    def _hops(self, way: Way, stops: Stops) -> Hops:
        """Those of a way, and those between two stops that are worth a look."""
        poses, passed, last = stops.poses, stops.passed, len(stops.poses) - 1
        further = stops.order - stops.order[:, None]
        begin, end = np.nonzero((further > 0) & (further <= REPLACED))
        most = passed[end] - passed[begin] + DETOUR
        far = np.hypot(*(poses[end, :2] - poses[begin, :2]).T)
        some = far / (c.MARGIN * c.SPEED) < most
        begin, end = begin[some], end[some]
        n = len(way.k)
        found = [Hops(way.k, np.arange(n), np.array([*range(1, n), last]), way.rolls_on)]
        for rolls_on in (False, True)[: 1 + self._rolling]:
            some = (end < last) | (not rolls_on)
            first, then = begin[some], end[some]
            k, there = joined(poses[first], poses[then], UPTO if rolls_on else 1.0)
            # at its quickest, for those that end while it rolls the car may roll already
            took = rolls(k, c.SPEED)[0] if rolls_on else seconds(k)
            there &= (np.abs(k[:, 0]) > SHORTEST) & (took < passed[then] - passed[first] + DETOUR)
            found.append(Hops(k, first, then, np.full(len(k), rolls_on)).of(there))
        return Hops(*(np.concatenate(each) for each in zip(*found, strict=True)))

    def _fits(self, hops: Hops, stops: Stops) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(h,) [m] of clearance of each, and whether it may begin at rest, and while it rolls."""
        k, clear = hops.k, np.full(len(hops.k), -1.0)
        n = samples_of(k)
        for m in np.unique(n):
            some = np.flatnonzero(n == m)
            poses = compose(stops.poses[hops.begin[some], None], ends(k[some], int(m)))
            least = self._space.around(poses.reshape(-1, 3), True)
            clear[some] = least.reshape(len(some), -1).min(axis=1)
        final, room, may = hops.end == len(stops.poses) - 1, self._space.room(self._start, True), []
        for begins in (0.0, c.SPEED / 2):
            fits = clear >= self._space.needed(self._known.width(k, begins), room)
            fits[final] &= self._known.sure(k[final], stops.poses[-1], begins)
            may.append(fits)
        return clear, may[0], may[1] & self._rolling

    def _race(
        self, hops: Hops, stops: Stops, beside, at_rest, rolling
    ) -> tuple[np.ndarray, np.ndarray]:
        """Of each hop the [s] of the quickest way that ends with it, inf without one, and the hop
        before (-1: none). beside (h,): [s] that each costs beside its time.
        """
        k, begin, wheels = hops.k, hops.begin, leaves(hops.k, hops.rolls_on)
        first, steered = steering(k)[0], np.abs(k[:, 1:]).max(axis=1)
        took, speed = np.full(len(k), np.inf), np.zeros(len(k))
        before = np.full(len(k), -1)
        for e in np.argsort(stops.order[begin], kind="stable"):
            if begin[e] == 0:
                into, begins, fits = np.array([-1]), np.zeros(1), at_rest[e : e + 1]
                since = np.array([stand(first[e] - self._wheels, k[e, 0]) + SINGLE])
            else:
                into = np.flatnonzero((hops.end == begin[e]) & np.isfinite(took))
                if not len(into):
                    continue
                on, begins, turned = hops.rolls_on[into], speed[into], wheels[into] - first[e]
                goes = (np.sign(k[into, 0]) == np.sign(k[e, 0])) & (begins * turned**2 < TURNED)
                goes &= c.stopping(begins) + BEYOND < abs(k[e, 0])
                goes &= begins * turned**2 * CORRECTS < (MOST - steered[e]) * abs(k[e, 0])
                fits = np.where(on, goes & rolling[e], at_rest[e])
                since = took[into] + np.where(on, ROLLED, stand(turned, k[e, 0]) + SINGLE)
            move = np.repeat(k[e : e + 1], len(into), axis=0)
            if hops.rolls_on[e]:
                lasts, ends_at = rolls(move, begins)
                fits = fits & (ends_at > ROLLING)
            else:
                lasts, ends_at = seconds(move, begins), np.zeros(len(move))
            costs = np.where(fits, since + lasts, np.inf)
            best = int(np.argmin(costs))
            took[e], speed[e], before[e] = costs[best] + beside[e], ends_at[best], into[best]
        return took, before


def costs(tried: Tried) -> float:
    """[s] that a way takes, and more for each manoeuvre that may not be driven."""
    return tried.takes + UNSURE * tried.fails


def stops_near(way: Way, spread: float, draw, wheels: float) -> Stops:
    """Stops along a way, those where its manoeuvres begin first, and near both, drawn; the wheels
    [rad] are as they are where it begins.
    """
    poses, order = [way.poses[:-1]], [np.arange(len(way.k))]
    for i, (pose, k, upto) in enumerate(zip(way.poses[:-1], way.k, way.upto, strict=True)):
        n = max(1, int(abs(k[0]) * upto / STOPS))
        poses.append(compose(pose, ends(k[None], n, upto)[0])[:-1])
        order.append(i + np.arange(1, n) / n)
    poses, order = np.concatenate(poses), np.concatenate(order)
    if spread:
        rows = np.tile(np.arange(1, len(poses)), int(np.clip(MOST_NEARBY // len(poses), 2, NEARBY)))
        moves = spread * DRAWN * draw.normal(size=(len(rows), 3))
        poses = np.concatenate([poses, compose(poses[rows], moves)])
        order = np.concatenate([order, order[rows]])
    poses = np.concatenate([poses, way.poses[-1:]])
    order = np.concatenate([order, [len(way.k)]])
    clock = moments(way, wheels)
    return Stops(poses, order, np.interp(order, np.arange(len(clock)), clock))
