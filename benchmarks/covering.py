"""How fast the safe set of a saved model is covered, over seeds: `python -m benchmarks.covering
--model MODEL`.

A share is seen when a fresh draw of the search shows it, and certified when the answer states it
with confidence. The clock starts with the query, its scene laid out anew; one query has run before,
so nothing compiles. Nothing is proved in exact arithmetic here; that is
`answer.cover.timings["proof_s"]`.
"""

import json
import time
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import tyro

from benchmarks.curves import cover, of_history
from parc_jax.answer.answer import Answer
from parc_jax.app.cli.systems import build, find, study_of
from parc_jax.app.study.cache import keep_compiled
from parc_jax.learning.model import load
from parc_jax.planner import Planner
from parc_jax.problem.problem_file import load_problem
from parc_jax.safe_set.settings import Settings


@dataclass(frozen=True)
class Options:
    """Queries of one model."""

    model: Path
    """A saved model."""
    system: str = "drift_parking"
    """The system it was learned from."""
    body: str | None = None
    """Body of the robot, as the model's. Default: its study's, or the system's own."""
    scene: Path | None = None
    """A scene file in place of the system's own problem."""
    seeds: int = 10
    """Queries."""
    target: float = 0.01
    """Share of the safe set that may stay uncovered."""
    at: float = 3.0
    """[s] What is covered by then?"""
    work: float = 1.0
    """Where a search ends, as a multiple of the standard work."""
    figure: Path | None = None
    """Draw the curves of the last query."""


def main(options: Options) -> dict:
    """Search, and print medians with their range."""
    keep_compiled()
    module = find(options.system)
    body = options.body or study_of(module).body
    planner = Planner(load(options.model, system=options.system))
    problem = build(module, "problem", body=body)
    if options.scene is not None:
        problem = load_problem(options.scene, planner.model.points)
    measured: dict[str, list[float | None]] = {}
    for seed in range(-1, options.seeds):
        begin = time.process_time()
        answer = planner.solve(
            problem,
            jax.random.PRNGKey(seed + 1),
            Settings(samples=1, target=options.target, work=options.work, proof=False),
        )
        spent = {"processor time [s]": time.process_time() - begin}
        if seed >= 0:  # the first one compiles
            for name, value in (_facts(answer, options) | spent).items():
                measured.setdefault(name, []).append(value)
    out = {name: _spread(values) for name, values in measured.items()}
    print(json.dumps(out, indent=1))
    if options.figure is not None:
        cover(of_history(answer.cover.history), options.figure, target=options.target)
    return out


def _facts(answer: Answer, options: Options) -> dict[str, float | None]:
    """Of one query: when the target was seen and certified, with how many corridors; how much was
    covered at the time asked.
    """
    looks = answer.cover.history
    enough = [look for look in looks if look.covered >= 1 - options.target]
    early = [look.covered for look in looks if look.seconds <= options.at]
    certified = answer.coverage.at_least >= 1 - options.target
    return {
        "seen [s]": enough[0].seconds if enough else None,
        "number then": enough[0].corridors if enough else None,
        "certified [s]": looks[-1].seconds if certified else None,
        f"share seen after {options.at:g} s": early[-1] if early else None,
    }


def _spread(values: list[float | None]) -> dict:
    """Median and range of those that are known, and how many are."""
    known = [float(v) for v in values if v is not None]
    middle = (
        {"median": float(np.median(known)), "least": min(known), "most": max(known)}
        if known
        else {}
    )
    return middle | {"known": f"{len(known)} of {len(values)}"}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
