"""How narrow may the slot be? python -m sims.foreign.slot.narrowest model.npz: ever narrower slots
for one learned model, until no plan is found or proved.
"""

import argparse
import json
from pathlib import Path

import jax

from parc_jax.learning.model import load
from parc_jax.planner.planner import Planner
from parc_jax.safe_set.settings import Settings
from sims.foreign.slot.scenario import problem

SAMPLES = 4  # safe plans to look for in each slot


def narrowest(model, widths, key) -> list[dict]:
    """Per width [m], in order, the plans that were drawn and proved; ends where there are none."""
    planner = Planner(model)
    settings = Settings(samples=SAMPLES, work=1e-3, samples_only=True)
    found = []
    for width in widths:
        answer = planner.solve(problem(width), key, settings)
        row = {
            "width_m": width,
            "proved": len(answer.samples),
            "refused": answer.cover.refused,
            "share": answer.share.share,
            "plans": answer.samples.tolist(),
        }
        print(json.dumps(row), flush=True)
        found.append(row)
        if not len(answer.samples):
            break
    return found


def main() -> None:
    """Print a line of JSON per width."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("model", type=Path)
    given.add_argument("--mm", type=float, nargs=3, default=(95.0, 50.0, -5.0))
    given.add_argument("--seed", type=int, default=0)
    asked = given.parse_args()
    jax.config.update("jax_enable_x64", True)
    first, last, step = asked.mm
    widths = [(first + i * step) / 1000 for i in range(int((last - first) / step) + 1)]
    narrowest(load(asked.model), widths, jax.random.PRNGKey(asked.seed))


if __name__ == "__main__":
    main()
