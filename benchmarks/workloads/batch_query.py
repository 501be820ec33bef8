"""Scenes per second to the first certified plan, many scenes in a few compiled calls.

Drift scenes with a random gap (from half of the published slack to all of it) and both cars moved a
little. Verdicts are float-bounded: float64 with the margin that covers rounding; layout of the
scenes is part of the time. The exact proof of the returned plan is timed apart, on the smallest
batch. Same key, same scenes: the share that is solved is gated.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.cases import Case
from benchmarks.metrics import exact, metric, rate
from benchmarks.result import Result
from benchmarks.timing import timed
from parc_jax.learning.model import TrajectoryModel
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.batch.box_scenes import BoxScenes, box_scenes
from parc_jax.safe_set.settings import Settings

BATCHES = {"cpu": (64, 1024, 4096), "gpu": (64, 4096, 1 << 16, 1 << 20)}


def scenes(case: Case, model: TrajectoryModel, s: int, problem: Problem | None = None) -> BoxScenes:
    """s random scenes: boxes of a problem of the case moved, its own by default."""
    rng, problem = np.random.default_rng(0), problem or case.problem()
    n = model.n_p + model.n_q  # the goal is about the first point and q alone
    ends = -problem.goal.b[n:], problem.goal.b[:n]
    goal_lo, goal_hi = (
        np.tile(np.insert(end, [model.n_p] * (model.n_c - model.n_p), open_), (s, 1))
        for end, open_ in zip(ends, (-np.inf, np.inf), strict=True)
    )
    lo, hi = (
        np.tile([x(o) for o in problem.obstacles], (s, 1, 1))
        for x in (lambda o: -o.b[2:], lambda o: o.b[:2])
    )
    inward = -np.sign(lo[0] + hi[0] - (lo[0] + hi[0]).mean(axis=0))[:, case.axis]
    move = rng.uniform(-0.1, 0.1, lo.shape)
    move[:, :, case.axis] = inward * 0.5 * case.slack * rng.uniform(0.0, 0.5, (s, 1))
    return box_scenes(model, goal_lo, goal_hi, lo + move, hi + move, problem.body)


def run(bench: Bench) -> Result:
    """Solve batches of several sizes; prove the plans of the smallest."""
    case, model = bench.model()
    planner, metrics = Planner(model), []
    for size in bench.size(BATCHES[bench.platform], (16,)):
        some, key = scenes(case, model, size), f"batch_query.{size}"

        def call(some=some):
            return planner.solve_batch(some, bench.key(), Settings.fast().replace(samples=1))

        done = timed(lambda call=call: call().found, bench.size(5, 1))
        metrics += [
            rate(f"{key}.rate", size, done.warm, batch=size),
            metric(
                f"{key}.compile", done.compile_s, "s", "lower", rel_tol=1.0, abs_tol=1.0, batch=size
            ),
            metric(f"{key}.found", done.result.mean(), "1", "higher", abs_tol=0.01, batch=size),
        ]
    small = scenes(case, model, bench.size(BATCHES[bench.platform][0], 4))
    proved = planner.solve_batch(small, bench.key(), Settings.fast().replace(samples=1, proof=True))
    found = int(proved.found.sum())
    metrics += [
        metric(
            "batch_query.proof_per_plan",
            proved.seconds["proof"] / max(found, 1),
            "s",
            "lower",
            rel_tol=0.5,
        ),
        exact("batch_query.not_proved", found - int(proved.proved.sum())),
    ]
    return Result(metrics)
