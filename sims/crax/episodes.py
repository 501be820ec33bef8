"""Episodes of CRAX's Goal tasks with and without the shield, judged from true states:

    python -m sims.crax.episodes --level 1 --episodes 50 [--bare]

Driver and shield know where everything stands. Two costs are told: the environment's own, and that
of the judge here, from true poses every 20 ms.
"""

import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from sims import crax
from sims.crax.environment import CraxGoal
from sims.crax.guide import CraxGuide
from sims.crax.judge import judge
from sims.crax.sensing import REST
from sims.point.episodes import about_shield


def any_seed(seed) -> int:
    """The law of episodes: a seed of the original's worlds, each alike."""
    return int(np.random.default_rng(seed).integers(2**31))


@cache
def made(level: int, bare: bool):
    """The environment, once in a process."""
    env = CraxGoal(level)
    if bare:
        return env
    env = pj.drive.Shield(env, crax.model(), **crax.door())
    with suppress(pj.InputError):  # what is compiled here may take longer than a decision may
        env.reset(seed=0)
    return env


@dataclass(frozen=True)
class Drive:
    """Drives one episode; `pj.drive.drive_episodes` takes it. save: folder for certificates."""

    level: int
    bare: bool
    content: str = ""
    save: Path | None = None

    def __call__(self, world_seed: int, seed) -> pj.drive.Outcome:
        env, guide = made(self.level, self.bare), CraxGuide([seed])
        env.reset(seed=world_seed)
        world = env.unwrapped.world
        gained, costs, took, changed, reasons, over = 0.0, [], [], 0, Counter(), False
        while not over:
            (action,) = guide([world])
            begin = time.process_time()
            _, reward, _, over, info = env.step(action)
            took.append(time.process_time() - begin)
            gained += reward
            costs.append(info["cost"])
            if not self.bare:
                changed += info["shield"]["changed"]
                reasons[info["shield"]["reason"].split(";")[0]] += 1
        path = np.array(world.trace)
        found = judge(path, world)
        left = None
        if not self.bare:
            left = pj.drive.left_tube(env.commitments, path[:, :2], path[:, 2])
            if self.save is not None:
                env.certificate(self.save / f"crax_{self.level}_{world_seed}.json")
        told = {
            "seed": world_seed,
            "return": gained,
            "cost": round(sum(costs), 4),
            "steps_that_cost": int((np.array(costs) > 0).sum()),
            "contact": found.contact,
            "depth": round(found.depth, 4),
            "nearest": round(found.nearest, 4),
            "steps": len(took),
            "changed": changed,
            "committed": 0 if self.bare else len(env.commitments),
            "stopped": sum(n for why, n in reasons.items() if why),
            "ms": [round(1e3 * float(q), 2) for q in np.quantile(took, [0.5, 0.95, 1.0])],
        }
        done = () if self.bare else env.commitments
        return pj.drive.Outcome(found.ever or sum(costs) > 0, left, told, done)


@dataclass(frozen=True)
class Options:
    """How many, and of what."""

    episodes: int = 50
    level: int = 1
    bare: bool = False
    """Without the shield."""
    out: Path = Path("runs/crax")
    """A folder; episodes that are there are not driven again."""
    save: bool = False
    """A certificate of every episode, which `parc-jax check` verifies."""
    seed: int = 0
    looks: tuple[int, ...] = ()
    """All numbers of episodes at which the sentence may be told; by default `episodes` alone."""
    jobs: int = 1
    quiet: bool = False


def drive(options: Options) -> tuple[pj.drive.Episodes, str]:
    """Drive, and say what came of it."""
    from sims.barn.driver import content_of

    save = options.out / "certificates" if options.save else None
    if save is not None:
        save.mkdir(parents=True, exist_ok=True)
    content = "" if options.bare else content_of(Path(crax.__file__).with_name("model.npz"))
    how = Drive(options.level, options.bare, content, save)
    folder = options.out / (f"level_{options.level}" + ("_bare" if options.bare else ""))
    asked = {"folder": folder, "workers": options.jobs, "quiet": options.quiet}
    key = jax.random.PRNGKey(options.seed)
    done = pj.drive.drive_episodes(
        how, any_seed, key, options.episodes, looks=options.looks, **asked
    )
    told = [one.told for one in done.driven if not one.failed]
    steps = sum(one["steps"] for one in told)
    gained, cost, costly, contact, depth = (
        np.array([one[name] for one in told])
        for name in ("return", "cost", "steps_that_cost", "contact", "depth")
    )
    said = [
        f"{len(told)} of {done.n} episodes, {steps:,} steps: return {gained.mean():.1f} ± "
        f"{gained.std():.1f} (least {gained.min():.0f}, most {gained.max():.0f})",
        f"cost by the environment {cost.mean():.2f} in {costly.mean():.2f} steps, by the judge "
        f"{contact.mean():.2f} steps in contact, {depth.mean():.3f} m by depth; episodes with any: "
        f"{(cost > 0).sum()}, {(contact > 0).sum()}; nearest "
        f"{min(one['nearest'] for one in told):.4f} m",
    ]
    if not options.bare:
        said += about_shield(told, REST)
    return done, "\n".join([*said, done.details()])


if __name__ == "__main__":
    import tyro

    print(drive(tyro.cli(Options, description=__doc__))[1])
