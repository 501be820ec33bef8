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
from parc_jax.drive.local.validate import validated
from parc_jax.drive.local.validation import SCALES
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


def row(name: str, results: list[tuple[float, ...]]) -> str:
    """One kind of set over the seeds: medians, the least and the most yield, the most failing."""
    held, wrong, seconds = np.array(results).T
    between = f"{100 * held.min():.1f} to {100 * held.max():.1f}"
    return (
        f"{name:22} {100 * np.median(held):6.1f} % {between:>14} {np.median(wrong):9.4f} "
        f"{wrong.max():9.4f} {np.median(seconds):8.1f} s"
    )


def judged(held: np.ndarray, good: np.ndarray, seconds: float) -> tuple[float, ...]:
    """Yield of a set, share of its plans that fail, its seconds."""
    return held[good].mean(), (1 - good[held].mean() if held.any() else 0.0), seconds


def falling(smallest: float) -> list[float]:
    """The scales that are tried by default, down to one: the fewer, the faster."""
    return [scale for scale in SCALES if scale >= smallest]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("system")
    parser.add_argument("--body")
    parser.add_argument("--risk", nargs="+", type=float, default=[0.003, 0.01, 0.03])
    parser.add_argument("--smallest", type=float, help="scale that no set has less than")
    parser.add_argument("--tests", type=int, help="runs of drawn plans, else as by default")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3, 4, 5])
    asked = parser.parse_args()
    body = {} if asked.body is None else {"body": asked.body}
    system = sims.load(asked.system, **body)
    problem = getattr(sims, asked.system).problem(**body)
    planner, settings = pj.Planner(pj.load(asked.model)), pj.Settings()
    scene = scene_of(problem, planner.model)
    plans = drawn(scene)
    good = succeed(system, scene, *plans)
    print(f"{100 * good.mean():.1f} % of {PLANS:,} plans succeed; seconds of processor time")
    print(f"{'set':22} {'yield':>8} {'of all seeds':>14} {'failing':>9} {'at most':>9}")
    planner.warm_up(problem)
    found: dict[str, list] = {}
    for seed in asked.seeds:
        key = jax.random.PRNGKey(seed)
        begin = time.process_time()
        answer = planner.solve(problem, key, settings)
        spent = time.process_time() - begin
        found.setdefault("whole tube", []).append(judged(answer.contains(*plans), good, spent))
        for risk in asked.risk:
            begin = time.process_time()
            scales = None if asked.smallest is None else falling(asked.smallest)
            checked = pj.drive.Validate(system, risk=risk, tests=asked.tests, scales=scales)
            tested = validated(answer, key, settings, checked).validation.answer
            spent = time.process_time() - begin
            held = np.zeros(PLANS, bool) if tested is None else tested.contains(*plans)
            found.setdefault(f"risk {risk:g}", []).append(judged(held, good, spent))
    for name, results in found.items():
        print(row(name, results))


if __name__ == "__main__":
    main()
