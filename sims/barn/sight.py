"""What a robot knows of what stands around it: what its lidar saw, or the map."""

from typing import NamedTuple

import numpy as np

import parc_jax as pj
from sims.barn.rectangles import rectangles
from sims.barn.worlds import World
from sims.jackal import drift
from sims.jackal.driven import Driven
from sims.lidar import Lidar, shapes
from sims.rectangle import centre_and_corners

REACH = (0.7, 0.7, 1.35)  # [m] half width of the square around the robot whose edges are
# obstacles: at rest, more per m/s, and at most: so far leads no manoeuvre
TIGHT, EDGES = 0.02, 100  # [m] that these may be nearer than they are, and how many there may be
KEPT = 4.0  # [m] of free space that is remembered
NEARBY = 0.8  # [m] of it that is remembered while odometry drifts: farther away headings cost more
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
    `allowed` for it.
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
        scan = self._scanner.scan(robot.pose, self._stands, self._rng)
        here = robot.pose
        if self._odometry:
            here = robot.odometry
            scan = scan.taken_from(self._scanner.pose(here))
        stands = self._before is not None and np.abs(here - self._before[0]).max() < STANDS
        self._stood = self._stood + 1 if stands else 0
        if self._odometry:
            self._drift(here, speeds)
        self._before = here, speeds
        self._free = self._free.add(pj.problem.free_place(self._corners(here)))
        still, per_speed, most = REACH
        reach = min(still + per_speed * abs(speeds[0]), most)
        try:
            seen = pj.problem.seen_from(
                scan.pose,
                scan.angles,
                scan.ranges,
                max_range=scan.max_range,
                noise=scan.noise,
                width=WIDTH,
            )
            free = seen.within(here, KEPT).add(self._free.within(here, KEPT))
            if self._stood < 2 or free.refuting:  # else it has seen all this, less noise
                self._free = free
            obstacles = free.near(here, reach, TIGHT, EDGES).obstacles()
        except pj.InputError as error:
            return Look(here, self._free, (), np.empty((0, 2)), str(error))
        return Look(here, free, obstacles, scan.ends[scan.returned])

    def _drift(self, here: np.ndarray, speeds: np.ndarray) -> None:
        """What is remembered shrinks, unless this is the first look."""
        if self._before is not None:
            there, slower = self._before
            adds = drift.allowed(slower, speeds, self._stood)
            last = np.append(here[:2], there[2])  # it slips along the heading that it had
            # while it stands, what many cycles add is taken off before the first of them: each time
            # the outline gets more corners
            many = 1 if self._stood < 2 else AT_ONCE * ((self._stood - 2) % AT_ONCE == 0)
            if many:
                ahead, aside, turned = many * np.array(adds)
                self._free = self._free.within(here, NEARBY).drifted(last, (ahead, aside), turned)
            self.allowed.append(adds)

    def _corners(self, pose: np.ndarray) -> np.ndarray:
        return centre_and_corners(pose[:2], pose[2], *self._robot.system.size)[1:]
