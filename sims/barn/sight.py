"""What a robot knows of what stands around it: what its lidar saw, or the map."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import parc_jax as pj
from parc_jax.problem.world.free_space import shrunk
from sims.barn.rectangles import rectangles
from sims.barn.worlds import World
from sims.jackal import drift
from sims.jackal import params as c
from sims.jackal.driven import Driven
from sims.lidar import Lidar, Scan, shapes
from sims.rectangle import centre_and_corners
from sims.sweep import swept

REACH = (0.7, 0.7, 1.35)  # [m] half width of the square around the robot whose edges are
# obstacles: at rest, more per m/s, and at most: so far leads no manoeuvre
TIGHT, EDGES = 0.02, 100  # [m] that these may be nearer than they are, and how many there may be
KEPT = 4.0  # [m] of free space that is remembered
NEARBY = 0.8  # [m] of it that is remembered while odometry drifts: farther away headings cost more
MANY, FINE = 1000, 1e-3  # corners, more of which take long, and [m] that it may lose to save some
AT_ONCE = 20  # cycles of a robot that stands
STANDS = 1e-5  # [m], [rad] a robot that moves less in a cycle has stood
WIDTH = 0.15  # [m] no obstacle is narrower: a cylinder's diameter
AROUND = 0.12  # [m] that a person saw to be free around the robot before its start
FIELD = 15.0  # [m] of the map around the start that are shown as free, where nothing stands


class Look(NamedTuple):
    """What is known in one cycle. here (3,): where the robot holds itself to be; free: places that
    it knows to be free; obstacles: of the next manoeuvre; hits (n, 2) [m]: where something stands,
    for guidance; why: what is wrong with all this, nothing or a sentence.
    """

    here: np.ndarray
    free: pj.problem.FreeSpace
    obstacles: tuple
    hits: np.ndarray
    why: str = ""


class Mapped:
    """The map is known, and where the robot is: all cells with a cylinder are obstacles, wherever
    the robot is, and nothing is left out.
    """

    def __init__(self, world: World, robot: Driven):
        import shapely

        sides = rectangles(world.occupied)
        cells, field = shapely.box(*sides.T), shapely.Point(world.start[:2]).buffer(FIELD)
        self._robot = robot
        self._free = pj.problem.FreeSpace(field.difference(shapely.union_all(cells)))
        self._obstacles = tuple(pj.box(row[:2], row[2:]) for row in sides)
        self._hits = shapely.get_coordinates(shapely.segmentize(cells, world.radius))
        self.allowed: list[drift.Allowed] = []

    def look(self) -> Look:
        """Always the same."""
        return Look(self._robot.pose, self._free, self._obstacles, self._hits)


class Seen:
    """What a lidar saw since the start, and a person before it.

    odometry: the robot knows where it is by dead reckoning alone, which drifts. Its lidar sees from
    where it is, so the drift matters for what it remembers: that shrinks every cycle, by what is
    `allowed` for it. A lidar that turns sees with each beam from where it is then; what it saw is
    told as a pilot tells it, from the middle of its sweep, the motion as uncertainty.
    """

    def __init__(
        self, world: World, robot: Driven, scanner: Lidar, rng: np.random.Generator, odometry: bool
    ):
        self._robot, self._scanner, self._rng = robot, scanner, rng
        self._stands = shapes(world.cylinders, world.radius)
        self._odometry = odometry
        self._free = pj.problem.free_place(self._corners(robot.pose), AROUND)
        self._before: tuple[np.ndarray, np.ndarray] | None = None
        self._stood = 0  # cycles for which it has stood
        self.allowed: list[drift.Allowed] = []

    def look(self) -> Look:
        """A scan, added to what is remembered."""
        robot, speeds = self._robot, self._robot.measured
        here = robot.odometry if self._odometry else robot.pose
        scan, errors = self._scan()
        stands = self._before is not None and np.abs(here - self._before[0]).max() < STANDS
        self._stood = self._stood + 1 if stands else 0
        if self._odometry:
            self._drift(here, speeds)
        self._before = here, speeds
        self._free = self._free.add(pj.problem.free_place(self._corners(here)))
        still, per_speed, most = REACH
        reach = min(still + per_speed * abs(speeds[0]), most)
        try:
            x, y, heading = scan.pose
            seen = pj.problem.seen_from(
                (x, y, math.remainder(heading, 2 * math.pi)),
                scan.angles,
                scan.ranges,
                max_range=scan.max_range,
                width=WIDTH,
                **errors,
            )
            free = self._free.within(here, KEPT).add(seen.within(here, KEPT))
            if self._stood < 2 or free.refuting:  # else it has seen all this, less noise
                self._free = free
            obstacles = free.near(here, reach, TIGHT, EDGES).obstacles()
        except pj.InputError as error:
            return Look(here, self._free, (), np.empty((0, 2)), str(error))
        return Look(here, free, obstacles, scan.ends[scan.returned])

    def _scan(self) -> tuple[Scan, dict]:
        """A scan that ends now, held to be taken from where the robot takes itself to be; its
        errors, as of `seen_from`.
        """
        robot, sensor = self._robot, self._scanner
        known = robot.reckoned if self._odometry else robot.path
        if not sensor.sweep:
            scan = sensor.scan(robot.pose, self._stands, self._rng)
            return scan.taken_from(sensor.pose(known[-1])), {"noise": scan.noise}
        ticks = c.TICK * np.arange(1 - len(known), 1)
        poses = [np.interp(sensor.moments, ticks, one) for one in robot.path.T]
        scan = sensor.scan(np.stack(poses, axis=1), self._stands, self._rng)
        n = math.ceil(sensor.sweep / c.TICK)
        arm, beam = float(np.hypot(*sensor.mount[:2])), sensor.sweep / (sensor.beams - 1)
        told = ticks[-n - 1 :] + sensor.sweep, known[-n - 1 :]
        of_tick = self._odometry * np.array(c.DRIFT_TICK)
        way_off = of_tick[0] + of_tick[1] * arm, of_tick[1]
        one = swept(*told, sensor.sweep, beam, arm, robot.system.ramp, way_off)
        moved, turned = n * of_tick
        off = one.moved + moved + turned * arm, one.turned + turned
        noise = scan.noise + one.between[0]
        errors = {"noise": noise, "angle_error": one.between[1], "uncertainty": off}
        return scan.taken_from(sensor.pose(one.pose)), errors

    def _drift(self, here: np.ndarray, speeds: np.ndarray) -> None:
        """What is remembered shrinks, unless this is the first look."""
        import shapely

        if self._before is not None:
            there, slower = self._before
            adds = drift.allowed(slower, speeds, drift.slipped(self._robot), self._stood)
            last = np.append(here[:2], there[2])  # it slips along the heading that it had
            # while it stands, what many cycles add is taken off before the first of them: each time
            # the outline gets more corners
            many = 1 if self._stood < 2 else AT_ONCE * ((self._stood - 2) % AT_ONCE == 0)
            if many:
                ahead, aside, turned = many * np.array(adds)
                free = self._free.within(here, NEARBY)
                if (corners := shapely.get_num_coordinates(free.region)) > MANY:
                    fewer = shrunk(free.region, 0.0, FINE)
                    if 0 < shapely.get_num_coordinates(fewer) < corners:
                        free = replace(free, region=fewer)
                self._free = free.drifted(last, (ahead, aside), turned)
            self.allowed.append(adds)

    def _corners(self, pose: np.ndarray) -> np.ndarray:
        return centre_and_corners(pose[:2], pose[2], *self._robot.system.size)[1:]
