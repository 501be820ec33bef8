"""What makes the boat's safe set larger at equal eps: python -m sims.asv.what_helps

One change after another, up to the settings of the study, then one at a time to these; all from the
same runs. Safe: share of all (p0, k), drawn over K and the goal's box, that is safe under the claim
in every block of bins and under the claim over all of K. `--reality` instead draws plans and runs
each 200 times: the share that a perfect planner could keep.
"""

import argparse

import jax
import numpy as np

from parc_jax.app.study.settings import Study
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.learning.bound.pipeline import bound_errors
from parc_jax.learning.bound.start_gap import try_starts
from parc_jax.learning.learn import fit_network
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.collect import collect
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.nominal import query
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.verdict.scene import lowered, volume_of_all
from sims.asv.scenario import problem, system
from sims.asv.study import BOXES, STUDY
from sims.shared_runs import SharedRuns

COMPARED = 32_768  # points drawn to estimate the safe share of a row
FAST = {"seeds": 2}  # the bounds need no more
BARE = BOXES.replace(
    **FAST, bins=(1, 1, 1), blocks=(1, 1, 1), tail=None, profile_runs=0, fresh=None
)
FITTED = BOXES.replace(**FAST, shape="fitted", tail=None)
FINER = FITTED.replace(bins=STUDY.bound.bins, blocks=STUDY.bound.blocks)
NOW = STUDY.replace(**FAST)
ROWS: tuple[tuple[str, Study], ...] = (
    ("one bin, as many fresh runs as needed", BARE),
    ("27 bins", BARE.replace(bins=BOXES.bound.bins, blocks=BOXES.bound.blocks)),
    (
        "+ 100,000 fresh runs, the worst discarded",
        BARE.replace(bins=BOXES.bound.bins, blocks=BOXES.bound.blocks, fresh=100_000),
    ),
    ("+ 60,000 runs for the profile", BOXES.replace(**FAST, tail=None)),
    ("+ faces that fit the errors", FITTED),
    ("+ 216 bins, in 27 blocks", FINER),
    ("+ all 65,000 train and give the profile (the study)", NOW),
    ("the study, last layer fitted to the tail", NOW.replace(tail=8.0)),
    ("the study with boxes", NOW.replace(shape="box")),
    ("the study with 9 x 9 x 9 bins", NOW.replace(bins=(9, 9, 9))),
    ("the study with half as many runs for training and profile", NOW.replace(rollouts=32_500)),
    ("the study with 4 x 12 neurons", NOW.replace(hidden=(12,) * 4)),
    ("one claim at eps / 27, as sharp in a block", NOW.replace(blocks=None, eps=1e-2 / 27)),
)


def helps(only: list[int] | None = None) -> None:
    """Print a row per setting, or those of the given numbers. All settings share their runs."""
    boat, key = system(plant="ode"), jax.random.PRNGKey(0)
    start = try_starts(boat, key, STUDY.bound.gap)
    learned = collect(boat, key, STUDY.rollouts, Stage.TRAIN, quiet=True)
    fresh = collect(boat, key, STUDY.bound.fresh, Stage.BOUND, quiet=True)
    print(f"{'':52} regions  in every block  over K")
    trained: dict[tuple, ReLUNetwork] = {}
    for number, (name, study) in enumerate(ROWS):
        if only and number not in only:
            continue
        train = learned.select(slice(0, study.rollouts))
        known = (study.hidden, study.rollouts, study.tail)
        if known not in trained:
            trained[known] = fit_network(train, study, key)
        net = trained[known]
        runs = SharedRuns(fresh, learned.select(slice(study.rollouts, None)))
        kinds = ("one",) if study.bound.blocks is None else ("bins", "one")
        claims = bound_errors(net, runs, train, study.claims.replace(claims=kinds), start)
        safe = {"bins": "-"}
        for kind, claim in zip(kinds, claims, strict=True):
            model = trajectory_model(net, claim)
            safe[kind] = f"{100 * safe_volume(model, problem(), key)['safe']:.2f} %"
        regions = enumerate_regions(net, boat.domain).count
        print(f"{name:52} {regions:7}  {safe['bins']:>14}  {safe['one']:>6}", flush=True)


def safe_volume(model: TrajectoryModel, problem: Problem, key: jax.Array) -> dict[str, float]:
    """Shares of all (p0, k) over K and the goal's box: `reaching` the goal in the model, `safe`."""
    scene = lowered(query(problem, model).nominal())
    drawn = draw(scene, generator(stream(key, Stage.SEARCH)), COMPARED)
    share = drawn.volume / volume_of_all(scene) / drawn.drawn
    return {"reaching": drawn.reaching * share, "safe": len(drawn.safe.k) * share}


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
