"""A known way made quicker: the quickest way of single manoeuvres between poses along it and near
it, at rest or rolling; then near that one, and so on.
"""

from typing import NamedTuple

import numpy as np

from sims.parking import car as c
from sims.parking.kinematics import (
    LONGEST,
    MOST,
    UPTO,
    compose,
    ends,
    joined,
    leaves,
    offset_from,
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
SPEEDS = np.linspace(0.4, 2.4, 11)  # [m/s] at which tubes are looked up of manoeuvres begun so
BEYOND = 0.3  # [m] of its way, at least, beyond what it takes to stop
SHORTEST = 0.05  # [m] of a manoeuvre
STOPS = 1.5  # [m] of way between poses from which a shorter way may go on
# of poses near a way, one round after another: first far, where ways part, then near the best ones
FAR, NEAR = (0.0, 1.0, 1.0, 1.0, 0.7, 0.7), (0.5, 0.5, 0.35, 0.35, 0.25, 0.2, 0.15)
# [m, m, rad] of such poses, and how many for each of the way
DRAWN, NEARBY = np.array([0.6, 0.4, 0.2]), 12
MOST_NEARBY = 240  # of all poses of a way, about
# manoeuvres like those of a way, of which one leads surely to it and one from it, for each so many
# poses near it; their spread, of the logarithm of the way and of shares of the steering
LED, LIKE = 2, (0.5, 0.4)
LASTS = 1  # times more often the last one, for whose tube the goal leaves little room
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

    def quicker(self, way: Way, seed: int, spreads=FAR + NEAR) -> Tried:
        """The quickest found in all rounds, as the car can drive it. seed: of poses near it;
        spreads: of each round.
        """
        draw = np.random.default_rng(seed)
        best = self._mend(way)
        for spread in spreads:
            found = self._quickest(best.way, stops_near(best.way, spread, draw, self._wheels))
            best = min(best, self._mend(found), key=costs)
        return best

    def _quickest(self, way: Way, stops: Stops) -> Way:
        """The quickest way by some of the stops, or the one given where it finds none."""
        hops = self._hops(way, stops)
        clear, fits = self._fits(hops, stops)
        some = fits.any(axis=1)
        hops, clear, fits = hops.of(some), clear[some], fits[some]
        took, before = self._race(hops, stops, AVOIDED * (LIKED - clear), fits)
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

    def _fits(self, hops: Hops, stops: Stops) -> tuple[np.ndarray, np.ndarray]:
        """(h,) [m] of clearance of each, and (h, 1 + s) whether it may begin at rest, and at each
        of SPEEDS.
        """
        k, clear = hops.k, np.full(len(hops.k), -1.0)
        n = samples_of(k)
        for m in np.unique(n):
            some = np.flatnonzero(n == m)
            poses = compose(stops.poses[hops.begin[some], None], ends(k[some], int(m)))
            least = self._space.around(poses.reshape(-1, 3), True)
            clear[some] = least.reshape(len(some), -1).min(axis=1)
        final, room, may = hops.end == len(stops.poses) - 1, self._space.room(self._start, True), []
        for begins in (0.0, *SPEEDS):
            fits = clear >= self._space.needed(self._known.width(k, begins), room)
            fits[final] &= self._known.sure(k[final], stops.poses[-1], begins)
            may.append(fits & (self._rolling or not begins))
        return clear, np.column_stack(may)

    def _race(self, hops: Hops, stops: Stops, beside, may) -> tuple[np.ndarray, np.ndarray]:
        """Of each hop the [s] of the quickest way that ends with it, inf without one, and the hop
        before (-1: none). beside (h,): [s] that each costs beside its time; may: of `_fits`.
        """
        k, begin, wheels = hops.k, hops.begin, leaves(hops.k, hops.rolls_on)
        first, steered = steering(k)[0], np.abs(k[:, 1:]).max(axis=1)
        took, speed = np.full(len(k), np.inf), np.zeros(len(k))
        before = np.full(len(k), -1)
        for e in np.argsort(stops.order[begin], kind="stable"):
            if begin[e] == 0:
                into, begins, fits = np.array([-1]), np.zeros(1), may[e, :1]
                since = np.array([stand(first[e] - self._wheels, k[e, 0]) + SINGLE])
            else:
                into = np.flatnonzero((hops.end == begin[e]) & np.isfinite(took))
                if not len(into):
                    continue
                on, begins, turned = hops.rolls_on[into], speed[into], wheels[into] - first[e]
                goes = (np.sign(k[into, 0]) == np.sign(k[e, 0])) & (begins * turned**2 < TURNED)
                goes &= c.stopping(begins) + BEYOND < abs(k[e, 0])
                goes &= begins * turned**2 * CORRECTS < (MOST - steered[e]) * abs(k[e, 0])
                over = np.searchsorted(SPEEDS, begins)  # of SPEEDS; and the one below
                about = may[e, np.minimum(over + 1, len(SPEEDS))] & may[e, np.maximum(over, 1)]
                fits = np.where(on, goes & about, may[e, 0])
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


def led(way: Way, n: int, spread: float, draw) -> tuple[np.ndarray, np.ndarray]:
    """Poses (2 n, 3) from which manoeuvres like those of a way lead to where these end, and those to
    which such lead from where these begin; and their orders.
    """
    i = np.minimum(draw.integers(len(way.k) + LASTS, size=n), len(way.k) - 1)
    times = np.exp(spread * LIKE[0] * draw.normal(size=n))
    k = way.k[i] + spread * LIKE[1] * draw.normal(size=(n, 3)) * [0, 1, 1]
    k[:, 0] *= times
    most = np.array([LONGEST, MOST, MOST])
    k = np.clip(k, -most, most)
    move = ends(k, 1, draw.choice([1.0, UPTO], n))[:, 0]
    before = compose(way.poses[i + 1], offset_from(move, np.zeros(3)))
    order = np.concatenate([i + 1 - times, i + times])
    poses = np.concatenate([before, compose(way.poses[i], move)])
    return poses, np.clip(order, 0.1, len(way.k) - 0.1)


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
        more, orders = led(way, len(rows) // LED, spread, draw)
        poses = np.concatenate([poses, compose(poses[rows], moves), more])
        order = np.concatenate([order, order[rows], orders])
    poses = np.concatenate([poses, way.poses[-1:]])
    order = np.concatenate([order, [len(way.k)]])
    clock = moments(way, wheels)
    return Stops(poses, order, np.interp(order, np.arange(len(clock)), clock))
