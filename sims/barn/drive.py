"""One episode: a Jackal drives through a world of the challenge on what its lidar saw."""

import time
from dataclasses import dataclass, field
from itertools import pairwise

import jax
import numpy as np

import parc_jax as pj
from parc_jax.base.keys import as_key
from sims.barn.contact import distance_to_cylinders
from sims.barn.guidance import Guidance
from sims.barn.worlds import NEAR, TIMEOUT, World, metric
from sims.jackal import drift
from sims.jackal.driven import Driven
from sims.lidar import lidar, shapes
from sims.rectangle import centre_and_corners

REACH = (0.65, 0.7, 1.3)  # [m] half width of the square around the robot whose edges are
# obstacles: at rest, more per m/s, and at most: so far leads no manoeuvre
TIGHT, EDGES = 0.02, 100  # [m] that these may be nearer than they are, and how many there may be
KEPT = 4.0  # [m] of free space that is remembered
NEARBY = 0.8  # [m] of it that is remembered while odometry drifts: farther away headings cost more
WIDTH = 0.15  # [m] no obstacle is narrower: a cylinder's diameter
AROUND = 0.12  # [m] that a person saw to be free around the robot before its start
PATIENCE = 40  # cycles at rest without a manoeuvre that end an episode
CLOSER = 0.1  # [m] by which it has to get shorter to count
STALLED = 10  # cycles in which the way to the goal gets no shorter: another way is tried


@dataclass(frozen=True)
class Drive:
    """What came of an episode. reached: the goal, in time. seconds: driven. clearance: [m] least
    distance to a cylinder at any tick, not positive where it was touched. path (n, 3): true poses.
    drifted: cycles in which odometry went wrong by more than is allowed for. drift: [m] most that
    the place of a commitment is allowed to be off against the one before. steps: what the loop did,
    cycle by cycle. poses: of each cycle the true one and the one that the robot knew, (3,) each;
    free: the places that it knew to be free. plan_s, see_s, guide_s: [s] of processor time of each
    cycle's step, of its free space, of its guidance.
    """

    world: int
    reached: bool
    seconds: float
    clearance: float
    path_length: float
    drifted: int
    drift: float
    path: np.ndarray = field(repr=False)
    steps: list = field(repr=False)
    poses: list[tuple[np.ndarray, np.ndarray]] = field(repr=False)
    free: list[pj.world.FreeSpace] = field(repr=False)
    edges: list[int] = field(repr=False)
    plan_s: list[float] = field(repr=False)
    see_s: list[float] = field(repr=False)
    guide_s: list[float] = field(repr=False)

    @property
    def touched(self) -> bool:
        """Was a cylinder touched?"""
        return not self.clearance > 0

    @property
    def reasons(self) -> list[tuple[float, str]]:
        """When [s] there was no new manoeuvre, and why."""
        seconds = np.linspace(0.0, self.seconds, len(self.steps) + 1)[:-1].tolist()
        told = zip(seconds, self.steps, strict=True)
        return [(begin, step.reason) for begin, step in told if not step.new]

    @property
    def metric(self) -> float:
        """Of the challenge: 0.5 at most."""
        return metric(self.reached and not self.touched, self.seconds, self.path_length)


def drive(
    world: World, system, loop: pj.loop.Loop, key, scanner=None, odometry: bool = False
) -> Drive:
    """Drive from the start to the goal with a loop made for this system.

    odometry: the robot knows where it is by dead reckoning alone, which drifts. Its lidar sees from
    where it is, so the drift matters for what it remembers: that shrinks every cycle.
    """
    scanner = lidar() if scanner is None else scanner
    body, scans = jax.random.split(as_key(key))
    rng = np.random.default_rng(np.asarray(jax.random.key_data(scans)))
    loop.restart()
    robot = Driven(system, world.start, body)

    def corners(pose):
        return centre_and_corners(pose[:2], pose[2], *system.size)[1:]

    around = shapes(world.cylinders, world.radius)
    guide = Guidance(world.start, world.goal, NEAR)
    free = pj.world.free_place(corners(robot.pose), AROUND)
    poses, known, allowed, steps = [], [], [], []
    edges, plan_s, see_s, guide_s = [], [], [], []
    at_rest, nearest, since, before = 0, np.inf, 0, robot.measured
    while robot.time < TIMEOUT and at_rest < PATIENCE and not world.reached(robot.pose):
        scan = scanner.scan(robot.pose, around, rng)
        here = robot.pose
        if odometry:
            here = robot.odometry
            scan = scan.taken_from(scanner.pose(here))
        poses.append((robot.pose, here))
        begin = time.process_time()
        if odometry and steps:
            stood = np.array_equal(here, poses[-2][1])
            allowed.append(drift.allowed(before, robot.measured, stood))
            last = np.append(here[:2], poses[-2][1][2])  # it slips along the heading that it had
            free = free.within(here, NEARBY).drifted(last, allowed[-1][:2], allowed[-1].turned)
            free = free.add(pj.world.free_place(corners(here)))
        free, obstacles, why = _look(scan, free, here, robot.measured[0])
        known.append(free)
        saw = time.process_time()
        if not why:
            guide.see(scan.ends[scan.returned], free)
        guide.update()
        guided = time.process_time()
        if why:
            step = loop.go_on(why)
        else:
            step = loop.step(here, robot.measured, obstacles, guide.prefer, robot.time)
        if step.new:
            robot.begin(*step.committed.k[2:])
        at_rest = 0 if step.new else at_rest + 1
        to_go = float(guide.cost(here[:2]))
        nearest, since = (to_go, 0) if to_go < nearest - CLOSER else (nearest, since + 1)
        if since >= STALLED or not step.new:
            guide.give_up(here)
            nearest, since = np.inf, 0
        ended = time.process_time()
        for record, took in (
            (see_s, saw - begin),
            (guide_s, guided - saw),
            (plan_s, ended - guided),
        ):
            record.append(took)
        steps.append(step)
        edges.append(len(obstacles))
        before = robot.measured
        robot.drive(system.moving)
    distance = distance_to_cylinders(robot.path, system.size, world.cylinders, world.radius)
    return Drive(
        world.number,
        bool(world.reached(robot.pose)),
        robot.time,
        float(distance.min()),
        world.path_length,
        beyond(poses, allowed),
        between_commitments(poses, allowed, [step.new for step in steps]),
        robot.path,
        steps,
        poses,
        known,
        edges,
        plan_s,
        see_s,
        guide_s,
    )


def _look(
    scan, free: pj.world.FreeSpace, pose, speed: float
) -> tuple[pj.world.FreeSpace, tuple, str]:
    """What is known to be free after a scan, the obstacles around a robot that fast [m/s], and what
    is wrong with them: nothing, or a sentence.
    """
    still, per_speed, most = REACH
    reach = min(still + per_speed * abs(speed), most)
    try:
        seen = pj.world.seen_from(
            scan.pose,
            scan.angles,
            scan.ranges,
            max_range=scan.max_range,
            noise=scan.noise,
            width=WIDTH,
        )
        free = seen.within(pose, KEPT).add(free.within(pose, KEPT))
        return free, free.near(pose, reach, TIGHT, EDGES).obstacles(), ""
    except pj.InputError as error:
        return free, (), str(error)


def beyond(poses, allowed) -> int:
    """In how many steps between pairs of a true pose and one that is told (3,) does the told one go
    wrong by more than is allowed for it? Without any that is allowed, they are one.
    """
    found = 0
    for ((true, told), (next_true, next_told)), most in zip(pairwise(poses), allowed, strict=False):
        off = drift.relative(told, next_told) - drift.relative(true, next_true)
        found += not most.holds(off)
    return found


def between_commitments(poses, allowed, new) -> float:
    """[m] most that a pose of a commitment is allowed to be off against the one before: what is
    allowed for each cycle between them ([m], [rad]), and what a heading that is off by then makes
    of the way of a cycle. new: was something committed to in each cycle?
    """
    most = moved = turned = 0.0
    for ((_, told), (_, following)), adds, begun in zip(
        pairwise(poses), allowed, new, strict=False
    ):
        if begun:
            moved = turned = 0.0
        way = float(np.linalg.norm(following[:2] - told[:2]))
        moved += max(adds.ahead, adds.aside) + turned * way
        turned += adds.turned
        most = max(most, moved)
    return most
