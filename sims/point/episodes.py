"""Episodes of Goal tasks with and without the shield, judged from true states:

    python -m sims.point.episodes --episodes 100 [--robot Car | --lidar] [--bare] [--level 2]
    python -m sims.point.episodes --episodes 1000 --batch 100 [--robot Car] [--bare] [--level 2]
    python -m sims.point.episodes --policy runs/point/behind.policy [--batch 100]

The driver knows the map (`Guide`), and so does the shield; with --lidar a Point's sensors are all
that both have. Costs are those of the judge here, from true poses every 10 ms, not the
environment's own.
"""

import time
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import Stage, key_data, stream
from sims.point import lidar
from sims.point.environment import Goal
from sims.point.judge import judge
from sims.point.policy import Trained
from sims.point.together import DRIVEN as ROBOTS
from sims.point.together import Together
from sims.point.world import STEPS


def any_seed(seed) -> int:
    """The law of episodes: a seed of the original's worlds, each alike."""
    return int(np.random.default_rng(seed).integers(2**32))


@cache
def made(robot: str, level: int, bare: bool, sensed: bool):
    """The environment, once in a process."""
    env, module = Goal(robot, level), ROBOTS[robot][0]
    env, door = (lidar.Remembers(env), lidar.door()) if sensed else (env, module.door())
    return env if bare else pj.drive.Shield(env, module.model(), **door)


@dataclass(frozen=True)
class Drive:
    """Drives one episode; `pj.drive.drive_episodes` takes it. save: folder for certificates."""

    robot: str
    level: int
    bare: bool
    sensed: bool
    content: str = ""
    save: Path | None = None
    policy: Path | None = None

    def __call__(self, world_seed: int, seed) -> pj.drive.Outcome:
        env = made(self.robot, self.level, self.bare, self.sensed)
        seen, _ = env.reset(seed=world_seed)
        guide = (lidar.WaryGuide if self.sensed else ROBOTS[self.robot][1])([seed])
        policy = None if self.policy is None else Trained(self.policy)
        world = env.unwrapped.world
        known, off = env.get_wrapper_attr("memory") if self.sensed else world, 0.0
        gained, cost, took, changed, reasons = 0.0, 0.0, [], 0, Counter()
        ended = False
        for _ in range(STEPS):
            action = guide([known])[0] if policy is None else policy(seen)
            begin = time.process_time()
            seen, reward, ended, over, info = env.step(action)
            took.append(time.process_time() - begin)
            gained, cost = gained + reward, cost + info["cost"]
            if self.sensed:
                off = max(off, float(np.linalg.norm(known.place - world.place + world.start)))
            if not self.bare:
                changed += info["shield"]["changed"]
                reasons[info["shield"]["reason"].split(";")[0]] += 1
            if ended or over:
                break
        path = np.array(world.trace)
        found = judge(path, world.hazards)
        left, n = None, 0
        if not self.bare:
            n = len(env.commitments)
            left = pj.drive.left_tube(env.commitments, path[:, :2], path[:, 2])
            if self.save is not None:
                env.certificate(self.save / f"{self.robot.lower()}_{world_seed}.json")
        touched = found.ever or cost > 0
        told = {
            "seed": world_seed,
            "return": round(gained, 3),
            "cost": cost,
            "contact": found.contact,
            "depth": round(found.depth, 4),
            "nearest": round(found.nearest, 4),
            "steps": len(took),
            "odometry_off": round(off, 5),
            "changed": changed,
            "committed": n,
            "stopped": sum(n for why, n in reasons.items() if why),
            "ms": [round(1e3 * float(q), 2) for q in np.quantile(took, [0.5, 0.95, 1.0])],
        }
        return pj.drive.Outcome(touched, left, told, [] if self.bare else env.commitments)


@dataclass(frozen=True)
class Options:
    """How many, and of what."""

    episodes: int = 100
    robot: Literal["Point", "Car"] = "Point"
    level: int = 1
    bare: bool = False
    """Without the shield."""
    lidar: bool = False
    """A Point's lidar, compass and odometry in place of the map."""
    policy: Path | None = None
    """A policy of `sims.point.train` drives, by its lidar, in place of the driver with the map."""
    out: Path = Path("runs/goal")
    """A folder; episodes that are there are not driven again."""
    save: bool = False
    """A certificate of every episode, which `parc-jax check` verifies."""
    seed: int = 0
    looks: tuple[int, ...] = ()
    """All numbers of episodes at which the sentence may be told; by default `episodes` alone."""
    jobs: int = 1
    batch: int = 0
    """Worlds that are driven in step, by one call of the shield for all; 0 drives one by one."""
    quiet: bool = False


def about_shield(told: list[dict], rest: float) -> list[str]:
    """What the shield did in episodes as `Drive` tells of them, after which a robot creeps at most
    so far [m].
    """
    steps, changed, stopped, committed = (
        sum(one[name] for one in told) for name in ("steps", "changed", "stopped", "committed")
    )
    ms = np.array([one["ms"] for one in told])
    said = [
        f"changed {100 * changed / steps:.1f} % of actions, nothing new certified in "
        f"{100 * stopped / steps:.1f} % of steps; {committed:,} commitments",
        f"processor time of a step, simulator included: median {np.median(ms[:, 0]):.3g} ms, 95 % "
        f"{np.median(ms[:, 1]):.3g} ms in the middle episode",
        f"assumed: a robot creeps by at most {100 * rest:g} cm after a manoeuvre, by which every "
        "obstacle is grown",
    ]
    if own := [one["shield_ms"] for one in told if "shield_ms" in one]:
        half, most, _ = np.median(own, axis=0)
        said += [f"of the shield in a batch: median {half:.3g} ms, 95 % {most:.3g} ms"]
    return said


def drive(options: Options) -> tuple[pj.drive.Episodes, str]:
    """Drive, and say what came of it."""
    from sims.barn.driver import content_of

    module = ROBOTS[options.robot][0]
    name = f"{options.robot.lower()}_{options.level}" + ("_bare" if options.bare else "")
    name += "_lidar" if options.lidar else ""
    name += "" if options.policy is None else f"_{options.policy.stem}"
    save = options.out / "certificates" if options.save else None
    if save is not None:
        save.mkdir(parents=True, exist_ok=True)
    content = "" if options.bare else content_of(Path(module.__file__).with_name("model.npz"))
    content += "" if options.policy is None else content_of(options.policy)
    about, key = (options.robot, options.level, options.bare), jax.random.PRNGKey(options.seed)
    how: Drive | Together = Drive(*about, options.lidar, content, save, options.policy)
    if options.batch:
        if options.lidar or options.save:
            raise pj.InputError("--batch: expected neither --lidar nor --save; drive one by one.")
        words = tuple(map(int, key_data(stream(key, Stage.EPISODE)).ravel()))
        how = Together(*about, content, any_seed, words, options.batch, options.policy)
        name += "_together"
    asked = {"folder": options.out / name, "quiet": options.quiet, "looks": options.looks}
    asked["workers"] = 0 if options.batch else options.jobs
    done = pj.drive.drive_episodes(how, any_seed, key, options.episodes, **asked)
    told = [one.told for one in done.driven if not one.failed]
    gained = np.array([one["return"] for one in told])
    steps = sum(one["steps"] for one in told)
    cost, contact, depth = (
        np.array([one[name] for one in told]) for name in ("cost", "contact", "depth")
    )
    said = [
        f"{len(told)} of {done.n} episodes, {steps:,} steps: return {gained.mean():.1f} ± "
        f"{gained.std():.1f} (least {gained.min():.1f}, most {gained.max():.1f})",
        f"cost by the environment {cost.mean():.2f}, by the judge {contact.mean():.2f} steps in "
        f"contact, {depth.mean():.3f} m by depth; episodes with any: {(cost > 0).sum()}, "
        f"{(contact > 0).sum()}; nearest {min(one['nearest'] for one in told):.4f} m",
    ]
    if not options.bare:
        said += about_shield(told, module.sensing.REST)
    if options.lidar:
        off = max(one["odometry_off"] for one in told)
        said += [f"assumed: odometry off by at most {lidar.DRIFT:g} m; it was by {off:.5f} m"]
    return done, "\n".join([*said, done.details()])


if __name__ == "__main__":
    import tyro

    print(drive(tyro.cli(Options, description=__doc__))[1])
