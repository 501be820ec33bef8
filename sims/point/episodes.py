"""Episodes of Goal tasks with and without the shield, judged from true states:

    python -m sims.point.episodes --episodes 100 [--robot Car | --lidar] [--bare] [--level 2]
    python -m sims.point.episodes --episodes 1000 --batch 100 [--robot Crax] [--bare] [--level 2]
    python -m sims.point.episodes --bare --blind [--batch 100]
    python -m sims.point.episodes --policy runs/point/behind.policy [--batch 100]

The driver knows the map (`Guide`), and so does the shield; with --lidar a Point's sensors are all
that both have. Costs are those of the judge here, from true poses every step of MuJoCo or every
fifth, beside the environment's own.
"""

import sys
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import gymnasium
import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import Stage, key_data, stream
from parc_jax.common.spelling import rounded_down, rounded_up
from sims.point import lidar
from sims.point.policy import Trained
from sims.point.together import KITS, Clear, Together, driver_of, outcome
from sims.point.world import STEPS


class Timed(gymnasium.Wrapper):
    """Tells the processor time [s] of each of its steps."""

    def step(self, action):
        """As without it."""
        begin = time.process_time()
        *told, info = self.env.step(action)
        return *told, info | {"took": time.process_time() - begin}


@cache
def made(robot: str, level: int, bare: bool, sensed: bool):
    """The environment, once in a process."""
    kit = KITS[robot]
    env, door = kit.goal(level), kit.module.door()
    if sensed:
        env, door = lidar.Remembers(env), lidar.door()
    env = Timed(env)
    if bare:
        return env
    env = pj.drive.Shield(env, kit.module.model(), **door)
    with suppress(pj.InputError):  # what is compiled here may take longer than a decision may
        env.reset(seed=0)
    return env


@dataclass(frozen=True)
class Drive:
    """Drives one episode; `pj.drive.drive_episodes` takes it. save: folder for certificates."""

    robot: str
    level: int
    bare: bool
    blind: bool
    sensed: bool
    content: str = ""
    save: Path | None = None
    policy: Path | None = None

    def __call__(self, world_seed: int, seed) -> pj.drive.Outcome:
        kit, env = KITS[self.robot], made(self.robot, self.level, self.bare, self.sensed)
        env.reset(seed=world_seed)
        if self.policy is None:
            driver = lidar.WaryGuide if self.sensed else driver_of(self.robot, self.blind)
            guide = driver([seed])
        else:
            guide = Trained(self.policy, [seed])
        world = env.unwrapped.world
        known, off = env.get_wrapper_attr("memory") if self.sensed else world, 0.0
        gained, costs, took, changed, reasons = 0.0, [], [], 0, Counter()
        for _ in range(STEPS):
            begin = time.process_time()
            action = guide([known if self.policy is None else world])[0]
            middle = time.process_time()
            _, reward, ended, over, info = env.step(action)
            whole = time.process_time() - middle
            took.append((whole, whole - info["took"], middle - begin))
            gained += reward
            costs.append(info["cost"])
            if self.sensed:
                off = max(off, float(np.linalg.norm(known.place - world.place + world.start)))
            if not self.bare:
                changed += info["shield"]["changed"]
                reasons[info["shield"]["reason"].split(";")[0]] += 1
            if ended or over:
                break
        if self.save is not None and not self.bare:
            name = "_".join(map(str, (self.robot.lower(), self.level, world_seed, *seed)))
            env.certificate(self.save / f"{name}.json")  # by the drive, too: a world has several
        told = {"seed": world_seed, "return": gained, "cost": sum(costs)}
        told |= {"steps_that_cost": sum(cost > 0 for cost in costs), "steps": len(took)}
        told |= {"changed": changed, "stopped": sum(n for why, n in reasons.items() if why)}
        ms = np.quantile(1e3 * np.array(took), [0.5, 0.95, 1.0], axis=0).T.round(2).tolist()
        told |= zip(("ms", "shield_ms", "driver_ms"), ms, strict=True)
        if self.sensed:
            told["odometry_off"] = round(off, 5)
        return outcome(kit, world, None if self.bare else env.commitments, told)


@dataclass(frozen=True)
class Options:
    """How many, and of what."""

    episodes: int = 100
    robot: Literal["Point", "Car", "Crax"] = "Point"
    level: int = 1
    """1 or 2; of Crax also 3."""
    bare: bool = False
    """Without the shield."""
    blind: bool = False
    """The driver with the map is told of nothing that costs."""
    lidar: bool = False
    """A Point's lidar, compass and odometry in place of the map."""
    policy: Path | None = None
    """A policy of `sims.point.train` drives, by its lidar and with its noise, in place of the
    driver with the map.
    """
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


def about_shield(told: list[dict], creep: str) -> list[str]:
    """What the shield did in episodes as `Drive` tells of them. creep: what is assumed of it."""
    steps, changed, stopped, committed = (
        sum(one[name] for one in told) for name in ("steps", "changed", "stopped", "committed")
    )
    ms = np.array([one["ms"] for one in told])
    said = [
        f"changed {100 * changed / steps:.1f} % of actions, nothing new certified in "
        f"{100 * stopped / steps:.1f} % of steps; {committed:,} commitments",
        f"processor time of a step, simulator included: median {np.median(ms[:, 0]):.3g} ms, 95 % "
        f"{np.median(ms[:, 1]):.3g} ms in the middle episode",
    ]
    for who, name in (("shield", "shield_ms"), ("driver, which comes before", "driver_ms")):
        if own := [one[name] for one in told if name in one]:
            half, most, _ = np.median(own, axis=0)
            said += [f"of the {who}: median {half:.3g} ms, 95 % {most:.3g} ms"]
    return [*said, f"assumed: creep {creep}"]


def drive(options: Options) -> tuple[pj.drive.Episodes, str]:
    """Drive, and say what came of it."""
    from sims.barn.driver import content_of

    module = KITS[options.robot].module
    name = f"{options.robot.lower()}_{options.level}" + ("_bare" if options.bare else "")
    name += ("_lidar" if options.lidar else "") + ("_blind" if options.blind else "")
    name += "" if options.policy is None else f"_{options.policy.stem}"
    save = options.out / "certificates" if options.save else None
    if save is not None:
        save.mkdir(parents=True, exist_ok=True)
    content = "" if options.bare else content_of(Path(module.__file__).with_name("model.npz"))
    content += "" if options.policy is None else content_of(options.policy)
    if options.blind and (options.lidar or options.policy):
        raise pj.InputError("--blind: expected the driver with the map, no --lidar, no --policy.")
    about = options.robot, options.level, options.bare, options.blind
    key = jax.random.PRNGKey(options.seed)
    law = Clear(options.robot, options.level)
    how: Drive | Together = Drive(*about, options.lidar, content, save, options.policy)
    if options.batch:
        if options.lidar or options.save:
            raise pj.InputError("--batch: expected neither --lidar nor --save; drive one by one.")
        words = tuple(map(int, key_data(stream(key, Stage.EPISODE)).ravel()))
        how = Together(*about, content, law, words, options.batch, options.policy, options.jobs)
        name += "_together"
    asked = {"folder": options.out / name, "quiet": options.quiet, "looks": options.looks}
    asked["workers"] = 0 if options.batch else options.jobs
    done = pj.drive.drive_episodes(how, law, key, options.episodes, **asked)
    told = [one.told for one in done.driven if not one.failed]
    if not told:
        return done, f"0 of {done.n} episodes have an outcome.\n{done.details()}"
    gained = np.array([one["return"] for one in told])
    steps = sum(one["steps"] for one in told)
    cost, costly, contact, depth = (
        np.array([one[name] for one in told])
        for name in ("cost", "steps_that_cost", "contact", "depth")
    )
    said = [
        f"{len(told)} of {done.n} episodes, {steps:,} steps: return {gained.mean():.1f} ± "
        f"{gained.std():.1f} (least {gained.min():.1f}, most {gained.max():.1f})",
        f"cost by the environment {cost.mean():.2f} in {costly.mean():.2f} steps, by the judge "
        f"{contact.mean():.2f} steps in contact, {depth.mean():.3f} m by depth; episodes with any: "
        f"{(costly > 0).sum()}, {(contact > 0).sum()}; nearest "
        f"{rounded_down(min(one['nearest'] for one in told))} m",
    ]
    if not options.bare:
        said += about_shield(told, module.door()["assumed"]["creep"])
    if options.lidar:
        off = max(one["odometry_off"] for one in told)
        said += [
            f"assumed: odometry off by at most {lidar.DRIFT:g} m; it was by {rounded_up(off, 3)} m"
        ]
    return done, "\n".join([*said, done.details()])


if __name__ == "__main__":
    import tyro

    try:
        print(drive(tyro.cli(Options, description=__doc__))[1])
    except pj.InputError as error:
        sys.exit(f"error: {error}")
