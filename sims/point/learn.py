"""A model that comes along, learned anew: `python -m sims.point.learn [--robot car] --out FILE`.

Also tells how far the robot still creeps after its last knot, which `REST` pays for.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import generator
from sims import car, crax, point

ROBOTS = {"point": point, "car": car, "crax": crax}
BINS = {
    "point": ((-0.6, -0.2, 0.2, 0.6), (-0.5, -0.2, 0.2, 0.5), (), (), ()),
    "car": ((-0.2, 0.2), (-0.5, -0.2, 0.2, 0.5), (-1.0, 1.0), (), ()),
    "crax": ((-0.6, -0.2, 0.2, 0.6), (-0.7, -0.3, 0.3, 0.7), (), (), ()),
}


@dataclass(frozen=True)
class Options:
    """How much of it."""

    robot: Literal["point", "car", "crax"] = "point"
    out: Path = Path("model.npz")
    rollouts: int = 16_000
    """Runs to train on; as many fresh ones as eps and delta ask for follow."""
    hidden: tuple[int, ...] = (32, 32)
    train_steps: int = 8000
    eps: float = 1e-3
    seed: int = 0
    threads: int = 1
    quiet: bool = False


def learn(options: Options) -> pj.types.TrajectoryModel:
    """Runs, network, bound."""
    robot = ROBOTS[options.robot].system(options.threads)
    key = jax.random.PRNGKey(options.seed)
    runs = pj.learning.collect(robot, key, n=options.rollouts, quiet=options.quiet)
    net = pj.learning.train(
        runs, hidden=options.hidden, key=key, seeds=2, steps=options.train_steps
    )
    sides = zip(robot.domain.lo, robot.domain.hi, BINS[options.robot], strict=True)
    bins = [np.array([lo, *edges, hi]) for lo, hi, edges in sides]
    asked = {"bins": bins, "shape": "fitted", "train": runs, "quiet": options.quiet}
    claim = pj.learning.bound_error(net, robot, key, eps=options.eps, delta=1e-3, **asked)
    return pj.learning.trajectory_model(net, claim)


def creep(robot, n: int = 4000, seconds: float = 3.0, seed: int = 1) -> float:
    """[m] farthest from its place at the last knot that any of n fresh runs comes later."""
    lo, hi = robot.domain.lo, robot.domain.hi
    key = jax.random.PRNGKey(seed)
    k = generator(key).uniform(lo, hi, (n, 5))
    path = robot.rollout_batch(jax.random.split(key, n), k, rest=seconds).p
    path = path[:, robot.time.n_record :]
    return float(np.linalg.norm(path - path[:, :1], axis=-1).max())


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    model = learn(options)
    model.save(options.out)
    print(model.claim)
    far = creep(ROBOTS[options.robot].system(1))
    print(f"4,000 runs creep by at most {far:.4f} m after their last knot")
