"""The model that comes along, learned anew: `python -m sims.point.learn --out model.npz`.

Also tells how far the robot still creeps after its last knot, which `REST` pays for.
"""

from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import generator
from sims.point.manoeuvre import system

BINS = ((-0.6, -0.2, 0.2, 0.6), (-0.5, -0.2, 0.2, 0.5), (), (), ())


@dataclass(frozen=True)
class Options:
    """How much of it."""

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
    point, key = system(options.threads), jax.random.PRNGKey(options.seed)
    runs = pj.learning.collect(point, key, n=options.rollouts, quiet=options.quiet)
    net = pj.learning.train(
        runs, hidden=options.hidden, key=key, seeds=2, steps=options.train_steps
    )
    sides = zip(point.domain.lo, point.domain.hi, BINS, strict=True)
    bins = [np.array([lo, *edges, hi]) for lo, hi, edges in sides]
    asked = {"bins": bins, "shape": "fitted", "train": runs, "quiet": options.quiet}
    claim = pj.learning.bound_error(net, point, key, eps=options.eps, delta=1e-3, **asked)
    return pj.learning.trajectory_model(net, claim)


def creep(n: int = 4000, seconds: float = 3.0, seed: int = 1) -> float:
    """[m] farthest from its place at the last knot that any of n fresh runs comes later."""
    point = system(1)
    lo, hi = point.domain.lo, point.domain.hi
    k = generator(jax.random.PRNGKey(seed)).uniform(lo, hi, (n, 5))
    path = point.rollout_batch(None, k, rest=seconds).p[:, point.time.n_record :]
    return float(np.linalg.norm(path - path[:, :1], axis=-1).max())


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    model = learn(options)
    model.save(options.out)
    print(model.claim)
    print(f"4,000 runs creep by at most {creep():.4f} m after their last knot")
