"""The model that comes along, learned anew: `python -m sims.parking.learn --out model.npz`."""

from dataclasses import dataclass, replace
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.edges import edges_of
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.profile import bin_maxima, evened
from parc_jax.learning.bound.tube import tube
from sims.parking.car import POINTS, STANDS, Law, system, way_of

EXACT = Law(odometer=0.0, steering=0.0, slope=0.0, motor=0.0, pushes=0.0)
# [m] of tube that a manoeuvre has to have, and more for each metre of its way; runs to train on are
# drawn so much more often where it is less: short ways are for where there is no room
LEAST, MORE, OFTEN = 0.0015, 0.0045, 0.7
DRAWN = 4  # times as many k to draw from
# times as wide is what the network learns as K: at the edges of what it sees it is worst
WIDER = np.array([1.03, 1.0, 1.0, 1.04, 1.04])
# bins of K: of the start, wheels that are turned, that are turning, and three of speed
BINS = (1, [0.0, 0.05, STANDS, 0.5, 0.75, 1.0], 16, 3, 3)
TURNED = 0.25  # share of the runs for the shape that are in the first of these
BOUND_SEED = 1
RUNS = 50  # over eps: with so many fresh runs the part that may be left outside nears eps
FIRST = 0.55  # share of these runs that turn the wheels before they drive: k's start is 0


@dataclass(frozen=True)
class Options:
    """How much of it."""

    out: Path = Path("model.npz")
    rollouts: int = 400_000
    """Runs to train on; as many fresh ones as eps and delta ask for follow."""
    shape: int = 300_000
    """Runs for the shape of the tube."""
    hidden: tuple[int, ...] = (192, 192, 192, 192)
    steps: int = 120_000
    eps: float = 2e-3
    network: Path | None = None
    """A model whose network is bounded anew, in place of learning one."""
    seed: int = 0
    quiet: bool = False


def learn(options: Options) -> pj.types.TrajectoryModel:
    """The network, of runs without errors; the bound, of runs with them and k uniform over K."""
    known = options.network
    net = network(options) if known is None else pj.load(known, system="parking").net
    return bounded(net, options)


def network(options: Options) -> pj.types.ReLUNetwork:
    """What runs without errors do."""
    key, car, n = jax.random.PRNGKey(options.seed), system(EXACT), options.rollouts
    draw = np.random.default_rng(options.seed)
    wide = pj.box(WIDER * car.domain.lo, WIDER * car.domain.hi)
    k = draw.uniform(wide.lo, wide.hi, (DRAWN * n, wide.n))
    k[draw.uniform(size=len(k)) < FIRST, 1] = 0.0
    often = (LEAST + MORE * np.abs(way_of(k[:, 2]))) ** -OFTEN
    k = k[draw.choice(len(k), n, replace=False, p=often / often.sum())]
    exact = pj.learning.collect(replace(car, domain=wide), key, n, k=k, quiet=options.quiet)
    return pj.learning.train(exact, options.hidden, key=key, seeds=1, steps=options.steps)


def bounded(net: pj.types.ReLUNetwork, options: Options) -> pj.types.TrajectoryModel:
    """The model of a network, its tube of a shape of its own."""
    key, car, quiet = jax.random.PRNGKey(options.seed), system(), options.quiet
    draw = np.random.default_rng(BOUND_SEED + options.seed)
    k = draw.uniform(car.domain.lo, car.domain.hi, (options.shape, car.domain.n))
    k[draw.uniform(size=len(k)) < TURNED, 1] *= BINS[1][1]
    runs = pj.learning.collect(car, key, len(k), k=k, dtype=np.float32, quiet=quiet)
    claim = pj.learning.bound_error(
        net,
        car,
        key,
        train=runs,
        profile=shape(net, runs),
        eps=options.eps,
        delta=1e-3,
        fresh=round(RUNS / options.eps),
        discard="most",
        quiet=quiet,
    )
    return pj.learning.trajectory_model(net, claim)


def shape(net, runs) -> pj.types.Tube:
    """The shape of the tube: of each bin alone, which has runs enough, the largest errors of most
    of its runs, evened out by the others.
    """
    n = runs.n - runs.n // 4
    first, last = runs.select(slice(0, n)).finite, runs.select(slice(n, None))
    found = bin_maxima(first.k, measure(net, first), edges_of(runs.domain, BINS))
    widths = (each + TOLERANCES.profile_floor for each in found.largest)
    return evened(net, tube(found.empty.edges, *widths, n_points=len(POINTS)), [last])


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    model = learn(options)
    model.save(options.out)
    final = model.tube.final[:, : model.n_c].max(axis=1)
    print(model.claim)
    middle = sorted(final)[len(final) // 2]
    print(f"at rest at most {final.max():.3f} m, in the middle bin {middle:.3f} m")
