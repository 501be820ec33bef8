"""A model that comes along, learned anew: `python -m sims.point.learn [--robot car] --out FILE`.

Also tells how far the robot still creeps after its last knot, which `REST` pays for. Of the Point
that is in the tube: its last interval is wider by it, in each bin by that of its own.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import generator
from parc_jax.learning.bound.claim import weaker
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
    if options.robot == "point":
        claim = resting(claim, point.sensing.REST)
    return pj.learning.trajectory_model(net, claim)


def resting(claim, creep: np.ndarray):
    """The claim with a tube whose last interval holds all of it moved by up to creep (n_bins,) [m],
    as a robot that rests may.
    """
    halves, ways = claim.tube.halves[0].copy(), claim.tube.templates.interval.directions[:, -1]
    more = creep[:, None, None] * np.nextafter(np.linalg.norm(ways, axis=-1), np.inf)
    halves[:, -1] = np.nextafter(halves[:, -1] + np.nextafter(more, np.inf), np.inf)
    wider = claim.tube.with_halves(halves, claim.tube.halves[1])
    return weaker(claim, wider, rest={"creep": creep.tolist()})


def creep(model, robot, n: int = 10_000, seconds: float = 3.0, seed: int = 1) -> np.ndarray:
    """(n_bins,) [m] farthest from its place at the last knot that any of n fresh runs comes."""
    lo, hi = robot.domain.lo, robot.domain.hi
    key = jax.random.PRNGKey(seed)
    k = generator(key).uniform(lo, hi, (n, 5))
    path = robot.rollout_batch(jax.random.split(key, n), k, rest=seconds).p
    path = path[:, robot.time.n_record :]
    found, far = np.zeros(model.tube.n_bins), np.linalg.norm(path - path[:, :1], axis=-1)
    np.maximum.at(found, model.tube.bins_of(k)[:, 0], far.max(axis=1))
    return found


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    model = learn(options)
    model.save(options.out)
    print(model.claim)
    far = creep(model, ROBOTS[options.robot].system(1))
    print("10,000 runs creep after their last knot by at most, by bins [mm]:", (1e3 * far).round(1))
