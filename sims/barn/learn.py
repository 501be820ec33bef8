"""The Jackal's model for clutter: narrower where it is slow than `sims.jackal.learn`'s, of the same
robot. `python -m sims.barn.learn --out model.npz` learns it anew.
"""

from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.learning.bound.measure import scores_of
from parc_jax.learning.bound.pipeline import learn_profile
from sims.evened import evened
from sims.jackal import learn as jackal
from sims.jackal.system import Jackal

# Edges between bins, of axes of K: the slower, the less it is off, and who speeds up while a
# manoeuvre begins is off most. Who stands beside something needs a tube that is narrow
EDGES = {
    "speed at the start": (-0.12, 0.12, 0.7, 1.3),
    "turning at the start": (-0.4, 0.4),
    "speed before": (-0.15, 0.15),
    "speed": (-0.15, 0.15, 1.0),
}
# Of K hardly a thousandth is slow in all its speeds, so runs for network and tube are drawn there
# more often: of all, an EVEN share over K, up to BEGIN with slow starts, and those commands slow
# that are neither EVEN nor within LATER
SLOW, EVEN, BEGIN, LATER = 0.2, 0.4, 0.92, (0.84, 0.92)
# Other bins than those that are slow throughout hold few runs: they are made wider by MARGIN, else
# their luck would decide the width of all
THROUGHOUT, MARGIN = 0.1, 1.3
# as `sims.jackal.learn`'s, but more: with them the part that may be left outside nears eps
RUNS, RUNS_KEY = 50, 100
BOUND_KEY = 501  # of fresh runs that no other tube was compared with
CHECKED, CHECK_KEY = 7000, 900


@dataclass(frozen=True)
class Options(jackal.Options):
    """How much of it."""

    out: Path = Path("model.npz")
    rollouts: int = 30_000
    train_steps: int = 40_000
    shape: int = 24_000
    """Runs beside them for the shape of the tube."""


def learn(options: Options) -> pj.types.TrajectoryModel:
    """Network and shape, of runs that are often slow; bound, of runs with k uniform over K."""
    system, key = jackal.robot(options.threads), jax.random.PRNGKey(options.seed)
    runs, _ = runs_of(system, options.rollouts, options.seed + 1, options.quiet)
    net = pj.learning.train(
        runs, hidden=options.hidden, key=key, seeds=1, steps=options.train_steps
    )
    more, even = runs_of(system, options.shape, options.seed + 2, options.quiet)
    claim = pj.learning.bound_error(
        net,
        system,
        jax.random.PRNGKey(BOUND_KEY + options.seed),
        eps=options.eps,
        delta=1e-3,
        fresh=round(RUNS / options.eps),
        discard="most",
        profile=shape(net, runs, more, even),
        train=runs,
        quiet=options.quiet,
    )
    return pj.learning.trajectory_model(net, claim)


def runs_of(system: Jackal, n: int, seed: int, quiet: bool):
    """n runs, often slow ones, and which of them (n,) have their k uniform over K."""
    draw, domain = np.random.default_rng(seed), system.domain
    k, kind = draw.uniform(domain.lo, domain.hi, (n, domain.n)), draw.uniform(size=n)
    slow = draw.uniform(-SLOW, SLOW, (n, 3))
    begin = (kind > EVEN) & (kind < BEGIN)
    end = (kind > EVEN) & ~((kind >= LATER[0]) & (kind <= LATER[1]))
    k[begin, 0], k[begin, 2], k[end, 4] = slow[begin, 0], slow[begin, 1], slow[end, 2]
    key = jax.random.PRNGKey(RUNS_KEY + seed)
    return pj.learning.collect(system, key, n, k=k, dtype=np.float32, quiet=quiet), kind <= EVEN


def shape(net, runs, more, even: np.ndarray) -> pj.types.Tube:
    """The shape of the tube, of runs to train on and more of them, of which some (n,) are even: the
    latter half of these evens it out.
    """
    often, evenly = more.select(np.flatnonzero(~even)), more.select(np.flatnonzero(even))
    half = evenly.n // 2
    first, last = evenly.select(slice(0, half)), evenly.select(slice(half, None))
    bins = jackal.bins_of(runs, EDGES)
    found = evened(net, learn_profile(net, runs, [often, first], bins, shape="fitted"), [last])
    middles = np.array([np.mean(found.bin_box(b), axis=0) for b in range(found.n_bins)])
    slow = (np.abs(middles[:, [0, 2, 4]]) < THROUGHOUT).all(axis=1)
    wider = np.where(slow, 1.0, MARGIN)
    halves = (half * wider.reshape(-1, *[1] * (half.ndim - 1)) for half in found.halves)
    return found.with_halves(*halves)


def left_where_slow(model: pj.types.TrajectoryModel, options: Options) -> int:
    """How many of CHECKED fresh runs that are slow throughout leave the tube: they are too small a
    part of K for its claim to say much of them.
    """
    seed, system = CHECK_KEY + options.seed, jackal.robot(options.threads)
    draw, domain = np.random.default_rng(seed), system.domain
    k = draw.uniform(domain.lo, domain.hi, (CHECKED, domain.n))
    for axis, name in ((0, "speed at the start"), (2, "speed before"), (4, "speed")):
        most = min(np.abs(EDGES[name]))
        k[:, axis] = draw.uniform(-most, most, CHECKED)
    key = jax.random.PRNGKey(seed)
    runs = pj.learning.collect(system, key, CHECKED, k=k, quiet=options.quiet)
    return int((scores_of(model.net, model.tube, [runs]).score > 1).sum())


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    learned = learn(options)
    learned.save(options.out)
    print(learned.claim)
    left = left_where_slow(learned, options)
    print(f"{left} of {CHECKED:,} fresh runs that are slow throughout left the tube")
