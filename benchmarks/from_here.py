"""I am here, which k? One plan from a pose, found and proved, in CPU time: `python -m
benchmarks.from_here --model MODEL --body rectangle`.

Warm, in one process: the ways of asking take turns, each query lays the scene out anew.
"""

import time
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import tyro

from parc_jax.common.status import Status
from parc_jax.learning.model import load
from parc_jax.planner.planner import Planner
from parc_jax.problem.doubt import Doubt
from parc_jax.safe_set.settings import Settings
from sims.drift_parking.scenario import problem

X, Y, HEADING = 6.9, -4.15, 0.01  # [m, m, rad]


@dataclass(frozen=True)
class Options:
    """First plans of drift parking from one pose."""

    model: Path
    """A saved model of drift parking."""
    body: str = "disc"
    """Body of the robot, as the model's."""
    n: int = 100
    """Queries of each way."""


def main(options: Options) -> dict:
    """Ask, and say how long it took."""
    planner = Planner(load(options.model))
    sure = problem(options.body)
    doubted = sure.replace(doubt=Doubt(start=0.02, heading=0.005))
    ways = {
        "no heading": (sure, (X, Y)),
        "heading 0": (sure, (X, Y, 0.0)),
        f"heading {HEADING}": (sure, (X, Y, HEADING)),
        "the same, start and heading in doubt": (doubted, (X, Y, HEADING)),
    }
    one = Settings(samples=1, samples_only=True)
    spent = {name: [] for name in ways}
    proved = dict.fromkeys(ways, 0)
    for seed in range(-1, options.n):  # the first compiles
        for name, (asked, at) in ways.items():
            begin = time.process_time()
            answer = planner.solve(asked, jax.random.PRNGKey(abs(seed)), one, at=at)
            seconds = time.process_time() - begin
            if seed >= 0:
                spent[name].append(seconds)
                proved[name] += answer.status is Status.PROVED
    for name, seconds in spent.items():
        low, middle, high = 1e3 * np.quantile(seconds, [0.1, 0.5, 0.9])
        print(
            f"{name}: {middle:.1f} ms of CPU ({low:.1f} to {high:.1f}, a tenth above and below), "
            f"{proved[name]} of {options.n} found and proved"
        )
    return {"seconds": spent, "proved": proved}


if __name__ == "__main__":
    main(tyro.cli(Options))
