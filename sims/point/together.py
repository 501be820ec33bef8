"""Episodes of a Goal task driven in step: many worlds of MuJoCo, one call of the driver and one of
the shield for all of them at each step. Judged as `sims.point.episodes` does.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from itertools import count
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.episodes import task_of
from parc_jax.drive.loop.scenes import Scenes
from parc_jax.problem.body import Disc
from parc_jax.problem.robust.pose import pose_of
from sims import car, point
from sims.car.guide import CarGuide
from sims.point.guide import Guide
from sims.point.judge import judge
from sims.point.policy import Trained
from sims.point.world import LEVELS, ROBOTS, STEPS, World

DRIVEN = {"Point": (point, Guide), "Car": (car, CarGuide)}


@dataclass(frozen=True)
class Together:
    """Drives an episode, and with it those that are asked for next: `pj.drive.drive_episodes` takes
    it. law: of worlds; words: of the stream of keys that all seeds are from; batch: how many;
    policy: of `sims.point.train`, in place of the driver with the map.
    """

    robot: str
    level: int
    bare: bool
    content: str
    law: Callable
    words: tuple[int, ...]
    batch: int
    policy: Path | None = None
    _done: dict = field(default_factory=dict)

    def __call__(self, world_seed: int, seed) -> pj.drive.Outcome:
        if tuple(seed) not in self._done:
            words = np.array(self.words)
            first = next(i for i in count() if tuple(task_of(words, i).of_drive) == tuple(seed))
            tasks = [task_of(words, i) for i in range(first, first + self.batch)]
            own = [one.of_drive for one in tasks]
            found = self.drive([self.law(one.of_world) for one in tasks], own)
            self._done.update(zip(map(tuple, own), found, strict=True))
        return self._done.pop(tuple(seed))

    def drive(self, world_seeds: Sequence[int], seeds: Sequence) -> list[pj.drive.Outcome]:
        """Of one episode for each pair of seeds."""
        module, guide = DRIVEN[self.robot]
        worlds = [World(LEVELS[self.level], int(one), ROBOTS[self.robot]) for one in world_seeds]
        for world in worlds:  # as the environment does at a reset
            world.costs()
            world.forward()
        n = len(worlds)
        driver = guide(seeds) if self.policy is None else Trained(self.policy).drive
        gained, cost, changed, stopped = np.zeros((4, n))
        begun: list[list] = [[] for _ in worlds]
        ended, steps, took = np.zeros(n, bool), np.zeros(n, int), []
        under_way, step = None, None
        if not self.bare:
            start, step = shield_of(self.robot)
            with jax.enable_x64(True):
                under_way = start(*measured(module, worlds))
            if not under_way.certified.all():
                raise RuntimeError("expected a certified stop where each world begins")
            begun = [[(0, k)] for k in np.asarray(under_way.k)]
        for t in range(STEPS):
            driven = driver(worlds)
            begin = time.process_time()
            if step is not None:
                with jax.enable_x64(True):
                    under_way, told = step(under_way, *measured(module, worlds), driven)
                under_way, told = jax.tree.map(np.asarray, (under_way, told))
                driven, new = told.action, told.reason == 0
                changed += told.changed & ~ended
                stopped += ~new & ~ended
                for i in np.flatnonzero(new & ~ended):
                    if not t:  # in the place of the stop at the start
                        begun[i].clear()
                    begun[i].append((t, under_way.k[i]))
            middle = time.process_time()
            for i in np.flatnonzero(~ended):
                reward, info = worlds[i].step(driven[i])
                worlds[i].forward()  # as the environment does to tell what is observed
                gained[i] += reward
                cost[i] += info["cost_sum"]
                ended[i], steps[i] = info.get("ended", False), t + 1
            took.append((middle - begin, time.process_time() - middle))
        each = 1e3 * np.array(took).T / n
        outcomes = []
        for i, world in enumerate(worlds):
            path = np.array(world.trace)
            found = judge(path, world.hazards)
            told = {
                "seed": int(world_seeds[i]),
                "return": round(gained[i], 3),
                "cost": cost[i],
                "contact": found.contact,
                "depth": round(found.depth, 4),
                "nearest": round(found.nearest, 4),
                "steps": steps[i],
                "odometry_off": 0.0,
                "changed": changed[i],
                "committed": len(begun[i]),
                "stopped": stopped[i],
                "ms": np.quantile(each.sum(axis=0), [0.5, 0.95, 1.0]).round(4),
                "shield_ms": np.quantile(each[0], [0.5, 0.95, 1.0]).round(4),
            }
            done, left = [], None
            if not self.bare:
                done = committed(module, begun[i], path[0], world.robot.step)
                left = pj.drive.left_tube(done, path[:, :2], path[:, 2])
            outcomes.append(pj.drive.Outcome(found.ever or cost[i] > 0, left, told, done))
        return outcomes


@cache
def shield_of(robot: str):
    """Its two functions, compiled once in a process."""
    module = DRIVEN[robot][0]
    shield = pj.drive.BatchShield(module.model(), **module.sensing.batch_door())
    return jax.jit(shield.start), jax.jit(shield.step)


def measured(module, worlds: Sequence[World]):
    """Poses, speeds, corners of obstacles, and which of these there are."""
    poses, speeds = ([getattr(world, of) for world in worlds] for of in ("pose", "speeds"))
    corners = np.array([module.sensing.corners(world) for world in worlds])
    return np.array(poses), np.array(speeds), corners, np.ones(corners.shape[:2], bool)


def committed(module, begun: Sequence[tuple], pose: np.ndarray, every: float) -> list[Commitment]:
    """Manoeuvres of one episode that began at a step, each with its k (n_k,), as a loop would tell
    of them. pose: where the episode began; obstacles are not kept, nor the room that was left.
    """
    model, disc = module.model(), Disc(module.sensing.batch_door()["radius"])
    asked = Scenes(model, disc, None, pj.Uncertainty()).scene(pose_of(pose, model), ()).nominal
    begins = [Fraction(every) * t for t, _ in begun]
    lasts, episode = Fraction(model.time.dt) * model.time.n_steps, []
    episode += [
        Commitment(i, begin, begin + lasts, k, 0.0, 0, asked, episode=episode)
        for i, (begin, (_, k)) in enumerate(zip(begins, begun, strict=True))
    ]
    return episode
