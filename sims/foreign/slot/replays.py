"""Fly the plans of an answer very often: python -m sims.foreign.slot.replays answer.json --runs
100000. A run that stays in the tube and fails would contradict the proof.
"""

import argparse
import json
import time
from pathlib import Path

import jax
import numpy as np

from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.study.replay import outcomes
from parc_jax.common.keys import Stage
from parc_jax.common.sets.extent import bounding_box
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.network.predict import moved_to
from parc_jax.learning.runs.collect import collect
from sims.foreign.slot.system import PLANTS, system

ROUND = 2048  # runs held in memory at a time
CHUNK = 512  # runs per compiled call


def replays(answer, runs: int, seed: int, plant: str = "disturbed") -> dict:
    """Counts of `runs` runs, rounded up to whole rounds, spread evenly over the samples."""
    drone = system(plant)
    walls = [bounding_box(o) for o in answer.problem.obstacles]
    counts = dict.fromkeys(("runs", "left_tube", "touched", "missed", "failed_inside"), 0)
    begin = time.process_time()
    for number in range(-(-runs // ROUND)):
        key = jax.random.fold_in(jax.random.PRNGKey(seed), number)
        plans = answer.samples[
            np.arange(number * ROUND, (number + 1) * ROUND) % len(answer.samples)
        ]
        flown = collect(drone, key, ROUND, Stage.REPLAY, k=plans[:, 3:], chunk=CHUNK, quiet=True)
        path = moved_to(plans[:, :3], np.asarray(flown.p, np.float64))
        state = np.concatenate([path[:, -1], flown.q], axis=1)
        reached = (state @ answer.scene.goal_A.T <= answer.scene.goal_b).all(axis=1)
        touched = ~clear_along_an_axis(path, walls)
        unsure = np.flatnonzero(touched)
        if len(unsure):  # between two records a direction may do what no axis does
            distance = outcomes(answer.scene, flown.select(unsure), plans[unsure, :3])[2]
            touched[unsure] = ~(distance > 0)
        inside = inside_tube(answer.model.claim, answer.model.net, flown)
        counts["runs"] += ROUND
        counts["left_tube"] += int((~inside).sum())
        counts["touched"] += int(touched.sum())
        counts["missed"] += int((~reached).sum())
        counts["failed_inside"] += int((inside & (touched | ~reached)).sum())
    return counts | {"cpu_s": time.process_time() - begin}


def clear_along_an_axis(path: np.ndarray, walls) -> np.ndarray:
    """(n,) bool: is the drone beyond every wall (boxes) along some axis, in every step between two
    records? Enough to have touched nothing. path (n, n_record + 1, 27).
    """
    corners = path.reshape(*path.shape[:2], -1, 3)[:, :, 1:]
    low = corners.min(axis=2)
    high = corners.max(axis=2)
    low = np.minimum(low[:, :-1], low[:, 1:])
    high = np.maximum(high[:, :-1], high[:, 1:])
    clear = [((low > wall.hi) | (high < wall.lo)).any(axis=-1).all(axis=1) for wall in walls]
    return np.all(clear, axis=0)


def main() -> None:
    """Print the counts as JSON."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("answer", type=Path)
    given.add_argument("--runs", type=int, default=100_000)
    given.add_argument("--seed", type=int, default=1)
    given.add_argument("--plant", default="disturbed", choices=PLANTS)
    asked = given.parse_args()
    jax.config.update("jax_enable_x64", True)
    counts = replays(load_answer(asked.answer), asked.runs, asked.seed, asked.plant)
    print(json.dumps(counts))
    if counts["failed_inside"]:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
