"""One of dynobench's scenes, driven: a proved manoeuvre after another until the robot rests in the
goal.
"""

from dataclasses import dataclass

import numpy as np

import parc_jax as pj
from parc_jax.drive.loop.candidates import Outlook
from sims.foreign.dynobench.drive import (
    commands,
    measured_of,
    places,
    states,
    wrapped,
)
from sims.foreign.dynobench.process import ask
from sims.foreign.dynobench.robots import BEND, ROBOTS, TICK
from sims.foreign.dynobench.scenario import NEAR, TURNED, body, obstacles
from sims.foreign.dynobench.scenes import Scene
from sims.guide import Guide

LEAVE = 1.6  # [s] after which a manoeuvre may be left
MOST = 60.0  # [s] of an episode
PATIENCE = 4  # steps at rest without a manoeuvre that end it
CELL, ROOM = 0.05, 0.2  # [m] of guidance: its cells, and what the robot needs around its middle
AHEAD, WEIGHT = 0.4, 0.5  # [m] beyond the rest that are looked at, and what they count
CLOSE = 1.5  # [m] from the goal, from where on its heading counts
IN_GOAL = 100.0  # liked more than any way


@dataclass(frozen=True, eq=False)
class Episode:
    """What came of it. reached: rests in the goal. seconds: until then. clearance: [m] least one,
    as dynobench measures it, at any of its steps. inside: the robot's middle stayed in the scene.
    left: a tube was left. commitments: the manoeuvres. path (n, n_x): states. reason: why the last
    step had no manoeuvre.
    """

    reached: bool
    seconds: float
    clearance: float
    inside: bool
    left: bool
    commitments: list
    path: np.ndarray
    reason: str


def loop_of(robot: str, model: pj.types.TrajectoryModel) -> pj.drive.Loop:
    """A robot's loop, for all of its scenes."""
    effort = pj.drive.Effort(candidates=4096, judged=1024, deadline=60.0)
    return pj.drive.Loop(model, body(ROBOTS[robot]), leave=LEAVE, effort=effort)


def drive_scene(asked: Scene, loop: pj.drive.Loop) -> Episode:
    """From the scene's start. The robot waits while the loop thinks."""
    robot, x, path, driven = ROBOTS[asked.robot], asked.start, [asked.start[None]], []
    around, liked, idle, step, begun = obstacles(asked), Liked(asked, loop.model), 0, None, None
    loop.restart()
    now = 0
    while now * TICK < MOST and idle < PATIENCE:
        step = loop.step(x[:3], measured_of(robot, x), around, liked, at=now * TICK)
        if step.new:
            driven.append(step.committed)
            begun, at = states(robot, x, commands(robot, step.committed.k)), 0
        idle = 0 if step.new else idle + 1
        if begun is None:
            continue
        ends_there = liked.in_goal(begun[-1:])[0]
        until = len(begun) - 1 if ends_there else min(at + round(LEAVE / TICK), len(begun) - 1)
        path.append(begun[at + 1 : until + 1])
        x, now, at = begun[until], now + until - at, until
        if ends_there:
            break
    whole = np.concatenate(path)
    clear = ask("distances", asked.robot, asked.name, whole).min()
    middle = whole[:, :2]
    return Episode(
        bool(liked.in_goal(whole[-1:])[0]),
        now * TICK,
        float(clear),
        bool(((middle >= asked.lo) & (middle <= asked.hi)).all()),
        pj.drive.left_tube(driven, places(robot, whole), whole[:, 2]) if driven else False,
        driven,
        whole,
        step.reason,
    )


class Liked:
    """What a loop prefers in a scene: to end in the goal, less what the tube may miss it by; else
    a short way to it from where a manoeuvre ends, and nearby its heading.
    """

    def __init__(self, asked: Scene, model: pj.types.TrajectoryModel):
        self.robot, self.goal = ROBOTS[asked.robot], asked.goal
        final = model.tube.final.max(axis=0)
        self.miss = np.concatenate([final[:2], final[-model.n_q :]])
        cells = np.ceil((asked.hi - asked.lo) / CELL).astype(int)
        x, y = (lo + CELL * (np.arange(n) + 0.5) for lo, n in zip(asked.lo, cells, strict=True))
        grid = np.zeros((len(y), len(x)), np.int8)
        for one in asked.obstacles:
            across = (x > one.lo[0] - CELL) & (x < one.hi[0] + CELL)
            along = (y > one.lo[1] - CELL) & (y < one.hi[1] + CELL)
            grid[np.ix_(along, across)] = 100
        self.guide = Guide(
            pj.problem.occupancy_grid(grid, CELL, (*asked.lo, 0.0)), self.goal[:2], ROOM
        )

    def __call__(self, seen: Outlook) -> np.ndarray:
        """(b,) the less the better."""
        rest = seen.path[:, -1]
        towards = AHEAD * np.stack([np.cos(seen.heading), np.sin(seen.heading)], axis=1)
        ahead = self.guide(rest + towards)
        if self.robot.speed[0] < 0:
            ahead = np.minimum(ahead, self.guide(rest - towards))
        way = self.guide(rest)
        off = np.abs(wrapped(seen.heading - self.goal[2]))
        close = np.clip(1 - np.linalg.norm(rest - self.goal[:2], axis=1) / CLOSE, 0, 1)
        cost = way + WEIGHT * (1 - close) * ahead + WEIGHT * close * off
        cost = np.where(self.parks(seen), off - IN_GOAL, cost)
        if self.robot.trailer:
            cost[seen.q[:, -1] + self.miss[-1] > BEND] = np.inf  # never bent more than is allowed
        return cost

    def parks(self, seen: Outlook) -> np.ndarray:
        """(b,) does it end in the goal for every run inside the tube?"""
        return self._within(seen.path[:, -1], seen.q, self.miss)

    def in_goal(self, x: np.ndarray) -> np.ndarray:
        """(n,) of states (n, n_x): at rest in the goal? Of a trailer its bend there counts."""
        bend = np.abs(measured_of(self.robot, x)) if self.robot.trailer else x[:, :0]
        return self._within(x[:, :2], np.concatenate([x[:, 2 : 3 + bend.shape[1]], bend], axis=1))

    def _within(self, place, q, miss=0.0) -> np.ndarray:
        off = np.concatenate([place - self.goal[:2], wrapped(q - self._turns(q))], axis=1)
        most = np.array([NEAR, NEAR, *[TURNED] * (q.shape[1] - self.robot.trailer)])
        if self.robot.trailer:
            off[:, -1], most = np.abs(q[:, -1]), np.append(most, BEND)
        return (np.abs(off) + miss <= most).all(axis=1)

    def _turns(self, q) -> np.ndarray:
        turns = np.zeros(q.shape[1])
        turns[: len(turns) - self.robot.trailer] = self.goal[2 : 3 + self.robot.trailer]
        return turns
