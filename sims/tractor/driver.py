"""The tractor with its loop, made once in each process: it drives yards, an episode a call."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import as_key
from parc_jax.problem.body import body_of, hull
from sims.barn.driver import content_of
from sims.tractor import params as c
from sims.tractor.gates import END, World, distance
from sims.tractor.system import TRACTOR, TRAILER
from sims.tractor.yard import State, Yard, places, yard

LEAVE = 0.4  # [s] after which a manoeuvre is left for the next
NEAR = 12.0  # [m] from the rear axle: walls that are farther are reached by no manoeuvre
AHEAD, HEADED = 5.0, 2.0  # [m] of the way that are looked ahead, from how far ahead of the rest
DONE = 2.0  # [m] before the end
PATIENCE, TIMEOUT = 20, 120.0  # cycles at rest without a manoeuvre, and [s], that end an episode


class Driven:
    """One tractor, at rest at a pose (3,): `begin` a manoeuvre, `drive`, again and again."""

    def __init__(self, system: Yard, pose, key):
        self._system, self._key, self._begun = system, as_key(key), 0
        state = system.start_state(self._next_key())
        state.qpos[:, :3] = pose
        self._along, self._at = State(*(part[:, None] for part in state)), 0
        self.path = [state.qpos[0]]

    @property
    def time(self) -> float:
        """[s] driven so far."""
        return c.STEP * (len(self.path) - 1)

    @property
    def pose(self) -> np.ndarray:
        """(3,) where its rear axle truly is, and its heading."""
        return self._now.qpos[0, :3]

    @property
    def measured(self) -> np.ndarray:
        """(3,) speed [m/s], steering and hitch [rad]."""
        return self._system.measured(self._now)[0]

    def begin(self, k: np.ndarray) -> None:
        """From now on the manoeuvre k (5,)."""
        key = self._next_key()
        self._along = self._system.rollout_from_state(key, self._now, k[None])[1]
        self._at = 0

    def drive(self, seconds: float) -> None:
        """Go on for so long; at the end of its manoeuvre it rests."""
        for _ in range(round(seconds / c.STEP)):
            self._at = min(self._at + 1, self._along.qpos.shape[1] - 1)
            self.path.append(self._now.qpos[0])

    @property
    def _now(self) -> State:
        return State(*(part[:, self._at] for part in self._along))

    def _next_key(self) -> np.ndarray:
        self._begun += 1
        return np.asarray(jax.random.key_data(jax.random.fold_in(self._key, self._begun)))[None]


@dataclass(frozen=True)
class Driver:
    """Drives a yard with the randomness of a seed, (2,) words; returns an `Outcome`.

    model: file of the tractor's model. content: `content_of` it. save: folder for a file of every
    episode.
    """

    model: Path
    content: str
    save: Path

    def __call__(self, world: World, seed) -> pj.drive.Outcome:
        loop = loop_of(self.model, self.content)
        robot = Driven(yard(threads=1), world.start, np.asarray(seed, np.uint32))
        steps = drive(world, robot, loop)
        new = [step.committed for step in steps if step.new]
        path = np.array(robot.path)
        clearance = distance(places(path), world.walls)
        if new:
            waits = [(LEAVE * i, step.reason) for i, step in enumerate(steps) if not step.new]
            name = f"yard_{'_'.join(map(str, seed))}.json"
            pj.drive.save_episode(self.save / name, new, {"reasons": waits})
        told = {
            "reached": done(robot),
            "seconds": round(robot.time, 1),
            "clearance": float(clearance),
            "committed": len(new),
            "why": steps[-1].reason,
        }
        left = bool(new) and pj.drive.left_tube(new, places(path), path[:, 2])
        return pj.drive.Outcome(clearance <= 0, left, told, new)


def done(robot: Driven) -> bool:
    """Is it at the end of the yard?"""
    return bool(robot.pose[0] >= END - DONE)


def drive(world: World, robot: Driven, loop: pj.drive.Loop) -> list:
    """One episode; what the loop did, cycle by cycle."""
    loop.restart()
    steps, at_rest, walls = [], 0, world.walls
    while at_rest < PATIENCE and robot.time < TIMEOUT and not done(robot):
        here = robot.pose
        away = np.maximum(walls[:, :2] - here[:2], here[:2] - walls[:, 2:]).max(axis=1)
        around = [pj.box(wall[:2], wall[2:]) for wall in walls[away < NEAR]]
        step = loop.step(here, robot.measured, around, along(world.way, here), at=robot.time)
        if step.new:
            robot.begin(step.committed.k)
        at_rest = 0 if step.new else at_rest + 1
        steps.append(step)
        robot.drive(LEAVE)
    return steps


def along(way: np.ndarray, pose: np.ndarray):
    """Likes to come to rest headed for the place on a way (n, 2) some metres ahead of a pose."""
    from shapely import LineString, Point

    line = LineString(way)
    target = np.array(line.interpolate(line.project(Point(pose[:2])) + AHEAD).coords[0])

    def prefer(seen) -> np.ndarray:
        ahead = np.stack([np.cos(seen.heading), np.sin(seen.heading)], axis=1)
        return np.linalg.norm(seen.path[:, -1] + HEADED * ahead - target, axis=1)

    return prefer


@cache
def loop_of(model: Path, content: str) -> pj.drive.Loop:
    """The loop of a model, made once in a process. Raises InputError where the file has changed."""
    if content_of(model) != content:
        raise pj.InputError(f"{model}: expected the model that the drive began with; it changed.")
    body = body_of([hull(*TRACTOR), hull(*TRAILER)])
    effort = pj.drive.Effort(judged=512, room=0.2, deadline=10.0)
    return pj.drive.Loop(pj.load(model), body, leave=LEAVE, effort=effort)
