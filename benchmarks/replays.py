"""Replay plans drawn from the safe set in the simulator, by the million: `python -m
benchmarks.replays --answer ANSWER --json FILE`; the same command again goes on where it stopped.

A plan that fails although its run stayed inside the tube contradicts the proof and ends the program
with an error.
"""

import hashlib
import json
import time
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import tyro
from tqdm import tqdm

from parc_jax.app.cli.systems import black_box_of, build, find, study_of
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.study.cache import keep_compiled
from parc_jax.app.study.replay import _executed, _refuse_contradictions
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, stream
from parc_jax.learning.model import load
from parc_jax.learning.runs.files import write_atomic
from parc_jax.planner import Planner
from parc_jax.safe_set.verdict.outcomes import reached_and_touched
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene

STEP = 2048  # plans at a time: a few hundred MiB of trajectories
COUNTED = ("plans", "reached", "touched", "left the tube")


def counts_of(system, scene: Scene, plans: np.ndarray, key: jax.Array) -> dict[str, int]:
    """Counts of outcomes of many plans, without their distances. Raises SoundnessError as `replay`
    does.
    """
    runs, inside = _executed(system, scene, plans, key, quiet=True)
    scene = unpruned_scene(scene)
    reached, touched = reached_and_touched(scene, runs, plans[:, : scene.model.n_p])
    _refuse_contradictions(scene, plans, inside & (touched | ~reached))
    return {
        "plans": len(plans),
        "reached": int(reached.sum()),
        "touched": int(touched.sum()),
        "left the tube": int((~inside).sum()),
    }


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
    n: int | None = None
    """Plans to draw and replay. Default: a million, or all samples of an answer whose set is too
    small to draw from."""
    seed: int = 0
    """Everything random follows from it."""
    json: Path | None = None
    """Keep the counts so far here, and go on from those that are."""


def main(options: Options) -> dict:
    """Draw, replay, count."""
    keep_compiled()
    module = find(options.system)
    body = options.body or study_of(module).body
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
    asked = {
        "file": hashlib.sha256((options.answer or options.model).read_bytes()).hexdigest(),
        "system": options.system,
        "plant": options.plant,
        "seed": options.seed,
    }
    n = options.n or 1_000_000
    try:
        answer.sample(key, 1)
    except InputError:
        if options.n is not None:
            raise
        n, asked["drawn"] = len(answer.samples), "the answer's samples"
    out = so_far(options.json, asked)
    before = out["CPU seconds"]
    with tqdm(total=n, initial=out["plans"], unit="replay") as bar:
        while out["plans"] < n:
            size = min(STEP, n - out["plans"])
            step = jax.random.fold_in(stream(key, Stage.REPLAY), out["plans"])
            if "drawn" in asked:
                plans = answer.samples[out["plans"] :][:size]
            else:
                plans = answer.sample(step, size)
            seen = counts_of(system, answer.scene, plans, step)
            out |= {name: out[name] + seen[name] for name in COUNTED}
            out["CPU seconds"] = round(before + time.process_time())
            if options.json is not None:
                write_atomic(options.json, json.dumps(out, indent=1).encode())
            bar.update(size)
    print(json.dumps(out, indent=1))
    return out


def so_far(path: Path | None, asked: dict) -> dict:
    """The counts of an earlier run that asked the same, or zeros. Raises InputError."""
    if path is None or not path.exists():
        return dict.fromkeys((*COUNTED, "CPU seconds"), 0) | asked
    found = json.loads(path.read_text())
    other = [name for name, value in asked.items() if found.get(name) != value]
    if other:
        raise InputError(f"{path}: expected counts of the same {other[0]}; give another file.")
    return found


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
