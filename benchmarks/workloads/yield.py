"""Yield: of the plans that truly succeed, what share is certified? By shape of the tube, from the
same runs.

A plan is a k, uniform over K, and a place z, uniform over the goal's box, where the first point is
meant to end. Truth: the plan starts so that the median of its runs ends at z, and succeeds when the
goal is reached and nothing is touched in 99 % of its runs. Certified: it starts so that the network
predicts its end at z, and is safe for every run inside the tube. Either way of starting moves each
k's plans by a shift, which changes no volume, and leaves out no plan that succeeds or is certified:
both are shares of one volume. Claims are those of the system's main job, on one network with equal
eps, delta and numbers of runs. Bounds of shares are Clopper-Pearson at 95 %; those of a yield join
them.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.bench import Bench
from benchmarks.cases import Case
from benchmarks.metrics import Metric, metric
from benchmarks.models import CaseModels
from benchmarks.result import Result, Skip, Table, percent
from parc_jax.claim.claim import ErrorClaim
from parc_jax.claim.counts import clopper_pearson, least_probability
from parc_jax.claim.declared import declared_claim
from parc_jax.claim.pipeline import GAP, SHAPES, BoundSettings, bound_errors
from parc_jax.claim.runs import SystemRuns
from parc_jax.claim.start_gap import try_starts
from parc_jax.claim.tube import zero_tube
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.predict import trajectories
from parc_jax.rollout.collect import collect
from parc_jax.verdict.outcomes import outcomes
from parc_jax.verdict.pointwise import verdicts
from parc_jax.verdict.scene import Scene, scene_of

SYSTEMS = ("boat", "drift")
RUNS = 200  # of each plan whose truth is asked
ENOUGH = 0.99  # of them must succeed
TOGETHER = 50  # plans run in one batch


class Share(NamedTuple):
    """count of n plans, drawn independently."""

    count: int
    n: int

    @property
    def value(self) -> float:
        """The estimate."""
        return self.count / self.n

    @property
    def bounds(self) -> tuple[float, float]:
        """95 % bounds."""
        high = float(clopper_pearson(self.count, self.n, 0.025))
        return least_probability(self.count, self.n, 0.025), high

    def __str__(self) -> str:
        return _spelled(self.value, *self.bounds)


def run(bench: Bench) -> Result:
    """Truth once per system, then every shape of the tube under every kind of claim."""
    metrics, rows = [], []
    for name in bench.size(SYSTEMS, SYSTEMS[:1]):
        try:
            learned = bench.learned(name)
        except Skip as why:
            rows.append((name, "", "", str(why), "", ""))
            continue
        more, lines = _of_system(bench, learned)
        metrics += more
        rows += lines
    if not metrics:
        raise Skip("no system of this workload can be simulated here")
    header = ("system", "claim", "tube", "truly succeed", "certified", "yield")
    return Result(metrics, [Table("Certified of what truly succeeds", header, rows)])


def _of_system(bench: Bench, learned: CaseModels) -> tuple[list[Metric], list[tuple[str, ...]]]:
    case, key = learned.case, bench.key(1)
    model = _without_errors(learned.models[case.hidden[-1]].honest)
    start = try_starts(learned.system, key, GAP)
    truth = truly_safe(case, learned.system, model, bench)
    metrics = [metric(f"yield.{case.name}.truth", truth.value, "1", "same", abs_tol=0.03)]
    rows = []
    for shape in SHAPES:
        asked = _asked(bench, case, shape)
        runs = SystemRuns(learned.system, key, learned.train.n, None, True)
        nets, time = [model.net], learned.system.time
        claims = bound_errors(nets, runs, learned.train, asked, start, time, key=key)[0]
        for kind, claim in zip(asked.claims, claims, strict=True):
            found = certified(case, model, claim, bench)
            part = _part(found.value, truth.value)
            low, high = (_part(found.bounds[i], truth.bounds[1 - i]) for i in (0, 1))
            label = f"yield.{case.name}.{kind}.{shape}"
            metrics.append(metric(f"{label}.certified", found.value, "1", "higher", rel_tol=0.2))
            shares = (str(truth), str(found), _spelled(part, low, high))
            rows.append((case.name, kind, shape, *shares))
    return metrics, rows


def _spelled(value: float, low: float, high: float) -> str:
    return f"{percent(value)} ({percent(low)} to {percent(high)})"


def _part(share: float, whole: float) -> float:
    return min(1.0, share / whole) if whole > 0 else 1.0


def _without_errors(model: TrajectoryModel) -> TrajectoryModel:
    """The model under a tube of no width: a scene that leaves out no plan."""
    t = model.tube
    none = zero_tube(t.edges, t.n_steps, t.n_c, t.n_c + t.n_q, t.n_points)
    claim = declared_claim(none, "truth is asked of the system itself", model.net)
    return trajectory_model(model.net, claim, model.domain, model.time, model.system)


def _asked(bench: Bench, case: Case, shape: str) -> BoundSettings:
    """The claims of the main job; tiny ones for a quick look."""
    if not bench.quick:
        return replace(case.asked, shape=shape)
    few = {"eps": 0.1, "delta": 0.1, "claims": ("one",), "fresh": None, "search": 0}
    return replace(case.asked, shape=shape, profile_runs=64, bins=(1,) * len(case.bins), **few)


def truly_safe(case: Case, system, model: TrajectoryModel, bench: Bench) -> Share:
    """Plans that succeed in ENOUGH of their runs."""
    n = bench.size(1600, 10)
    rng = np.random.default_rng(2)
    scene = scene_of(case.problem(), model)
    good = 0
    for first in range(0, n, TOGETHER):
        k, z = _drawn(rng, scene, model, min(TOGETHER, n - first))
        runs = collect(
            system,
            bench.key(2),
            len(k) * RUNS,
            Stage.VALIDATE,
            k=k.repeat(RUNS, axis=0),
            first_row=first * RUNS,
            quiet=True,
        )
        ends = runs.p[:, -1, : model.n_p].reshape(len(k), RUNS, -1)
        p0 = (z - np.nanmedian(ends, axis=1)).repeat(RUNS, axis=0)
        _, reached, distance = outcomes(scene, runs, p0)
        good += int(((reached & (distance > 0)).reshape(len(k), RUNS).mean(axis=1) >= ENOUGH).sum())
    return Share(good, n)


def certified(case: Case, model: TrajectoryModel, claim: ErrorClaim, bench: Bench) -> Share:
    """Plans that the exact test proves under a claim; none where its tube leaves no goal."""
    n = bench.size(1 << 16, 1 << 9)
    given = trajectory_model(model.net, claim, model.domain, model.time, model.system)
    try:
        scene = scene_of(case.problem(), given)
    except InputError:
        return Share(0, n)
    k, z = _drawn(np.random.default_rng(3), scene_of(case.problem(), model), model, n)
    offsets, _ = trajectories(given.net, given.layout, k)
    safe = verdicts(given, scene, z - offsets[:, -1, : given.n_p], k).safe
    return Share(int(safe.sum()), n)


def _drawn(rng, scene: Scene, model: TrajectoryModel, n: int) -> tuple[np.ndarray, np.ndarray]:
    """n plans: k (n, n_k) uniform over K, ends z (n, n_p) uniform over the goal's box."""
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    return k, rng.uniform(scene.z_lo, scene.z_hi, (n, model.n_p))
