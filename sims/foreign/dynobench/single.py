"""Which starts does a single manoeuvre solve? A scene's own, and poses drawn from all of it."""

from typing import NamedTuple

import numpy as np

import parc_jax as pj
from parc_jax.drive.loop.commitment import Commitment
from sims.foreign.dynobench.drive import places, start_of
from sims.foreign.dynobench.episode import Liked
from sims.foreign.dynobench.robots import ROBOTS
from sims.foreign.dynobench.scenario import obstacles
from sims.foreign.dynobench.scenes import Scene


class Starts(NamedTuple):
    """Of n free poses at rest: from how many a manoeuvre into the goal is safe (float64)"""

    n: int
    safe: int


def parked_at_once(asked: Scene, loop: pj.drive.Loop, pose) -> Commitment | None:
    """A manoeuvre from a pose (x, y, heading) at rest, car and trailer in a line, that ends in the
    goal for every run inside the tube; None where no candidate of the loop is one.
    """
    liked = Liked(asked, loop.model)

    def in_goal_alone(seen):
        return np.where(liked.parks(seen), 0.0, np.inf)

    loop.restart()
    at_rest = np.zeros(len(ROBOTS[asked.robot].state))
    step = loop.step(pose, at_rest, obstacles(asked), in_goal_alone, at=0.0)
    return step.committed if step.new else None


def free_poses(asked: Scene, n: int, rng) -> np.ndarray:
    """(n, 3) uniform over those in which the robot, at rest, is inside and touches nothing."""
    from shapely import MultiPolygon, Polygon, box, prepared

    robot, found = ROBOTS[asked.robot], []
    at_rest = np.zeros(len(robot.state))
    boxes = prepared.prep(MultiPolygon([box(*one.lo, *one.hi) for one in asked.obstacles]))
    while len(found) < n:
        pose = rng.uniform([*asked.lo, -np.pi], [*asked.hi, np.pi])
        corners = places(robot, start_of(robot, at_rest, pose[:2], pose[2]))[1:]
        inside = ((corners > asked.lo) & (corners < asked.hi)).all()
        outlines = [Polygon(part) for part in corners.reshape(-1, 4, 2)]
        if inside and not any(boxes.intersects(outline) for outline in outlines):
            found.append(pose)
    return np.array(found)


def starts(asked: Scene, loop: pj.drive.Loop, n: int, seed: int = 0) -> Starts:
    """What a single manoeuvre solves, of n poses drawn from the scene."""
    poses = free_poses(asked, n, np.random.default_rng(seed))
    return Starts(n, sum(parked_at_once(asked, loop, pose) is not None for pose in poses))
