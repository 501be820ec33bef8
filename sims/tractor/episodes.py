"""Episodes of the tractor with its trailer, at full claims: `python -m sims.tractor.episodes`.

Learns a model from chains of manoeuvres first (minutes), or takes the one that it saved.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.app.cli.places import require_place
from parc_jax.common.spelling import rounded_down
from sims.barn.driver import content_of
from sims.ended import ended
from sims.tractor import params as c
from sims.tractor.driver import LEAVE, Driver
from sims.tractor.gates import any_yard
from sims.tractor.yard import yard

EDGES = (0.7, 1.4)  # [m/s] of speeds at the start, between bins


@dataclass(frozen=True)
class Options:
    """How much of it."""

    episodes: int = 50
    """Each in a yard of its own."""
    out: Path = Path("runs/yard")
    """A folder for model, runs and episodes; what is there is not done again."""
    rollouts: int = 8_000
    """Chains to train on; as many fresh ones as eps and delta ask for follow."""
    eps: float = 1e-3
    """Of the claim about single manoeuvres."""
    jobs: int = 1
    """Processes."""
    quiet: bool = False
    """No progress bars."""


def learn(options: Options) -> Path:
    """The model at its place, learned if there is none."""
    place, quiet = options.out / "model.npz", options.quiet
    if place.exists():
        return place
    kept, key = options.out / "runs", jax.random.PRNGKey(0)
    chain = pj.learning.chained(yard(threads=1), before=3, hand_over=(LEAVE, c.YARD_T_F))
    path = options.out / "runs.npz"
    runs = pj.learning.collect(chain, key, n=options.rollouts, path=path, quiet=quiet)
    net = pj.learning.train(runs, hidden=(32, 32), key=key, seeds=2, steps=6000)
    bins = [np.array(side) for side in zip(chain.domain.lo, chain.domain.hi, strict=True)]
    bins[0] = np.insert(bins[0], 1, EDGES)
    bins[3] = np.linspace(*bins[3], 3)
    asked = {"bins": bins, "shape": "fitted", "train": runs, "quiet": quiet}
    claim = pj.learning.bound_error(
        net, chain, key, eps=options.eps, delta=1e-3, path=kept, **asked
    )
    pj.learning.trajectory_model(net, claim).save(place)
    return place


def drive_yards(options: Options) -> tuple[pj.drive.Episodes, str]:
    """Learn and drive; returns the episodes, and what came of them in words."""
    require_place(options.out, folder=True)
    save = options.out / "episodes"
    save.mkdir(parents=True, exist_ok=True)
    model = learn(options)
    driver, key = Driver(model, content_of(model), save), jax.random.PRNGKey(1)
    asked = {"folder": options.out / "drives", "workers": options.jobs, "quiet": options.quiet}
    done = pj.drive.drive_episodes(driver, any_yard, key, options.episodes, **asked)
    told = [one.told for one in done.driven if not one.failed]
    seconds = [one["seconds"] for one in told if one["reached"]] or [np.nan]
    nearest = [min(one["clearance"] for one in told)] if told else []
    said = [
        f"Model: {pj.load(model).claim}.",
        f"{sum(one['reached'] for one in told)} of {done.n} reached the end of the yard, in "
        f"{np.median(seconds):.1f} s (median), at most {max(seconds):.1f} s; "
        + "".join(f"nearest {rounded_down(metres)} m; " for metres in nearest)
        + f"{done.failed} had no outcome; " * (done.failed > 0)
        + f"{sum(one['committed'] for one in told):,} manoeuvres.",
        done.details(),
    ]
    return done, "\n".join(said)


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    sys.exit(ended("sims.tractor.episodes", lambda: drive_yards(options)[1]))
