"""Validated sets, judged: `python -m benchmarks.validated_yield MODEL SYSTEM [--body NAME]`.

A plan is a k, uniform over K, and a place, uniform over the goal's box, where the network ends it.
Each is run once, by keys that no test knows. Yield: the share of those that succeed which a set
holds; failing: the share of those in it that do not succeed, which its risk promises to bound.
"""

import argparse
import time
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
import sims
from parc_jax.common.keys import Stage
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.safe_set.verdict.outcomes import reached_and_touched
from parc_jax.safe_set.verdict.scene import Scene, scene_of

PLANS = 12_000
JUDGE = jax.random.PRNGKey(20_261_124)


def drawn(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Plans p0 (PLANS, n_p), k (PLANS, n_k)."""
    model, rng = scene.model, np.random.default_rng(99)
    k = rng.uniform(scene.k_lo, scene.k_hi, (PLANS, model.n_k))
    ends = rng.uniform(scene.z_lo, scene.z_hi, (PLANS, model.n_p))
    offsets, _ = trajectories(model.net, model.layout, k)
    return ends - offsets[:, -1, : model.n_p], k


def succeed(system, scene: Scene, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(PLANS,) bool."""
    found: list[np.ndarray] = []
    for runs in stream_rollouts(system, JUDGE, len(k), Stage.REPLAY, k=k, quiet=True):
        first = sum(map(len, found))
        reached, touched = reached_and_touched(scene, runs, p0[first : first + runs.n])
        found.append(reached & ~touched)
    return np.concatenate(found)


def row(name: str, held: np.ndarray, good: np.ndarray, seconds: float) -> str:
    """One set, judged."""
    wrong = 1 - good[held].mean() if held.any() else 0.0
    return f"{name:28} {100 * held[good].mean():6.1f} % {wrong:9.4f} {seconds:8.1f} s"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("system")
    parser.add_argument("--body")
    parser.add_argument("--risk", nargs="+", type=float, default=[0.003, 0.01])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    asked = parser.parse_args()
    body = {} if asked.body is None else {"body": asked.body}
    system = sims.load(asked.system, **body)
    problem = getattr(sims, asked.system).problem(**body)
    planner = pj.Planner(pj.load(asked.model))
    scene = scene_of(problem, planner.model)
    plans = drawn(scene)
    good = succeed(system, scene, *plans)
    print(f"{100 * good.mean():.1f} % of {PLANS:,} plans succeed")
    print(f"{'set':28} {'yield':>8} {'failing':>9} {'seconds':>10}")
    planner.warm_up(problem)
    for seed in asked.seeds:
        key = jax.random.PRNGKey(seed)
        for risk in asked.risk:
            begin = time.perf_counter()
            answer = planner.solve(problem, key)
            middle = time.perf_counter()
            checked = pj.drive.Validate(system, risk=risk)
            found = planner.solve(problem, key, validate=checked).validation.answer
            # the query is solved a second time on the way
            seconds = time.perf_counter() - middle - (middle - begin)
            if risk == asked.risk[0]:
                print(row("whole tube", answer.contains(*plans), good, middle - begin))
            name = f"validated, risk {risk:g}"
            held = np.zeros(PLANS, bool) if found is None else found.contains(*plans)
            print(row(name, held, good, seconds))


if __name__ == "__main__":
    main()
