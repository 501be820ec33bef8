"""A planning loop: gap and goal drift, a pedestrian crosses, every answer warm-starts the next one.

    python docs/examples/10_replanning.py MODEL.npz [CYCLES]

MODEL is a saved drift-parking model of the disc (`parc-jax learn drift_parking --body disc`).
"""

import sys
import time
from typing import NamedTuple

import jax
import numpy as np

import parc_jax as pj
from sims.drift_parking.scenario import BODY_RADIUS, GOAL, PARKED_CARS

DRIFT = np.array([0.25, -0.1])  # [m/s] of gap and goal, as the camera's estimate wanders
HERE = np.array([18.0, -14.0])  # [m] where the pedestrian is at time 0
WALK = np.array([0.0, 1.2])  # [m/s] of the pedestrian
EVERY = 6  # intervals per box of the pedestrian's way
CYCLE = 0.05  # [s] between two plans


class Outcome(NamedTuple):
    """Of c cycles."""

    found: np.ndarray  # (c,) bool
    best: np.ndarray  # (c, 4) plans
    clearance: np.ndarray  # (c,) [m]
    warm: np.ndarray  # (c,) bool: the last plans sufficed
    hertz: float


def at(model: pj.types.TrajectoryModel, t: float) -> pj.types.BoxScenes:
    """The scene as it is seen at time t [s], when interval 0 of a plan begins."""
    shift, cars = DRIFT * t, np.array(PARKED_CARS)
    first = np.arange(0, model.time.n_steps, EVERY)
    last = np.minimum(first + EVERY, model.time.n_steps) - 1
    begin, end = (WALK * (t + model.time.dt * moment[:, None]) for moment in (first, last + 1))
    walker = HERE + np.minimum(begin, end) - 0.3, HERE + np.maximum(begin, end) + 0.3
    goal = np.array(GOAL)
    goal[:, :2] += shift
    lo, hi = (np.concatenate([cars[:, side] + shift, walker[side]])[None] for side in (0, 1))
    always = np.tile([0, model.time.n_steps - 1], (len(cars), 1))
    spans = np.concatenate([always, np.stack([first, last], axis=1)])[None]
    return pj.problem.box_scenes(model, goal[:1], goal[1:], lo, hi, BODY_RADIUS, spans=spans)


def replan(model: pj.types.TrajectoryModel, cycles: int, seed: int = 0) -> Outcome:
    """Plan once per cycle; the first one compiles and is not in the rate."""
    planner, key, last, spent, answers = pj.Planner(model), jax.random.PRNGKey(seed), None, [], []
    for cycle in range(cycles):
        begin = time.perf_counter()
        scenes, key_now = at(model, CYCLE * cycle), jax.random.fold_in(key, cycle)
        if cycle == 1:  # the program for warm starts compiles apart, before its first use counts
            planner.solve_batch(scenes, key_now, warm=last)
            begin = time.perf_counter()
        last = planner.solve_batch(scenes, key_now, warm=last)
        spent.append(time.perf_counter() - begin)
        answers.append(last)
    found = np.array([a.found[0] for a in answers])
    warm = np.array([a.draws[0] == 0 for a in answers])
    best, clearance = (
        np.stack(rows)
        for rows in zip(*((a.best[0], a.clearance[0, 0]) for a in answers), strict=True)
    )
    return Outcome(found, best, clearance, warm, 1 / float(np.median(spent[1:])))


def main(path: str, cycles: str = "85") -> None:
    if not cycles.isdecimal() or int(cycles) < 2:
        sys.exit(f"CYCLES: expected a whole number >= 2, as the first compiles; got {cycles}.")
    seen = replan(pj.load(path, system="drift_parking"), int(cycles))
    print(f"{seen.found.sum()} of {len(seen.found)} cycles with a safe plan,")
    print(f"{seen.warm.sum()} from the last plan alone; {seen.hertz:.0f} plans per second;")
    print(f"smallest clearance {np.nanmin(seen.clearance):.3f} m")


if __name__ == "__main__":
    main(*(sys.argv[1:] or sys.exit(__doc__)))
