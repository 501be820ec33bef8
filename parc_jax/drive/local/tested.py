"""This very plan, run afresh after it was chosen. [T6, T23]"""

from dataclasses import dataclass
from fractions import Fraction

import jax
import numpy as np

from parc_jax.answer.looks import Look, fresh_key
from parc_jax.common.keys import Stage
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.bound.counts import clopper_pearson, required_runs
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.system import System
from parc_jax.safe_set.verdict.outcomes import outcomes
from parc_jax.safe_set.verdict.scene import Scene

# runs per compiled call, as in the large collections: nothing is compiled for one plan alone
CHUNK = 256
ALIKE = 1e-12  # [m, .] runs that differ by less anywhere are called alike, in words only


@dataclass(frozen=True)
class Tested:
    """What fresh runs of one plan showed.

    n, failures: runs, and how many missed the goal, touched something or ended in NaN.
    alike: all runs were the same, which shows nothing by itself: a rare gust leaves a thousand runs
    alike, and a program that was traced twice alike may be another one the third time.
    eps: bound on the probability of failure with confidence 1 - delta, delta this look's share.
    clearance: [m] smallest distance from an obstacle in any run.
    """

    n: int
    failures: int
    alike: bool
    eps: Fraction
    look: Look
    clearance: float

    def statement(self) -> str:
        """The sentence (D i)."""
        look = f", look {self.look.number} of {self.look.planned}" if self.look.planned > 1 else ""
        alike = (
            " All of them were alike; that the system has no disturbance is not shown, and not "
            "used."
            if self.alike and self.n > 1
            else ""
        )
        sure = rounded_down(1 - self.look.delta, 10)
        return (
            f"This very plan: {self.failures} of {self.n:,} fresh runs made after it was chosen "
            f"failed. With confidence {sure} a new run of it fails with probability at most "
            f"{rounded_up(self.eps)}{look}.{alike}"
        )


def run_plan(
    system: System,
    scene: Scene,
    p0: np.ndarray,
    k: np.ndarray,
    key: jax.Array,
    look: Look,
    eps: Fraction,
    n: int | None,
    quiet: bool,
) -> Tested:
    """Run the plan p0 (n_p,), k (n_k,) afresh, n times; None = as many as it takes to bound the
    failures by eps when there are none.

    Runs are made from the origin and moved to p0, as those behind the claim were.
    """
    if n is None:
        n = required_runs(float(eps), float(look.delta))
    failures = 0
    alike = True
    first = None
    own = fresh_key(key, look, p0, k)
    for batch in stream_rollouts(system, own, n, Stage.VALIDATE, k=k, chunk=CHUNK, quiet=quiet):
        if first is None:
            first = batch.select([0])
            (fails,), nearest = _judged(scene, first, p0)
        same = _same(batch, first)
        failures += int(same.sum()) * int(fails)
        others = batch.select(~same)
        if others.n:
            failed, near = _judged(scene, others, p0)
            failures += int(failed.sum())
            nearest = min(nearest, near)
        alike &= bool((np.abs(batch.p - first.p) <= ALIKE).all())
    bound = clopper_pearson(failures, n, float(look.delta))
    return Tested(n, failures, alike, bound, look, nearest)


def _judged(scene: Scene, runs: RolloutBatch, p0: np.ndarray) -> tuple[np.ndarray, float]:
    """Which runs failed (n,), and the smallest distance [m] of any of them from an obstacle."""
    _, reached, distance = outcomes(scene, runs, np.broadcast_to(p0, (runs.n, len(p0))))
    nearest = np.where(np.isnan(distance), -np.inf, distance).min()
    return runs.failed | ~reached | ~(distance > 0), float(nearest)


def _same(runs: RolloutBatch, first: RolloutBatch) -> np.ndarray:
    """(n,) bool: runs that are the first again to the last bit, as all without a disturbance."""
    moved = (runs.p != first.p).reshape(runs.n, -1).any(axis=1)
    return ~moved & (runs.q == first.q).all(axis=1) & (runs.failed == first.failed)
