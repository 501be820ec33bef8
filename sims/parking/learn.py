"""The model that comes along, learned anew: `python -m sims.parking.learn --out model.npz`."""

from dataclasses import dataclass, replace
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.spelling import rounded_up
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.edges import edges_of
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.profile import bin_maxima
from parc_jax.learning.bound.tube import tube
from sims.evened import evened
from sims.parking.car import POINTS, STANDS, TURNED, Law, system, way_of

EXACT = Law(odometer=0.0, steering=0.0, slope=0.0, motor=0.0, pushes=0.0)
# [m] of tube that a manoeuvre has to have, and more for each metre of its way; runs to train on are
# drawn so much more often where it is less: short ways are for where there is no room
LEAST, MORE, OFTEN = 0.0015, 0.0045, 0.7
DRAWN = 4  # times as many k to draw from
RESTING = 0.4  # share of the runs to train on whose wheels are turned before the car drives
# times as wide is what the network learns as K: at the edges of what it sees it is worst
WIDER = np.array([1.03, 1.0, 1.0, 1.04, 1.04])
# the driver asks for no more steering than the last but one of these shares, so that the edges of
# K, where the network is worst, are bins of their own; FEW runs of a bin may miss its worst
SIDES = [-1.0, -0.93, -0.31, 0.31, 0.93, 1.0]
STARTS = [0.0, TURNED, STANDS, 0.7, 1.0]
BINS, FEW, UNSURE = (1, STARTS, 16, SIDES, SIDES), 300, 1.5
RUNS = 50  # over eps: with so many fresh runs the part that may be left outside nears eps
# of runs that nothing else was learned from; those of the bound were looked at once, eps being set:
# it was chosen by what tubes of other fresh runs did
SHAPE_KEY, BOUND_KEY = 100, 503


@dataclass(frozen=True)
class Options:
    """How much of it."""

    out: Path = Path("model.npz")
    rollouts: int = 500_000
    """Runs to train on."""
    shape: int = 1_500_000
    """Runs for the shape of the tube."""
    hidden: tuple[int, ...] = (192, 192, 192, 192)
    steps: int = 291_100
    batch: int = 4000
    """Runs of a step."""
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
    wide = pj.box(WIDER * car.domain.lo, WIDER * car.domain.hi)
    k = draw.uniform(wide.lo, wide.hi, (DRAWN * n, wide.n))
    some = draw.uniform(size=len(k)) < RESTING
    k[some, 1] *= TURNED
    often = (LEAST + MORE * np.abs(way_of(k[:, 2]))) ** -OFTEN
    k = k[draw.choice(len(k), n, replace=False, p=often / often.sum())]
    exact = pj.learning.collect(replace(car, domain=wide), key, n, k=k, quiet=options.quiet)
    how = {"steps": options.steps, "batch": options.batch}
    return pj.learning.train(exact, options.hidden, key=key, seeds=1, **how)


def shape(net: pj.types.ReLUNetwork, runs) -> pj.types.Tube:
    """The shape of the tube: in each bin the largest errors of three in four of its runs, evened
    out by the others. Nothing is borrowed from the bins beside it.
    """
    n = runs.n - runs.n // 4
    first, last = runs.select(slice(0, n)).finite, runs.select(slice(n, None))
    found = bin_maxima(first.k, measure(net, first), edges_of(runs.domain, BINS))
    widths = (each + TOLERANCES.profile_floor for each in found.largest)
    made = evened(net, tube(found.empty.edges, *widths, n_points=len(POINTS)), [last])
    wider = np.where(found.counts < FEW, UNSURE, 1.0)
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
    print(
        f"at rest at most {rounded_up(float(final.max()), 3)} m, in the middle bin {middle:.3f} m"
    )
