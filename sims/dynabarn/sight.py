"""What the robot knows of who walks: all places, or what its lidar sees of cylinders.

A run of returns that one cylinder explains is one: its middle is somewhere among all middles from
which every range is within its error, and the fit names how far off it may be. Nobody who was never
seen is known.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

import parc_jax as pj
from sims.barn.drive import LIDAR
from sims.dynabarn import movers as walking
from sims.dynabarn.memory import Memory, Way
from sims.dynabarn.worlds import RADIUS, World, half_of, numbers, world
from sims.jackal.driven import Driven
from sims.jackal.params import TICK
from sims.lidar import Lidar, Scan, lidar, shapes

FAR = 6.0  # [m] who is farther away is left out
CELL = 0.01  # [rad] of directions in which the middle is sought from the first return
SIDES = np.arange(-np.pi / 2 - 0.1, np.pi / 2 + 0.1, CELL)  # a return is off, so a bit beyond
SURE = 0.045  # [m] a place that may be farther off is no part of a track
FORGOTTEN = 1.0  # [s] after which who is out of sight is forgotten, but by guidance
BY_NOW = 0.4  # [m] from where somebody is expected, who is seen there is the one
UNSEEN = 6.0  # [m] of way that each [m] costs to where the lidar does not look
LOOSE = 0.02  # [m] besides their errors, by which places may jump within a greatest speed


class Sighting(NamedTuple):
    """A mover as known: at [s] it was within off [m] of place (2,), with velocity (2,) [m/s], zeros
    where none is known. mover: for its learned tube; None for who may go anywhere. again: as of
    `Memory`, where it is remembered.
    """

    at: float
    place: np.ndarray
    velocity: np.ndarray
    off: float
    mover: pj.problem.Mover | None
    again: tuple[np.ndarray, np.ndarray] | None = None


def straight_on(one: Sighting, now: float) -> np.ndarray:
    """Place (2,) of a mover that went straight on since it was seen."""
    return one.place + (now - one.at) * one.velocity


class Known:
    """All places are known, as good as exactly; who appeared within two steps is taken to have
    walked on for both. unseen: [m] of way that each [m] to behind the robot costs. hidden: nobody.
    """

    unseen, hidden = 0.0, ()

    def __init__(self, world: World, rng: np.random.Generator):
        self.model = walking.model(1 - half_of(world.number))
        self._world, self._rng, self._looked = world, rng, -np.inf
        self._memory = Memory(1 - half_of(world.number))
        self._ways = [self._memory.begin() for _ in world.tracks]

    def look(self, robot: Driven) -> list[Sighting]:
        """Movers near the robot."""
        now, step = robot.time, walking.STEP
        times = now - step * np.arange(2, -1, -1)
        seen = walking.seen(self._world.movers(times), self._rng, walking.SEEN)
        since, first = self._world.since(now), self._world.first_steps(step)
        found, new = [], times > self._looked + 1e-9
        self._looked = now
        for i, track in enumerate(np.moveaxis(seen, 1, 0)):
            self._ways[i].add(times[new], track[new])
            again = self._memory.again(self._ways[i])
            places = track[-1:] if again is None else _soon(again, now)
            if np.linalg.norm(places - robot.pose[:2], axis=1).min() > FAR:
                continue
            if since[i] < 2 * step:
                track = track[-1] + np.arange(-2, 1)[:, None] * first[i]
            found.append(sighting(times, track, walking.SEEN)._replace(again=again))
        return found


def _soon(again: tuple[np.ndarray, np.ndarray], now: float) -> np.ndarray:
    """Places (n, 2) of who is remembered, now and in the time that is predicted: there it may
    appear.
    """
    places = np.interp(now + np.linspace(0.0, walking.AHEAD, 5), *again)
    return np.stack([places.real, places.imag], axis=1)


def sighting(times, places: np.ndarray, off: float) -> Sighting:
    """Of the last three places (3, 2), a step apart."""
    mover = pj.problem.see_mover(times, places, walking.STEP)
    velocity = (places[-1] - places[-2]) / walking.STEP
    return Sighting(float(times[-1]), places[-1], velocity, off, mover)


class Fit(NamedTuple):
    """A cylinder in a scan: its middle is within off [m] of place (2,)."""

    place: np.ndarray
    off: float


def fits(scan: Scan) -> list[Fit]:
    """Cylinders of a scan, from the first beam on: a run ends where no cylinder explains it."""
    found, first, ends = [], 0, scan.ends
    stop = np.flatnonzero(~scan.returned)
    while first < len(ends):
        if not scan.returned[first]:
            first += 1
            continue
        last = stop[np.searchsorted(stop, first)] if (stop > first).any() else len(ends)
        along = scan.pose[2] + scan.angles[first] + SIDES
        middles = ends[first] + RADIUS * np.stack([np.cos(along), np.sin(along)], axis=1)
        away = np.linalg.norm(ends[None, first:last] - middles[:, None], axis=-1)
        # a middle is in a cell of SIDES, and the first return is off as well
        cell = scan.noise + (RADIUS + scan.noise) * CELL / 2
        explains = np.logical_and.accumulate(np.abs(away - RADIUS) <= scan.noise + cell, axis=1)
        run = int(explains.any(axis=0).sum())
        found.append(_fit(ends[first : first + run], middles[explains[:, run - 1]], cell))
        first += run
    return found


def _fit(points: np.ndarray, middles: np.ndarray, cell: float) -> Fit:
    """The cylinder nearest to points (n, 2), from the mean of its possible middles (m, 2) on."""
    place = middles.mean(axis=0)
    for _ in range(4):
        away = points - place
        far = np.linalg.norm(away, axis=1)
        place = place + np.linalg.lstsq(away / far[:, None], far - RADIUS, rcond=0.05)[0]
    off = np.linalg.norm(middles - place, axis=1).max()
    return Fit(place, float(off) + cell)


@dataclass(eq=False)
class Track:
    """Who was seen: times and fits of scans in a row, the last one last."""

    times: list[float] = field(default_factory=list)
    fits: list[Fit] = field(default_factory=list)
    way: Way = field(default_factory=Way)

    def add(self, now: float, fit: Fit) -> None:
        """One more; after a gap a new row begins."""
        if self.times and now - self.times[-1] > 1.5 * walking.STEP:
            self.times, self.fits = [], []
        self.times, self.fits = [*self.times, now][-3:], [*self.fits, fit][-3:]
        if fit.off <= SURE:
            self.way.add([now], [fit.place])

    @property
    def sighting(self) -> Sighting:
        """What is known of it: too short a track, or a place of which too little was seen, may go
        anywhere.
        """
        places = np.array([fit.place for fit in self.fits])
        off = self.fits[-1].off
        if len(places) == 3 and max(fit.off for fit in self.fits) <= SURE:
            seen = sighting(self.times, places, off)
            if seen.mover.k[0] <= walking.most(walking.SCANNED):
                return seen
        velocity = np.zeros(2)
        if len(places) > 1 and max(fit.off for fit in self.fits[-2:]) <= 2 * SURE:
            velocity = (places[-1] - places[-2]) / walking.STEP
        return Sighting(self.times[-1], places[-1], velocity, off, None)

    def reach(self, now: float) -> float:
        """[m] from its last place within which its middle is."""
        return self.fits[-1].off + walking.FASTEST * (now - self.times[-1])


class Seen:
    """What the Jackal's lidar saw, a scan a step, from where it truly is; who went out of sight is
    remembered for a while, and for guidance while its way is known.
    """

    unseen = UNSEEN

    def __init__(self, world: World, rng: np.random.Generator, scanner: Lidar | None = None):
        self.model = walking.model(1 - half_of(world.number), walking.SCANNED)
        self._world, self._rng = world, rng
        self._scanner = lidar(**LIDAR) if scanner is None else scanner
        self._scanned, self.tracks = 0, list[Track]()
        self._memory = Memory(1 - half_of(world.number))
        self._hidden, self._now = list[tuple[np.ndarray, np.ndarray]](), 0.0

    @property
    def hidden(self) -> list[Sighting]:
        """Who is out of sight on a way that is known: expected, no part of a claim."""
        now = self._now
        return [Sighting(now, _at(way, now), np.zeros(2), 0.0, None, way) for way in self._hidden]

    def look(self, robot: Driven) -> list[Sighting]:
        """Scans since the last look; movers near the robot."""
        path, step = robot.path, round(walking.STEP / TICK)
        for tick in range(self._scanned, len(path), step):
            self._scan(path[tick], TICK * tick)
            self._scanned = tick + step
        self._now, here = robot.time, robot.pose[:2]
        near = [t for t in self.tracks if np.linalg.norm(t.fits[-1].place - here) <= FAR]
        return [t.sighting._replace(again=self._memory.again(t.way)) for t in near]

    def _scan(self, pose: np.ndarray, now: float) -> None:
        stands = shapes(self._world.movers(now), RADIUS)
        scan = self._scanner.scan(pose, stands, self._rng)
        found, tracks = fits(scan), self.tracks
        cost = np.full((len(found), len(tracks)), np.inf)
        for j, track in enumerate(tracks):
            last, ahead = track.fits[-1].place, straight_on(track.sighting, now)
            for i, fit in enumerate(found):
                if np.linalg.norm(fit.place - last) <= track.reach(now) + fit.off + LOOSE:
                    cost[i, j] = np.linalg.norm(fit.place - ahead)
        taken = set()
        for i, j in zip(
            *linear_sum_assignment(np.where(np.isfinite(cost), cost, 1e6)), strict=True
        ):
            if np.isfinite(cost[i, j]):
                tracks[j].add(now, found[i])
                taken.add(i)
        kept = [
            track.times[-1] == now
            or (now - track.times[-1] <= FORGOTTEN and not sees_all(scan, track, now))
            for track in tracks
        ]
        self.tracks = [track for track, stays in zip(tracks, kept, strict=True) if stays]
        gone = [track.way for track, stays in zip(tracks, kept, strict=True) if not stays]
        self._hide(scan, [fit.place for fit in found], gone, now)
        for i, fit in enumerate(found):
            if i not in taken:
                self.tracks.append(Track(way=self._memory.begin()))
                self.tracks[-1].add(now, fit)

    def _hide(self, scan: Scan, seen: list[np.ndarray], gone: list[Way], now: float) -> None:
        """Remember who went out of sight on a known way, until somebody is seen, or nobody can be,
        or somebody else is expected, where it is expected.
        """
        hidden, there = [], list(seen)
        for way in [*self._hidden, *filter(None, map(self._memory.again, gone))]:
            place = _at(way, now)
            if sees(scan, place) or any(np.linalg.norm(place - one) < BY_NOW for one in there):
                continue
            hidden.append(way)
            there.append(place)
        self._hidden = hidden


def _at(way: tuple[np.ndarray, np.ndarray], now: float) -> np.ndarray:
    """Place (2,) of who is remembered."""
    place = np.interp(now, *way)
    return np.array([place.real, place.imag])


def errors() -> tuple[np.ndarray, np.ndarray]:
    """[m] of fits that tracks are made of, in 25 scans of every fourth world: along x or y, the
    greater, and in all beyond what the fit allows.
    """
    rng, scanner, off = np.random.default_rng(0), lidar(**LIDAR), []
    for each in map(world, numbers()[::4]):
        for now in rng.uniform(0, 20, 25):
            places = each.movers(now)
            here = places.mean(axis=0) + rng.uniform(-FAR, FAR, 2)
            scan = scanner.scan(np.append(here, rng.uniform(-3, 3)), shapes(places, RADIUS), rng)
            for fit in (one for one in fits(scan) if one.off <= SURE):
                away = np.abs(places - fit.place)
                away = away[np.linalg.norm(away, axis=1).argmin()]
                off.append((away.max(), np.linalg.norm(away) - fit.off))
    return np.transpose(off)


def sees(scan: Scan, place: np.ndarray) -> bool:
    """Does a beam go beyond a place (2,), where so nobody is?"""
    away = place - scan.pose[:2]
    at = np.arctan2(away[1], away[0]) - scan.pose[2]
    at = np.arctan2(np.sin(at), np.cos(at))
    if abs(at) > scan.angles[-1]:
        return False
    beam = np.argmin(np.abs(scan.angles - at))
    return bool(scan.ranges[beam] > np.linalg.norm(away))


def sees_all(scan: Scan, track: Track, now: float) -> bool:
    """Would a scan have seen the mover wherever it may be by now? Then it is gone."""
    away, reach = track.fits[-1].place - scan.pose[:2], track.reach(now) + RADIUS
    far = float(np.linalg.norm(away))
    if far <= reach or far > scan.max_range - reach:
        return far > scan.max_range - reach
    middle = np.arctan2(away[1], away[0]) - scan.pose[2]
    off = np.abs(np.arctan2(np.sin(scan.angles - middle), np.cos(scan.angles - middle)))
    half = np.arcsin(reach / far)
    edge = np.abs(np.arctan2(np.sin(middle), np.cos(middle))) + half
    return edge < scan.angles[-1] and bool((scan.ranges[off <= half] > far + reach).all())


if __name__ == "__main__":
    off, beyond = errors()
    print(
        f"of {len(off):,} fits {100 * (off <= walking.SCANNED).mean():.2f} % are within "
        f"{walking.SCANNED:g} m along x and y, 99.8 % within {np.quantile(off, 0.998):.3f} m; "
        f"{(beyond > 0).sum()} are farther off than they tell"
    )
