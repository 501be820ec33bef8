"""Episodes of a robot's task driven in step: many worlds of MuJoCo, one call of the driver and one
of the shield for all of them at each step. Judged as `sims.point.episodes` does.
"""

import multiprocessing
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache
from itertools import chain, count
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import jax
import numpy as np

import parc_jax as pj
from parc_jax.drive.loop.commitment import Begun, Commitment
from parc_jax.drive.loop.episodes import OTHER, task_of
from parc_jax.drive.loop.scenes import Scenes
from parc_jax.drive.loop.workers import Task as OfEpisode
from parc_jax.problem.body import Disc
from parc_jax.problem.robust.pose import pose_of
from sims import car, crax, point
from sims.car.guide import CarGuide
from sims.crax.environment import CraxGoal
from sims.crax.guide import CraxGuide
from sims.crax.judge import judge as crax_judge
from sims.point.environment import Task
from sims.point.guide import Guide
from sims.point.judge import Judged, judge
from sims.point.policy import Trained
from sims.point.sensing import batch_door
from sims.point.world import STEPS

CLEAR = 0.15  # [m] of a start: from nearer than 13 cm a stop has been seen that is not certified


class Kit(NamedTuple):
    """What a robot is driven with. module: of its model and what a shield asks of it. goal: level
    -> its task. guide: its driver. judge: of true poses in a world.
    """

    module: ModuleType
    goal: Callable[[int], Task]
    guide: type[Guide]
    judge: Callable[[np.ndarray, Any], Judged]


def _among_hazards(path: np.ndarray, world: Any) -> Judged:
    return judge(path, world.hazards)


KITS = {
    "Point": Kit(point, point.PointGoal, Guide, _among_hazards),
    "Car": Kit(car, car.CarGoal, CarGuide, _among_hazards),
    "Crax": Kit(crax, CraxGoal, CraxGuide, crax_judge),
}


def driver_of(robot: str, blind: bool) -> type[Guide]:
    """The driver with the map, or one that is told of nothing that costs."""
    return _blind(KITS[robot].guide) if blind else KITS[robot].guide


@cache
def _blind(guide: type[Guide]) -> type[Guide]:
    def seen(_, world):
        discs, goals = guide._seen(world)
        return discs[:0], goals

    return type(f"Blind{guide.__name__}", (guide,), {"_seen": classmethod(seen)})


@dataclass(frozen=True)
class Clear:
    """The law of episodes: a seed of the original's worlds, each alike that begins at least CLEAR
    from what costs.
    """

    robot: str
    level: int

    def __call__(self, seed) -> int:
        kit, draw = KITS[self.robot], np.random.default_rng(seed)
        while True:
            one = int(draw.integers(2**32))
            world = kit.goal(self.level).drawn(one)
            if kit.judge(world.pose[None], world).nearest >= CLEAR:
                return one


@dataclass(frozen=True)
class Together:
    """Drives an episode, and with it those that are asked for next: `pj.drive.drive_episodes` takes
    it. blind: as of `driver_of`; law: of worlds; words: of the stream of keys that all seeds are
    from; batch: how many; policy: of `sims.point.train`, in place of the driver with the map; jobs:
    processes among which a batch is dealt out, since MuJoCo steps one world at a time.
    """

    robot: str
    level: int
    bare: bool
    blind: bool
    content: str
    law: Callable
    words: tuple[int, ...]
    batch: int
    policy: Path | None = None
    jobs: int = 1
    _done: dict = field(default_factory=dict)

    def __call__(self, world_seed: int, seed) -> pj.drive.Outcome:
        asked = world_seed, *seed
        if asked not in self._done:
            self._drive_with(*asked)
        if asked not in self._done:  # a world again, by the seed of another
            (self._done[asked],) = self.drive([world_seed], [seed])
        one = self._done.pop(asked)
        if one is None:
            raise RuntimeError("expected a certified stop where the world begins")
        return one

    def _drive_with(self, world_seed: int, *seed: int) -> None:
        """Drives the episodes from the one of this drive's seed on, each once."""
        words = np.array(self.words)
        every = chain([OTHER], count())
        first = next(i for i in every if tuple(task_of(words, i).of_drive) == seed)
        tasks = [task_of(words, i) for i in range(first, first + self.batch)]
        if self.law(tasks[0].of_world) == world_seed:
            dealt = [tasks[i :: self.jobs] for i in range(self.jobs)]
            each = map if self.jobs == 1 else processes(self.jobs).map
            for some in each(replace(self, _done={}).driven, dealt):
                self._done.update(some)

    def driven(self, tasks: Sequence[OfEpisode]) -> dict[tuple, pj.drive.Outcome | None]:
        """What came of some episodes, by the seeds of world and drive."""
        worlds, own = zip(*((self.law(one.of_world), one.of_drive) for one in tasks), strict=True)
        names = [(world, *seed) for world, seed in zip(worlds, own, strict=True)]
        return dict(zip(names, self.drive(worlds, own), strict=True))

    def drive(self, world_seeds: Sequence[int], seeds: Sequence) -> list[pj.drive.Outcome | None]:
        """Of one episode for each pair of seeds; None where no stop is certified at its start."""
        kit = KITS[self.robot]
        drawn = kit.goal(self.level).drawn
        worlds = [drawn(int(one)) for one in world_seeds]
        n = len(worlds)
        if self.policy is None:
            driver = driver_of(self.robot, self.blind)(seeds)
        else:
            driver = Trained(self.policy, seeds)
        gained, cost, costly, changed, stopped = np.zeros((5, n))
        begun: list[list] = [[] for _ in worlds]
        ended, steps, took = np.zeros(n, bool), np.zeros(n, int), []
        under_way, step = None, None
        if not self.bare:
            start, step = shield_of(self.robot)
            with jax.enable_x64(True):
                under_way = start(*measured(kit.module, worlds))
            ended = ~np.asarray(under_way.certified)
            begun = [[(0, k)] for k in np.asarray(under_way.k)]
        for t in range(STEPS):
            driven = driver(worlds)
            begin = time.process_time()
            if step is not None:
                with jax.enable_x64(True):
                    under_way, told = step(under_way, *measured(kit.module, worlds), driven)
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
                gained[i] += reward
                cost[i] += info["cost"]
                costly[i] += info["cost"] > 0
                ended[i], steps[i] = info.get("ended", False), t + 1
            took.append((middle - begin, time.process_time() - middle))
        each = 1e3 * np.array(took).T / n
        quantiles = [
            np.quantile(ms, [0.5, 0.95, 1.0]).round(4) for ms in (each.sum(axis=0), each[0])
        ]
        outcomes: list[pj.drive.Outcome | None] = []
        for i, world in enumerate(worlds):
            if not steps[i]:
                outcomes.append(None)
                continue
            done = None
            if not self.bare:
                done = committed(kit.module, begun[i], world.trace[0], world.robot.step)
            told = {"seed": int(world_seeds[i]), "return": gained[i], "cost": cost[i]}
            told |= {"steps_that_cost": costly[i], "steps": steps[i], "changed": changed[i]}
            told |= {"stopped": stopped[i], "ms": quantiles[0], "shield_ms": quantiles[1]}
            outcomes.append(outcome(kit, world, done, told))
        return outcomes


def outcome(
    kit: Kit, world: Any, done: Sequence[Commitment] | None, told: dict
) -> pj.drive.Outcome:
    """Of an episode in a world. done: what the shield committed to, None without one; told: what
    was counted, to which the judge's part is added.
    """
    path = np.array(world.trace)
    found, left = kit.judge(path, world), None
    if done is not None:
        left = pj.drive.left_tube(done, path[:, :2], path[:, 2])
    told = told | {
        "return": round(told["return"], 3),
        "cost": round(told["cost"], 4),
        "contact": found.contact,
        "depth": round(found.depth, 4),
        "nearest": float(np.floor(1e4 * found.nearest)) / 1e4,
        "committed": len(done or ()),
    }
    return pj.drive.Outcome(found.ever or told["steps_that_cost"] > 0, left, told, done or [])


@cache
def processes(jobs: int) -> ProcessPoolExecutor:
    """Each with programs of its own, compiled once."""
    return ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"))


@cache
def shield_of(robot: str):
    """Its two functions, compiled once in a process."""
    module = KITS[robot].module
    shield = pj.drive.BatchShield(module.model(), **batch_door(module.door))
    return jax.jit(shield.start), jax.jit(shield.step)


def measured(module: ModuleType, worlds: Sequence):
    """Poses, speeds, corners of obstacles, and which of these there are."""
    poses, speeds = ([getattr(world, of) for world in worlds] for of in ("pose", "speeds"))
    corners = np.array([module.sensing.corners(world) for world in worlds])
    return np.array(poses), np.array(speeds), corners, np.ones(corners.shape[:2], bool)


def committed(
    module: ModuleType, begun: Sequence[tuple], pose: np.ndarray, every: float
) -> list[Commitment]:
    """Manoeuvres of one episode that began at a step, each with its k (n_k,), as a loop would tell
    of them. pose: where the episode began; obstacles are not kept, nor the room that was left.
    """
    model, disc = module.model(), Disc(module.door()["body"])
    asked = Scenes(model, disc, None, pj.Uncertainty()).scene(pose_of(pose, model), ()).nominal
    begins = [Fraction(every) * t for t, _ in begun]
    lasts, episode = Fraction(model.time.dt) * model.time.n_steps, Begun()
    episode.assumed = module.door().get("assumed", {})
    told = {"episode": episode, "given": model.given}
    episode += [
        Commitment(i, begin, begin + lasts, k, 0.0, 0, asked, **told)
        for i, (begin, (_, k)) in enumerate(zip(begins, begun, strict=True))
    ]
    return episode
