"""One episode: a Jackal drives through a world of the challenge on what it knows of it."""

import time
from dataclasses import dataclass, field
from itertools import pairwise

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import as_key
from sims.barn.contact import distance_to_cylinders
from sims.barn.guidance import Guidance
from sims.barn.sight import Mapped, Seen
from sims.barn.turns import Turns
from sims.barn.worlds import NEAR, TIMEOUT, World, metric
from sims.jackal import drift
from sims.jackal.driven import Driven
from sims.lidar import lidar

PATIENCE = 60  # cycles at rest without a manoeuvre that end an episode
SHARE = 4  # of the candidates one of so many is asked in a cycle that follows one without any
LIDAR = {"beams": 720, "max_range": 30.0}  # as the challenge's; what is nearer than 0.1 m touches
SWEEP = 0.01875  # [s] that the lidar of the true robot takes for 270 degrees, at 40 Hz
CLOSER = 0.1  # [m] by which it has to get shorter to count
# A robot slower than SLOW [m/s] whose way leads BEHIND [rad], or at less than CREEPS without any
# manoeuvre, looks where it can turn, for so many cycles, or until its way is AHEAD [rad], with room
SLOW, BEHIND, CREEPS, TURNING, AHEAD = 0.9, 1.8, 0.4, 30, 0.8
STALLED = 15  # cycles in which the way to the goal gets no shorter: another way is tried


@dataclass(frozen=True)
class Drive:
    """What came of an episode. reached: the goal, in time. seconds: driven. clearance: [m] least
    distance to a cylinder at any tick, not positive where it was touched. path (n, 3): true poses.
    drifted: cycles in which odometry went wrong by more than is allowed for. drift: [m] most that
    the place of a commitment is allowed to be off against the one before. allowed: for each cycle.
    steps: what the loop did, cycle by cycle. poses: of each cycle the true one and the one that the
    robot knew, (3,) each; free: the places that it knew to be free. plan_s, see_s, guide_s: [s] of
    processor time of each cycle's step, of its scan and free space, of its guidance.
    """

    world: int
    reached: bool
    seconds: float
    clearance: float
    path_length: float
    drifted: int
    drift: float
    allowed: list[drift.Allowed] = field(repr=False)
    path: np.ndarray = field(repr=False)
    steps: list = field(repr=False)
    poses: list[tuple[np.ndarray, np.ndarray]] = field(repr=False)
    free: list[pj.problem.FreeSpace] = field(repr=False)
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
        """When [s] there was no new manoeuvre, or what was free was refuted, and why."""
        seconds = np.linspace(0.0, self.seconds, len(self.steps) + 1)[:-1].tolist()
        told = zip(seconds, self.steps, self.free, strict=True)
        said = [(at, "; ".join(filter(None, (s.reason, free.said)))) for at, s, free in told]
        return [(at, why) for at, why in said if why]

    @property
    def metric(self) -> float:
        """Of the challenge: 0.5 at most."""
        return metric(self.reached and not self.touched, self.seconds, self.path_length)


def drive(
    world: World,
    system,
    loop: pj.drive.Loop,
    key,
    scanner=None,
    odometry=False,
    known=False,
    explain=False,
    clock=None,
) -> Drive:
    """Drive from the start to the goal with a loop made for this system.

    odometry: as of `Seen`; else the robot truly knows where it is. known: it has the map, and no
    lidar. explain: say what the nearest manoeuvre lacks where none is safe, which takes longer than
    a robot thinks. clock: that of the loop, from which the scan counts as well; None where the
    robot waits.
    """
    body, scans = jax.random.split(as_key(key))
    rng = np.random.default_rng(np.asarray(jax.random.key_data(scans)))
    loop.restart()
    robot = Driven(system, world.start, body)
    scanner = lidar(**LIDAR) if scanner is None else scanner
    sight = Mapped(world, robot) if known else Seen(world, robot, scanner, rng, odometry)
    guide = Guidance(world.start, world.goal, NEAR)
    poses, free, steps = [], [], []
    edges, plan_s, see_s, guide_s = [], [], [], []
    at_rest, nearest, since, turning, begun, drifted = 0, np.inf, 0, 0, 0, 0.0
    corner = float(np.hypot(*system.size)) / 2
    while robot.time < TIMEOUT and at_rest < PATIENCE and not world.reached(robot.pose):
        begin, measured = time.process_time(), None if clock is None else clock()
        look = sight.look()
        saw = time.process_time()
        poses.append((robot.pose, look.here))
        free.append(look.free)
        if not look.why:
            guide.see(look.hits, look.free)
        guide.update(look.here)
        guided = time.process_time()
        off = drifted_since([told for _, told in poses[begun:]], sight.allowed[begun:], corner)
        if look.why:
            step = loop.go_on(look.why, look.free.gone, look.here, robot.time, off)
        else:
            prefer = guide.prefer
            away = guide.away(look.here)
            if abs(robot.measured[0]) < SLOW and away > BEHIND:
                turning = TURNING
            elif turning > 0 and away < AHEAD and guide.roomy(look.here):
                turning = 0
            if turning > 0:
                prefer = Turns(look.here, guide, look.free, system.size).prefer
            prefer = others(prefer, at_rest) if at_rest else prefer
            asked = look.here, robot.measured, look.obstacles, prefer, robot.time
            told = {"measured": measured, "drift": off, "gone": look.free.gone}
            step = loop.step(*asked, **told, explain=explain)
        if step.new:
            robot.begin(*step.committed.k[-2:])
            begun, drifted = len(poses) - 1, max(drifted, off)
        at_rest = 0 if step.new else at_rest + 1
        turning = TURNING if at_rest and abs(robot.measured[0]) < CREEPS else turning - 1
        to_go = float(guide.cost(look.here[:2]))
        nearest, since = (to_go, 0) if to_go < nearest - CLOSER else (nearest, since + 1)
        # who looks where to turn stands between two manoeuvres: not before all were asked
        asked_all = not step.new and (turning <= 0 or at_rest % SHARE == 0)
        if since >= STALLED or asked_all:
            guide.give_up(look.here)
            nearest, since = np.inf, 0
        ended = time.process_time()
        for record, took in (
            (see_s, saw - begin),
            (guide_s, guided - saw),
            (plan_s, ended - guided),
        ):
            record.append(took)
        steps.append(step)
        edges.append(len(look.obstacles))
        robot.drive(system.moving)
    distance = distance_to_cylinders(robot.path, system.size, world.cylinders, world.radius)
    return Drive(
        world.number,
        bool(world.reached(robot.pose)),
        robot.time,
        float(distance.min()),
        world.path_length,
        beyond(poses, sight.allowed),
        drifted,
        sight.allowed,
        robot.path,
        steps,
        poses,
        free,
        edges,
        plan_s,
        see_s,
        guide_s,
    )


def others(prefer, cycle: int):
    """A preference that leaves out all but one of SHARE candidates, other ones each cycle: where
    none of those that were judged is safe, those that were not are asked next.
    """

    def preferred(outlook) -> np.ndarray:
        cost = np.asarray(prefer(outlook))
        return np.where((np.arange(len(cost)) + cycle) % SHARE == 0, cost, np.inf)

    return preferred


def beyond(poses, allowed) -> int:
    """In how many steps between pairs of a true pose and one that is told (3,) does the told one go
    wrong by more than is allowed for it? Without any that is allowed, they are one.
    """
    found = 0
    for ((true, told), (next_true, next_told)), most in zip(pairwise(poses), allowed, strict=False):
        off = drift.relative(told, next_told) - drift.relative(true, next_true)
        found += not most.holds(off)
    return found


def drifted_since(told, allowed, corner: float) -> float:
    """[m] by which any point of the robot may be off at the last of the poses that are told (n, 3)
    against the first: what is allowed for each cycle between them, and what a heading that is off
    by then makes of the way of a cycle and of a corner, so far from the middle.
    """
    moved = turned = 0.0
    for (one, following), adds in zip(pairwise(told), allowed, strict=False):
        way = float(np.linalg.norm(following[:2] - one[:2]))
        moved += max(adds.ahead, adds.aside) + turned * way
        turned += adds.turned
    return moved + turned * corner
