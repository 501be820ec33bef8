"""A Jackal crosses the field with its loop: it waits, passes and evades by manoeuvres that are
proved against the tubes of who walks, each until a moment that has a name.

A stop is no safe state where movers see nobody. So each step asks for the cheapest manoeuvre that
is proved until the first of HORIZONS; where there is none, until the next, always later than the
moment at which another takes over; and where there is none either, for the cheapest of all, of
which nothing is claimed but the robot's own tube.
"""

import gc
import time
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np

import parc_jax as pj
from parc_jax.problem.world.movers import Moving
from sims.barn.contact import distance_to_cylinders
from sims.dynabarn import guidance
from sims.dynabarn import movers as walking
from sims.dynabarn.worlds import RADIUS, START, TIMEOUT, World, clearances, reached
from sims.jackal import learn as jackal
from sims.jackal.driven import Driven
from sims.jackal.params import TICK
from sims.rectangle import centre_and_corners, rectangle

HORIZONS = (0.6, 0.3)  # [s] the longest first
EVERY = 2  # intervals of a manoeuvre per obstacle
BEYOND = 0.9  # [m] of who cannot come so near by a horizon nobody is asked: both radii, and a bit
COMMANDS = (19, 15)  # of speed and turning


class Claimed(NamedTuple):
    """What a step claims. until: [s] after its beginning; 0 where nothing is. moving: who may be
    where; of: their numbers in the world.
    """

    until: float
    moving: Moving | None
    of: tuple[int, ...]


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
    v = np.linspace(-jackal.BACKWARD, jackal.SPEED, COMMANDS[0])
    w = np.linspace(-jackal.TURNING, jackal.TURNING, COMMANDS[1])
    made = pj.drive.Loop(
        jackal.model(),
        rectangle(),
        leave=jackal.HELD,
        candidates=np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2),
        thinking=jackal.thinking(),
        effort=pj.drive.Effort(judged=288, looks=4096, room=0.0, deadline=jackal.THINKS),
        clock=lambda: 0.0,  # the robot waits: a busy machine decides nothing
    )
    gc.collect()
    gc.freeze()  # else Python looks through all of JAX now and then, within a step
    return made


def drive(world: World, key, seen: np.random.Generator) -> Drive:
    """Drive from the start to the goal, or until something is touched or the time is out."""
    planner, system = loop(), jackal.robot()
    planner.restart()
    robot = Driven(system, START, key)
    model = walking.model(1 - walking.half_of(world.number))
    steps, claims, plan_s, touched = [], [], [], False
    while robot.time + jackal.HELD <= TIMEOUT and not reached(robot.pose) and not touched:
        now, before = robot.time, len(robot.path) - 1
        begin = time.process_time()
        known = sighted(world, robot.pose[:2], now, seen)
        step, claim = decide(planner, robot, model, known, now)
        plan_s.append(time.process_time() - begin)
        if step.new:
            robot.begin(*step.committed.k[-2:])
            claims.append(claim)
        steps.append(step)
        robot.drive(jackal.HELD)
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


def sighted(
    world: World, here, now: float, seen: np.random.Generator
) -> dict[int, pj.problem.Mover]:
    """Movers near a place (2,) by their numbers, as they are seen; who appeared within two steps is
    taken to have walked on for both.
    """
    times = now - walking.STEP * np.arange(2, -1, -1)
    places = walking.seen(world.movers(times), seen)
    since = world.since(now)
    first = world.first_steps(walking.STEP)
    found = {}
    for i, track in enumerate(np.moveaxis(places, 1, 0)):
        if np.linalg.norm(track[-1] - here) > guidance.FAR:
            continue
        if since[i] < 2 * walking.STEP:
            track = track[-1] + np.arange(-2, 1)[:, None] * first[i]
        found[i] = pj.problem.see_mover(times, track, walking.STEP)
    return found


def decide(planner, robot: Driven, model, known: dict, now: float):
    """The step of a loop, and what it claims."""
    pose, speeds = robot.pose, robot.measured
    guide = guidance.Guidance(pose, speeds, list(known.values()))
    asked = {"at": now, "explain": False}
    for horizon in HORIZONS:
        near = {
            i: one
            for i, one in known.items()
            if np.linalg.norm(one.place - pose[:2])
            < (walking.FASTEST + jackal.SPEED) * horizon + BEYOND
        }
        moving = pj.problem.mover_obstacles(
            model, list(near.values()), RADIUS, planner.model.time, now, until=horizon, every=EVERY
        )
        step = planner.step(
            pose, speeds, moving.obstacles, guide.prefer, spans=moving.spans, **asked
        )
        if step.new:
            return step, Claimed(moving.until, moving, tuple(near))
    step = planner.step(pose, speeds, (), guide.prefer, **asked)
    return step, Claimed(0.0, None, ())


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
    if world.since(at)[int(np.argmin(each))] < since:
        return "a mover appeared"
    if gone_out(world, one, claim, since):
        return "a mover left its tube"
    return "the robot left its tube" if left else "CONTRADICTED"


def gone_out(world: World, one, claim: Claimed, since: float) -> bool:
    """Did any of the movers of a claim leave its tube by so many seconds of it?"""
    times = np.arange(0.0, since + 1e-9, TICK)
    places = world.movers(float(one.begin) + times)
    each = len(claim.moving.spans) // max(1, len(claim.of))
    dt = jackal.model().time.dt
    for n, number in enumerate(claim.of):
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
        "clearance": round(one.clearance, 3),
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
