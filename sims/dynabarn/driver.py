"""A Jackal crosses the field with its loop: it waits, passes and evades by manoeuvres that are
proved against the tubes of who walks, each until a moment that has a name.

A stop is no safe state where movers see nobody. So each step asks for the cheapest manoeuvre that
is proved until the first of HORIZONS; where there is none, until the next, always later than the
moment at which another takes over; and where there is none either, for the cheapest of all, of
which nothing is claimed but the robot's own tube.
"""

import gc
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np

import parc_jax as pj
from parc_jax.problem.world.movers import Moving
from sims.barn.contact import distance_to_cylinders
from sims.dynabarn import guidance
from sims.dynabarn import movers as walking
from sims.dynabarn import robot as jackal
from sims.dynabarn.sight import Known, Seen, Sighting
from sims.dynabarn.worlds import RADIUS, START, TIMEOUT, World, clearances, reached
from sims.jackal.driven import Driven
from sims.jackal.learn import HELD, THINKS, thinking
from sims.jackal.params import TICK
from sims.rectangle import centre_and_corners, rectangle

HORIZONS = (0.6, 0.3)  # [s] the longest first
NORMALS = np.array([(np.cos(a), np.sin(a)) for a in np.pi / 4 * np.arange(8)])  # of a loose mover
EVERY = 2  # intervals of a manoeuvre per obstacle
BEYOND = 0.9  # [m] of who cannot come so near by a horizon nobody is asked: both radii, and a bit
COMMANDS = (19, 15)  # of speed and turning


class Claimed(NamedTuple):
    """What a step claims. until: [s] after its beginning; 0 where nothing is. moving: who may be
    where; of: as they were seen.
    """

    until: float
    moving: Moving | None
    of: tuple[Sighting, ...]


@dataclass(frozen=True)
class Drive:
    """What came of an episode. cause: of a contact, or empty. claims: of each commitment."""

    world: World
    reached: bool
    seconds: float
    clearance: float
    cause: str
    left: bool
    path: np.ndarray = field(repr=False)
    steps: list = field(repr=False)
    claims: list[Claimed] = field(repr=False)
    plan_s: list[float] = field(repr=False)

    @property
    def touched(self) -> bool:
        """Was anybody touched?"""
        return not self.clearance > 0


@cache
def loop() -> pj.drive.Loop:
    """The loop, made once in a process."""
    v = np.linspace(-jackal.SPEED, jackal.SPEED, COMMANDS[0])
    w = np.linspace(-jackal.TURNING, jackal.TURNING, COMMANDS[1])
    made = pj.drive.Loop(
        jackal.model(),
        rectangle(),
        leave=HELD,
        candidates=np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2),
        thinking=thinking(),
        effort=pj.drive.Effort(judged=288, looks=4096, room=0.0, deadline=THINKS),
        clock=lambda: 0.0,  # the robot waits: a busy machine decides nothing
    )
    gc.collect()
    gc.freeze()  # else Python looks through all of JAX now and then, within a step
    return made


def drive(world: World, key, sight: Known | Seen) -> Drive:
    """Drive from the start to the goal, or until something is touched or the time is out."""
    planner, system = loop(), jackal.robot()
    planner.restart()
    robot = Driven(system, START, key)
    steps, claims, plan_s, touched = [], [], [], False
    while robot.time + HELD <= TIMEOUT and not reached(robot.pose) and not touched:
        before = len(robot.path) - 1
        begin = time.process_time()
        known = sight.look(robot)
        step, claim = decide(planner, robot, sight.model, known, sight.hidden, sight.unseen)
        plan_s.append(time.process_time() - begin)
        if step.new:
            robot.begin(*step.committed.k[-2:])
            claims.append(claim)
        steps.append(step)
        robot.drive(HELD)
        touched = bool(clearances(world, robot.path, system.size, before).min() <= 0)
    path = robot.path
    distance = clearances(world, path, system.size)
    begun = [step.committed for step in steps if step.new]
    points = centre_and_corners(path[:, :2], path[:, 2], *system.size)
    left = bool(begun) and pj.drive.left_tube(begun, points, path[:, 2])
    cause = "" if distance.min() > 0 else cause_of(world, path, begun, claims, distance, left)
    arrived = reached(robot.pose) and not cause
    seconds, nearest = robot.time, float(distance.min())
    return Drive(world, arrived, seconds, nearest, cause, left, path, steps, claims, plan_s)


def decide(
    planner,
    robot: Driven,
    model,
    known: list[Sighting],
    hidden: Sequence[Sighting] = (),
    unseen: float = 0.0,
):
    """The step of a loop, and what it claims. hidden, unseen: as of the sight."""
    pose, speeds, now = robot.pose, robot.measured, robot.time
    guide = guidance.Guidance(pose, speeds, [*known, *hidden], now, unseen)
    asked = {"at": now, "explain": False}
    for horizon in HORIZONS:
        near = [one for one in known if comes_near(one, pose[:2], now, horizon)]
        moving, of = obstacles(model, near, planner.model.time, now, horizon)
        step = planner.step(
            pose, speeds, moving.obstacles, guide.prefer, spans=moving.spans, **asked
        )
        if step.new:
            return step, Claimed(moving.until, moving, of)
    step = planner.step(pose, speeds, (), guide.prefer, **asked)
    return step, Claimed(0.0, None, ())


def comes_near(one: Sighting, here, now: float, horizon: float) -> bool:
    """May a mover come so near by a horizon that it matters?"""
    fastest = walking.FASTEST * (now - one.at + horizon) + jackal.SPEED * horizon
    return bool(np.linalg.norm(one.place - here) < fastest + one.off + BEYOND)


def obstacles(
    model, near: list[Sighting], grid, now: float, horizon: float
) -> tuple[Moving, tuple[Sighting, ...]]:
    """Where movers may be until a horizon, and in which order: by their learned tubes, or anywhere
    at FASTEST where there is no track or it is too old.
    """
    old = model.time.t_f - horizon + 1e-6
    tracked = [one.mover is not None and now - one.at <= old for one in near]
    tubes = [one for one, is_tracked in zip(near, tracked, strict=True) if is_tracked]
    loose = [one for one, is_tracked in zip(near, tracked, strict=True) if not is_tracked]
    movers = [one.mover for one in tubes]
    told = pj.problem.mover_obstacles(model, movers, RADIUS, grid, now, until=horizon, every=EVERY)
    parts, spans = list(told.obstacles), list(told.spans)
    during = (0, round(told.until / grid.dt) - 1)
    for one in loose:
        reach = RADIUS + one.off + walking.FASTEST * (now - one.at)
        body = pj.hpolytope(NORMALS, NORMALS @ one.place + reach)
        asked = {"at": now, "every": EVERY, "off_by": walking.FASTEST}
        places, when = pj.problem.moving(body, [0.0, 0.0], during, grid.dt, **asked)
        parts, spans = parts + places, spans + when
    said = told.said
    if loose:
        said += f" Besides against {len(loose)} that may go anywhere at {walking.FASTEST:g} m/s."
    return Moving(parts, spans, told.until, said), (*tubes, *loose)


def cause_of(world: World, path, begun, claims, distance: np.ndarray, left: bool) -> str:
    """Why something was touched on a path (n, 3), in the first tick in which it was."""
    tick = int(np.argmax(distance <= 0))
    at = TICK * tick
    last = [i for i, one in enumerate(begun) if float(one.begin) <= at + 1e-9]
    if not last:
        return "before the first manoeuvre"
    one, claim = begun[last[-1]], claims[last[-1]]
    since = at - float(one.begin)
    if not claim.until:
        return "no manoeuvre was proved"
    if since > claim.until + 1e-9:
        return "later than the manoeuvre was proved for"
    pose, here = path[tick], world.movers(at)
    size = jackal.robot().size
    each = [distance_to_cylinders(pose, size, mover[None], RADIUS)[0] for mover in here]
    who = int(np.argmin(each))
    if world.since(at)[who] < since:
        return "a mover appeared"
    if who not in map(world.nearest, claim.of):
        return "a mover was not seen"
    if gone_out(world, one, claim, since):
        return "a mover left its tube"
    return "the robot left its tube" if left else "CONTRADICTED"


def gone_out(world: World, one, claim: Claimed, since: float) -> bool:
    """Did any of the movers of a claim leave its tube by so many seconds of it?"""
    times = np.arange(0.0, since + 1e-9, TICK)
    places = world.movers(float(one.begin) + times)
    each = len(claim.moving.spans) // max(1, len(claim.of))
    dt = jackal.model().time.dt
    for n, seen in enumerate(claim.of):
        number = world.nearest(seen)
        parts = slice(n * each, (n + 1) * each)
        for body, (first, last) in zip(
            claim.moving.obstacles[parts], claim.moving.spans[parts], strict=True
        ):
            during = (times >= first * dt - 1e-9) & (times <= (last + 1) * dt + 1e-9)
            reach = places[during, number] @ body.A.T + RADIUS * np.linalg.norm(body.A, axis=1)
            if not (reach <= body.b).all():
                return True
    return False


def told_of(one: Drive) -> dict:
    """What is kept of an episode: plan_ms of processor time, median, 95 % and most; claimed: how
    many commitments until which horizon; gone: of those with one, in how many a mover left its
    tube before the next; said: of the last commitment with a claim.
    """
    begun = [step.committed for step in one.steps if step.new]
    ends = [float(later.begin) for later in begun[1:]] + [one.seconds]
    gone = 0
    for first, claim, end in zip(begun, one.claims, ends, strict=True):
        if claim.until:
            gone += gone_out(one.world, first, claim, min(end - float(first.begin), claim.until))
    until = [f"{claim.until:.1f}" for claim in one.claims]
    with_claim = [claim for claim in one.claims if claim.until]
    return {
        "reached": one.reached,
        "seconds": round(one.seconds, 2),
        "clearance": float(one.clearance),
        "cause": one.cause,
        "left": one.left,
        "claimed": {name: until.count(name) for name in sorted(set(until))},
        "gone": gone,
        "plan_ms": [round(1e3 * float(q), 1) for q in np.quantile(one.plan_s, [0.5, 0.95, 1.0])],
        "said": with_claim[-1].moving.said if with_claim else "",
    }


def save(one: Drive, path) -> None:
    """A file of the episode, which `parc-jax check` verifies."""
    pj.drive.save_episode(path, [step.committed for step in one.steps if step.new])
