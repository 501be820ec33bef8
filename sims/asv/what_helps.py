"""What makes the boat's safe set larger at equal eps: python -m sims.asv.what_helps

One change at a time to the settings of the study. Safe: share of all (p0, k), drawn over K and the
goal's box, that is safe under the claim in every bin and under the claim over all of K. `--reality`
instead draws plans and runs each 200
times: the share that a perfect planner could keep.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

from parc_jax.experiment.compare import compare
from parc_jax.experiment.learn import learn
from parc_jax.experiment.settings import Study
from parc_jax.experiment.stopwatch import Stopwatch
from parc_jax.keys import Stage
from parc_jax.rollout.collect import collect
from sims.asv.scenario import problem, system
from sims.asv.study import STUDY

BARE = replace(STUDY, others=((),), bins=(1, 1, 1), tail=None, profile_runs=0, fresh=None, seeds=2)
ROWS: tuple[tuple[str, Study], ...] = (
    ("one bin, as many fresh runs as needed", BARE),
    ("27 bins", replace(BARE, bins=STUDY.bins)),
    ("+ 100,000 fresh runs, worst ones discarded", replace(BARE, bins=STUDY.bins, fresh=100_000)),
    ("+ 60,000 runs for the shape", replace(STUDY, others=((),), tail=None, seeds=2)),
    ("+ last layer fitted to the tail (the study)", replace(STUDY, others=((),), seeds=2)),
    ("the study with 3 x 5 x 5 bins", replace(STUDY, others=((),), seeds=2, bins=(3, 5, 5))),
    (
        "the same, 300,000 fresh runs",
        replace(STUDY, others=((),), seeds=2, bins=(3, 5, 5), fresh=300_000),
    ),
    ("the study with a fitted tube", replace(STUDY, others=((),), seeds=2, shape="fitted")),
    (
        "the same, last layer by least squares",
        replace(STUDY, others=((),), seeds=2, shape="fitted", tail=None),
    ),
    (
        "fitted, 3 x 5 x 5 bins, 300,000 fresh runs",
        replace(STUDY, others=((),), seeds=2, shape="fitted", bins=(3, 5, 5), fresh=300_000),
    ),
    ("the study with 4 x 16 neurons", replace(STUDY, hidden=(16,) * 4, others=((),), seeds=2)),
    ("the study with 2 x 6 neurons", replace(STUDY, hidden=(6,) * 2, others=((),), seeds=2)),
    (
        "the study with 40,000 training rollouts",
        replace(STUDY, others=((),), seeds=2, rollouts=40_000),
    ),
    (
        "one claim at eps / 27, as sharp in a bin",
        replace(STUDY, others=((),), seeds=2, claims=("one",), eps=1e-2 / 27),
    ),
)


def helps(only: list[int] | None = None) -> None:
    """Print a row per setting, or those of the given numbers."""
    boat, key = system(plant="ode"), jax.random.PRNGKey(0)
    print(f"{'':46} regions  in every bin  over K")
    for number, (name, study) in enumerate(ROWS):
        if only and number not in only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            learned = learn(boat, study, key, Stopwatch(), Path(folder) / "work", True)
        rows = compare(learned.networks[0], problem(), key)
        safe = {
            row["by_bin"]: f"{100 * row['safe']:.2f} %" for row in rows if row["claim"] == "pac"
        }
        print(
            f"{name:46} {rows[0]['regions']:7}  {safe.get(True, '-'):>12}  {safe[False]:>6}",
            flush=True,
        )


def reality(plans: int = 160, runs: int = 200, ends: int = 64) -> tuple[float, float]:
    """Shares of all (p0, k) that succeed in at least 99 % of `runs`, and that the smallest box tube
    of one k keeps.
    """
    boat, rng, scene = system(plant="ode"), np.random.default_rng(0), problem()
    k = rng.uniform(boat.domain.lo, boat.domain.hi, (plans, 3))
    p = collect(
        boat,
        jax.random.PRNGKey(0),
        plans * runs,
        Stage.VALIDATE,
        k=k.repeat(runs, axis=0),
        quiet=True,
    ).p
    p = np.asarray(p[:, ::5]).reshape(plans, runs, -1, 2)
    goal_lo, goal_hi = np.array([4.0, -1.5]), np.array([7.0, 1.5])
    kept = boxed = 0
    for one in p:
        middle, half = 0.5 * (one.max(axis=0) + one.min(axis=0)), 0.5 * np.ptp(one, axis=0)
        p0 = rng.uniform(goal_lo, goal_hi, (ends, 2)) - middle[-1]
        true, mean = one[None] + p0[:, None, None], middle[None] + p0[:, None]
        ends_in = ((true[:, :, -1] >= goal_lo) & (true[:, :, -1] <= goal_hi)).all(axis=-1)
        kept += int(((ends_in & _clear(true, 0.0, scene)).mean(axis=1) >= 0.99).sum())
        box_in = ((mean[:, -1] - half[-1] >= goal_lo) & (mean[:, -1] + half[-1] <= goal_hi)).all(
            axis=-1
        )
        boxed += int((box_in & _clear(mean, half, scene)).sum())
    return kept / (plans * ends), boxed / (plans * ends)


def _clear(path: np.ndarray, half, scene) -> np.ndarray:
    """Whether paths (..., t, 2) with half widths (t, 2) keep the body's radius from all
    obstacles.
    """
    clear = np.ones(path.shape[:-2], bool)
    for o in scene.obstacles:
        hi, lo = o.b[:2] + half, -o.b[2:] - half
        gap = np.maximum(np.maximum(lo - path, path - hi), 0.0)
        clear &= (np.hypot(gap[..., 0], gap[..., 1]) > scene.body.radius).all(axis=-1)
    return clear


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reality", action="store_true")
    parser.add_argument("--rows", type=int, nargs="*")
    chosen = parser.parse_args()
    if chosen.reality:
        kept, boxed = reality()
        print(
            f"succeeds in 99 % of runs: {100 * kept:.1f} %; in the smallest box tube of one k: "
            f"{100 * boxed:.1f} %"
        )
    else:
        helps(chosen.rows)
