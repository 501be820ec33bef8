"""The model that comes along, learned anew: `python -m sims.parking.learn --out model.npz`."""

from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.edges import edges_of
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.profile import bin_maxima, evened
from parc_jax.learning.bound.tube import tube
from sims.parking.car import POINTS, Law, system, way_of

EXACT = Law(odometer=0.0, steering=0.0, slope=0.0, motor=0.0)
# [m] of tube that a manoeuvre has to have, and more for each metre of its way; runs to train on are
# drawn so much more often where it is less: short ways are for where there is no room
LEAST, MORE, OFTEN = 0.0015, 0.0045, 0.7
DRAWN = 4  # times as many k to draw from
# the driver asks for no more steering than the last but one of these shares, so that the edges of
# K, where the network is worst, are bins of their own; FEW runs of a bin may miss its worst
SIDES = [-1.0, -0.93, -0.31, 0.31, 0.93, 1.0]
BINS, FEW, WIDER = (1, 16, SIDES, SIDES), 300, 1.5
RUNS = 50  # over eps: with so many fresh runs the part that may be left outside nears eps
# of runs that nothing else was learned from; those of the bound were looked at once, eps being set:
# it was chosen by what tubes of other fresh runs did
SHAPE_KEY, BOUND_KEY = 100, 502


@dataclass(frozen=True)
class Options:
    """How much of it."""

    out: Path = Path("model.npz")
    rollouts: int = 120_000
    """Runs to train on."""
    shape: int = 300_000
    """Runs for the shape of the tube."""
    hidden: tuple[int, ...] = (128, 128, 128, 128)
    steps: int = 60_000
    eps: float = 3e-4
    seed: int = 0
    network: Path | None = None
    """A model whose network is bounded anew; by default one is learned."""
    quiet: bool = False


def learn(options: Options) -> pj.types.TrajectoryModel:
    """The network, of runs without errors; the bound, of runs with them and k uniform over K."""
    known = options.network
    net = learned(options) if known is None else pj.load(known, system="parking").net
    car, quiet = system(), options.quiet
    draw = np.random.default_rng(SHAPE_KEY + options.seed)
    k = draw.uniform(car.domain.lo, car.domain.hi, (options.shape, car.domain.n))
    key = jax.random.PRNGKey(SHAPE_KEY + options.seed)
    runs = pj.learning.collect(car, key, len(k), k=k, dtype=np.float32, quiet=quiet)
    claim = pj.learning.bound_error(
        net,
        car,
        jax.random.PRNGKey(BOUND_KEY + options.seed),
        train=runs,
        profile=shape(net, runs),
        eps=options.eps,
        delta=1e-3,
        fresh=round(RUNS / options.eps),
        discard="most",
        quiet=quiet,
    )
    return pj.learning.trajectory_model(net, claim)


def learned(options: Options) -> pj.types.ReLUNetwork:
    """The network."""
    key, car, n = jax.random.PRNGKey(options.seed), system(EXACT), options.rollouts
    draw = np.random.default_rng(options.seed)
    k = draw.uniform(car.domain.lo, car.domain.hi, (DRAWN * n, car.domain.n))
    often = (LEAST + MORE * np.abs(way_of(k[:, 1]))) ** -OFTEN
    k = k[draw.choice(len(k), n, replace=False, p=often / often.sum())]
    exact = pj.learning.collect(car, key, n, k=k, quiet=options.quiet)
    return pj.learning.train(exact, options.hidden, key=key, seeds=1, steps=options.steps)


def shape(net: pj.types.ReLUNetwork, runs) -> pj.types.Tube:
    """The shape of the tube: in each bin the largest errors of three in four of its runs, evened
    out by the others. Nothing is borrowed from the bins beside it.
    """
    n = runs.n - runs.n // 4
    first, last = runs.select(slice(0, n)).finite, runs.select(slice(n, None))
    found = bin_maxima(first.k, measure(net, first), edges_of(runs.domain, BINS))
    widths = (each + TOLERANCES.profile_floor for each in found.largest)
    made = evened(net, tube(found.empty.edges, *widths, n_points=len(POINTS)), [last])
    wider = np.where(found.counts < FEW, WIDER, 1.0)
    return made.with_halves(
        *(half * wider.reshape(-1, *[1] * (half.ndim - 1)) for half in made.halves)
    )


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    model = learn(options)
    model.save(options.out)
    final = model.tube.final[:, : model.n_c].max(axis=1)
    print(model.claim)
    middle = sorted(final)[len(final) // 2]
    print(f"at rest at most {final.max():.3f} m, in the middle bin {middle:.3f} m")
