"""The model that comes along, learned anew: `python -m sims.parking.learn --out model.npz`."""

from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from sims.parking.car import Law, system, way_of

EXACT = Law(odometer=0.0, steering=0.0, slope=0.0, motor=0.0)
# [m] of tube that a manoeuvre has to have, and more for each metre of its way; runs to train on are
# drawn so much more often where it is less: short ways are for where there is no room
LEAST, MORE, OFTEN = 0.0015, 0.0045, 0.7
DRAWN = 4  # times as many k to draw from


@dataclass(frozen=True)
class Options:
    """How much of it."""

    out: Path = Path("model.npz")
    rollouts: int = 120_000
    """Runs to train on; as many fresh ones as eps and delta ask for follow."""
    shape: int = 20_000
    """Runs for the shape of the tube."""
    hidden: tuple[int, ...] = (128, 128, 128, 128)
    steps: int = 60_000
    eps: float = 2e-3
    seed: int = 0
    quiet: bool = False


def learn(options: Options) -> pj.types.TrajectoryModel:
    """The network, of runs without errors; the bound, of runs with them and k uniform over K."""
    key, car = jax.random.PRNGKey(options.seed), system()
    n, quiet = options.rollouts, options.quiet
    draw = np.random.default_rng(options.seed)
    k = draw.uniform(car.domain.lo, car.domain.hi, (DRAWN * n, car.domain.n))
    often = (LEAST + MORE * np.abs(way_of(k[:, 1]))) ** -OFTEN
    k = k[draw.choice(len(k), n, replace=False, p=often / often.sum())]
    exact = pj.learning.collect(system(EXACT), key, n, k=k, quiet=quiet)
    net = pj.learning.train(exact, options.hidden, key=key, seeds=1, steps=options.steps)
    claim = pj.learning.bound_error(
        net,
        car,
        key,
        train=pj.learning.collect(car, key, options.shape, quiet=quiet),
        bins=(1, 16, 3, 3),
        eps=options.eps,
        even=True,
        quiet=quiet,
    )
    return pj.learning.trajectory_model(net, claim)


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    model = learn(options)
    model.save(options.out)
    final = model.tube.final[:, : model.n_c].max(axis=1)
    print(model.claim)
    middle = sorted(final)[len(final) // 2]
    print(f"at rest at most {final.max():.3f} m, in the middle bin {middle:.3f} m")
