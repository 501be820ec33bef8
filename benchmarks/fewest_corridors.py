"""How few corridors could hold the safe set? `python -m benchmarks.fewest_corridors --model MODEL`.

Corridors around many safe plans, and around those that keep to none of them, until all plans of a
draw do; of these a greedy set cover takes always the one that adds most. What share of a fresh draw
keeps to the first so many is what a search that knew all of them beforehand would reach: to be held
against the history of `benchmarks.covering`.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from parc_jax.app.cli.systems import build, find, study_of
from parc_jax.app.study.cache import keep_compiled
from parc_jax.learning.model import load
from parc_jax.problem.problem_file import load_problem
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.safe_set.corridors.build import CALL, greedy, nothing_built
from parc_jax.safe_set.corridors.build import _around as around
from parc_jax.safe_set.corridors.build import _with_neighbours as with_neighbours
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.sampling import Points, draw
from parc_jax.safe_set.verdict.scene import Scene, pruned_scene

SHARES = (0.9, 0.95, 0.97, 0.98, 0.985, 0.99, 0.995)


@dataclass(frozen=True)
class Options:
    """One scene."""

    model: Path
    """A saved model."""
    system: str = "drone"
    """The system it was learned from."""
    scene: Path | None = None
    """A scene file in place of the system's own problem."""
    drawn: int = 80_000
    """Plans of each draw, safe or not."""
    seeds: int = 256
    """Safe plans of a round around which corridors are built."""


def main(options: Options) -> dict:
    """Print how many of the corridors, at the least, hold which share of a fresh draw."""
    keep_compiled()
    module, model = find(options.system), load(options.model, system=options.system)
    problem = build(module, "problem", body=study_of(module).body)
    if options.scene is not None:
        problem = load_problem(options.scene, model.points)
    scene, rng = pruned_scene(NominalProblem(problem, model)), np.random.default_rng(0)
    known, fresh = (draw(scene, rng, options.drawn).safe for _ in range(2))
    corridors, kept = pool(scene, rng, known, options.seeds)
    kept_fresh = corridors.kept(fresh.path, fresh.bin)
    left, held = np.ones(len(fresh.k), bool), []
    for c in greedy(kept):
        left &= ~kept_fresh[:, c]
        held.append(1 - left.mean())
    fewest = {f"{s:g}": next((i + 1 for i, h in enumerate(held) if h >= s), None) for s in SHARES}
    out = {
        "safe plans of each draw": [len(known.k), len(fresh.k)],
        "corridors": len(corridors),
        "hold of the fresh draw": float(kept_fresh.any(axis=1).mean()),
        "of these, taken greedily": len(held),
        "that hold": held[-1] if held else 0.0,
        "fewest for a share": fewest,
    }
    print(json.dumps(out, indent=1))
    return out


def pool(scene: Scene, rng: np.random.Generator, plans: Points, n: int):
    """Corridors around plans, n at a time, until all plans keep to some or none that is built adds
    any; and which plans keep to which.
    """
    corridors = Corridors(scene.model.tube)
    kept = np.zeros((len(plans.k), 0), bool)
    while True:
        waiting = plans.at(~kept.any(axis=1))
        if not len(waiting.k):
            return corridors, kept
        seeds = rng.choice(len(waiting.k), min(n, len(waiting.k)), replace=False)
        seeds = np.resize(seeds, -(-len(seeds) // CALL) * CALL)
        rows = with_neighbours(waiting, seeds, rng)
        more = around(scene, nothing_built(scene.model.tube, waiting), rows)
        found = Corridors(scene.model.tube, more).kept(plans.path, plans.bin)
        if not (found.any(axis=1) & ~kept.any(axis=1)).any():
            return corridors, kept
        corridors, kept = corridors.with_more(more), np.concatenate([kept, found], axis=1)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
