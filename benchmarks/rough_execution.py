"""What the copies of rough execution lose: of the plans that withstand a 5 x 5 grid of executions,
the share that is shown to withstand all. `python -m benchmarks.rough_execution --model MODEL`.

Plans of drift parking with the disc: k uniform, starts such that the predicted ends are uniform
over the goal.
"""

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from parc_jax.learning.model import load
from parc_jax.learning.network.relu import outputs
from parc_jax.problem.doubt import Doubt
from parc_jax.problem.robust.question import plain
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from sims.drift_parking.scenario import problem

TOLERANCES = ((0.005, 0.001), (0.02, 0.005))  # [m/s, rad]


@dataclass(frozen=True)
class Options:
    """Rough execution of drift parking."""

    model: Path
    """A saved model of drift parking with the disc."""
    n: int = 20_000
    """Plans to draw."""
    seed: int = 0
    """Of the draws."""


def main(options: Options) -> list[tuple[int, int]]:
    """For each tolerance: plans that withstand the grid, and those of them that are shown to."""
    model, asked = load(options.model), problem()
    rng = np.random.default_rng(options.seed)
    found = []
    for tolerance in TOLERANCES:
        lo, hi = model.domain.lo + tolerance, model.domain.hi - tolerance
        k = rng.uniform(lo, hi, (options.n, model.n_k))
        end = model.layout.n_steps * model.n_c - model.n_p
        ends = outputs(model.net, k)[:, end : end + model.n_p]
        goal = scene_of(asked, model)
        p0 = rng.uniform(goal.z_lo, goal.z_hi, (options.n, model.n_p)) - ends
        for step in itertools.product(np.linspace(-1, 1, 5), repeat=2):
            safe = verdicts(goal, p0, k + np.array(step) * tolerance).safe
            p0, k = p0[safe], k[safe]
        robust = plain(asked.replace(doubt=Doubt(k=list(tolerance))), model)
        shown = verdicts(scene_of(robust.problem, robust.model), p0, k).safe
        found.append((len(k), int(shown.sum())))
        print(f"±{tolerance}: {found[-1][1]} of {found[-1][0]}, {shown.mean():.0%}")
    return found


if __name__ == "__main__":
    main(tyro.cli(Options))
