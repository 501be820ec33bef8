"""The robot of episodes, with its own thinking time, and its model that comes along:
`python -m sims.jackal.learn --out episodes.npz` learns it anew.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import jax

import parc_jax as pj
from parc_jax.learning.labels import name_of
from sims.jackal.system import Jackal, system

MODEL = Path(__file__).with_name("episodes.npz")
THINKS = 0.06  # [s] from measuring to the new command: 50 ms, and on to the controller's next tick
HELD, T_FINAL = 0.2, 1.1  # [s] for which a command is followed, and when the robot rests
SPEED, TURNING, BACKWARD = 1.8, 1.3, 0.8  # [m/s], [rad/s], [m/s] most that is commanded
# Edges between bins, of axes of K: the slower, the less it is off. Who stands beside something
# needs a tube that is narrow
EDGES = {"speed at the start": (-0.12, 0.12, 0.7, 1.3), "speed": (-0.15, 0.15, 1.0)}
# The worst of some thousand runs may be three times as far off as the next, so how wide a tube is
# that holds all of them is luck: of RUNS / eps as many are left outside as is allowed
RUNS, PROFILE_RUNS = 15, 7


def robot(threads: int = 1) -> Jackal:
    """The Jackal that loops drive, over its wheels."""
    most = {"speed": SPEED, "turning": TURNING, "backward": BACKWARD}
    return system(moving=HELD, t_f=T_FINAL, thinking=THINKS, threads=threads, **most)


def thinking() -> pj.drive.Thinking:
    """Its thinking time, as a loop has to know it."""
    before = {"speed before": "speed", "turning before": "turning"}
    return pj.drive.Thinking(THINKS, before, HELD, [0.0, 0.0])


@cache
def model() -> pj.types.TrajectoryModel:
    """The model that comes along."""
    return pj.load(MODEL)


@dataclass(frozen=True)
class Options:
    """How much of it."""

    out: Path = Path("episodes.npz")
    rollouts: int = 12_000
    """Runs to train on; as many fresh ones as eps and delta ask for follow."""
    hidden: tuple[int, ...] = (32, 32)
    train_steps: int = 8000
    eps: float = 1e-3
    """Of the claim about single manoeuvres."""
    seed: int = 0
    threads: int = 1
    quiet: bool = False


def learn(options: Options, jackal: Jackal | None = None, edges=EDGES) -> pj.types.TrajectoryModel:
    """Runs, network, bound, of the robot of episodes or another; edges: of axes of K, by name."""
    jackal, key = jackal or robot(options.threads), jax.random.PRNGKey(options.seed)
    runs = pj.learning.collect(jackal, key, n=options.rollouts, quiet=options.quiet)
    net = pj.learning.train(
        runs, hidden=options.hidden, key=key, seeds=2, steps=options.train_steps
    )
    claim = pj.learning.bound_error(
        net,
        jackal,
        key,
        eps=options.eps,
        delta=1e-3,
        fresh=round(RUNS / options.eps),
        discard="most",
        profile_runs=round(PROFILE_RUNS / options.eps),
        bins=bins_of(runs, edges),
        shape="fitted",
        train=runs,
        quiet=options.quiet,
    )
    return pj.learning.trajectory_model(net, claim)


def bins_of(runs, edges) -> list[list[float]]:
    """Ends of K of runs along each axis, and the edges between bins of those that are named."""
    bins = [[lo, hi] for lo, hi in zip(runs.domain.lo, runs.domain.hi, strict=True)]
    for each, name in zip(bins, map(name_of, runs.labels.k), strict=True):
        each[1:1] = edges.get(name, ())
    return bins


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    learned = learn(options)
    learned.save(options.out)
    print(learned.claim)
