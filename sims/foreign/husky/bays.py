"""What a bay's width is worth: safe plans, and what the log promises about them.

python -m sims.foreign.husky.bays --model runs/husky/model.npz
"""

import argparse
from pathlib import Path

import jax

from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.model import load
from parc_jax.planner import Planner
from parc_jax.safe_set.settings import Settings
from sims.foreign.husky.scenario import problem

WIDTHS = (1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0)  # [m]


def main() -> None:
    """The command line: a row per width, for starts anywhere and for starts outside."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", type=Path, default=Path("runs/husky/model.npz"))
    planner = Planner(load(parser.parse_args().model))
    claim = planner.model.claim
    print("width  starts    safe plans  at least of K (99.9 %)  at most leave the tube (94.9 %)")
    for width in WIDTHS:
        for outside in (False, True):
            answer = planner.solve(
                problem(width, outside=outside),
                jax.random.PRNGKey(0),
                Settings(samples=20),
            )
            row = f"{width:.1f} m  {'outside ' if outside else 'anywhere'}"
            if not answer.status.found:
                print(f"{row}  {answer.status.label}", flush=True)
                continue
            share = answer.share_of_k()
            promise = float(claim.risk(share=share).bound)
            plans = f"{100 * answer.share.share:9.1f} %  {rounded_down(100 * share):>19} %"
            print(f"{row}  {plans}  {rounded_up(100 * promise, 3):>4} %", flush=True)


if __name__ == "__main__":
    main()
