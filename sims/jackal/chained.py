"""Is the start of a manoeuvre in a chain what the claim was made about? Robots drive one random
manoeuvre after another; of the last one, driven to its end, it is asked whether it stayed in the
tube: `python -m sims.jackal.chained --model MODEL`.

Of runs from the black box at most a share eps leaves the tube, says the claim. Runs that end a
chain start with what the chain left hidden. If as few leave it, the law of what came before is
good.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

import parc_jax as pj
from parc_jax.common.keys import generator
from sims.jackal import params as c
from sims.jackal.driven import Driven
from sims.jackal.system import Jackal, framed, system
from sims.rectangle import centre_and_corners


class Last(NamedTuple):
    """The last manoeuvre of a chain: k (4,), and its poses (n, 3) in the frame of its start. off:
    [m] by which odometry is off after the chain, way: [m] driven until then.
    """

    k: np.ndarray
    poses: np.ndarray
    off: float
    way: float


@dataclass
class Chain:
    """What is driven before the last manoeuvre."""

    cycles: int = 10
    """Manoeuvres of a chain before its last one."""
    cycle: float = 0.2
    """Seconds that each is driven."""
    lo: tuple[float, float] = (0.0, -c.TURNING)
    hi: tuple[float, float] = (c.SPEED, c.TURNING)
    """Their commands [m/s, rad/s] are uniform between the two."""


def last_of_a_chain(robot: Jackal, key, chain: Chain) -> Last:
    """Drive a chain, and then one more manoeuvre to its end, with a command uniform in K."""
    draws = generator(key)
    driven = Driven(robot, (0.0, 0.0, 0.0), key)
    lo, hi = np.asarray(robot.domain.lo)[2:], np.asarray(robot.domain.hi)[2:]
    for _ in range(chain.cycles):
        driven.apply(*draws.uniform(chain.lo, chain.hi), chain.cycle)
    before = driven.path
    way = np.linalg.norm(np.diff(before[:, :2], axis=0), axis=1).sum()
    off = np.linalg.norm((driven.odometry - driven.pose)[:2])
    k = driven.apply(*draws.uniform(lo, hi), robot.time.t_f)
    return Last(k, framed(driven.path[None, len(before) - 1 :])[0], float(off), float(way))


def chained(robot: Jackal, keys, chain: Chain, threads: int) -> list[Last]:
    """The last manoeuvres of independent chains, one per key."""
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(lambda key: last_of_a_chain(robot, key, chain), keys))


def left(model, lasts: list[Last], robot: Jackal) -> np.ndarray:
    """(n,) did the run leave the tube at any time?"""
    from parc_jax.learning.bound.measure import scores_of
    from parc_jax.learning.labels import labels_of
    from parc_jax.learning.runs.batch import rollout_batch
    from parc_jax.learning.runs.law import law_of

    poses = np.stack([last.poses for last in lasts])
    p = centre_and_corners(poses[..., :2], poses[..., 2], *robot.size)
    runs = rollout_batch(
        np.stack([last.k for last in lasts]),
        p.reshape(*p.shape[:2], -1),
        poses[:, -1, 2:],
        time=robot.time,
        domain=robot.domain,
        law=law_of(robot, "chained"),
        points=robot.points,
        rotation=robot.rotation,
        labels=labels_of(robot),
    )
    return scores_of(model.net, model.tube, [runs]).score > 1.0


@dataclass
class Options(Chain):
    """What to drive, and what to ask."""

    model: Path = Path("runs/jackal/model.npz")
    """A model of the robot, as `parc-jax run jackal` writes it."""
    n: int = 1000
    """Chains."""
    seed: int = 0
    threads: int = 2


def main(argv: list[str] | None = None) -> None:
    """Command line."""
    import jax
    import tyro

    options = tyro.cli(Options, args=argv, prog="python -m sims.jackal.chained")
    robot = system(threads=1)
    keys = np.asarray(jax.random.split(jax.random.PRNGKey(options.seed), options.n))
    lasts = chained(robot, keys, options, options.threads)
    gone = left(pj.load(options.model), lasts, robot)
    off, way = np.array([(last.off, last.way) for last in lasts]).T
    print(f"{gone.sum()} of {len(gone)} left the tube ({100 * gone.mean():.2f} %)")
    median, rare, most = 100 * np.quantile(off, [0.5, 0.99, 1.0])
    print(
        f"odometry off by {median:.1f} cm (median), {rare:.1f} cm (99 %), {most:.1f} cm (most) "
        f"after {way.mean():.1f} m and {options.cycles * options.cycle:g} s"
    )


if __name__ == "__main__":
    main()
