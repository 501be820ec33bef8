"""Replay plans drawn from the safe set in the simulator, by the million: `python -m
benchmarks.replays --model MODEL`.

A plan that fails although its run stayed inside the tube contradicts the proof and ends the program
with an error.
"""

import json
import time
from dataclasses import dataclass
from pathlib import Path

import jax
import tyro
from tqdm import tqdm

from parc_jax.cli.cache import keep_compiled
from parc_jax.cli.systems import black_box_of, build, find
from parc_jax.errors import InputError
from parc_jax.experiment.replay import replay
from parc_jax.io.answer_file import load_answer
from parc_jax.keys import Stage, stream
from parc_jax.model import load
from parc_jax.planner import Planner
from parc_jax.rollout.files import write_atomic

CHUNK = 4096  # plans per step: a few hundred MiB of trajectories at a time


@dataclass(frozen=True)
class Options:
    """Replays of safe plans."""

    model: Path | None = None
    """A saved model, which is asked about its system's own scene."""
    answer: Path | None = None
    """A saved answer in place of it, from whose sets the plans are drawn."""
    system: str = "drift_parking"
    """The system it was learned from."""
    plant: str = "ode"
    """Plant of the simulator."""
    body: str | None = None
    """Body of the robot, as the model's. Default: its study's, or the system's own."""
    n: int = 1_000_000
    """Plans to draw and replay."""
    seed: int = 0
    """Everything random follows from it."""
    json: Path | None = None
    """Keep the counts so far here."""


def main(options: Options) -> dict:
    """Draw, replay, count."""
    keep_compiled()
    module = find(options.system)
    body = options.body or getattr(getattr(module, "STUDY", None), "body", None)
    system = black_box_of(module, options.plant, body)
    key = jax.random.PRNGKey(options.seed)
    if (options.model is None) == (options.answer is None):
        raise InputError("replays: expected a saved model, or else a saved answer.")
    if options.answer is None:
        model = load(options.model, system=system.name)
        answer = Planner(model).solve(build(module, "problem", body=body), key)
    else:
        answer = load_answer(options.answer)
        model = answer.model
    counts = dict.fromkeys(
        ("plans", "reached", "touched", "left the tube", "failed inside the tube"), 0
    )
    begin = time.perf_counter()
    with tqdm(total=options.n, unit="replay") as bar:
        while counts["plans"] < options.n:
            size = min(CHUNK, options.n - counts["plans"])
            step = jax.random.fold_in(stream(key, Stage.REPLAY), counts["plans"])
            plans = answer.sample(step, size)
            seen = replay(system, model, answer.scene, plans, step)
            counts["plans"] += size
            counts["reached"] += int(seen.reached.sum())
            counts["touched"] += int(seen.touched.sum())
            counts["left the tube"] += int((~seen.inside).sum())
            counts["failed inside the tube"] += int((seen.inside & seen.failed).sum())
            bar.update(size)
            spent = round(time.perf_counter() - begin, 1)
            out = counts | {"seconds": spent, "model": model.net.hash, "seed": options.seed}
            if options.json is not None:
                write_atomic(options.json, json.dumps(out, indent=1).encode())
    print(json.dumps(out, indent=1))
    return out


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
