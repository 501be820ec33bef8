"""Yield: of the plans that truly succeed, what share is certified? By setting, from equally many
runs.

A plan is a k, uniform over K, and a place z, uniform over the goal's box, where the first point is
meant to end. Truth: the plan starts so that the median of its runs ends at z, and succeeds when the
goal is reached and nothing is touched in 99 % of its runs (of 200 of the boat, 100 of the car; a
system without chance: in its one run). Certified: it starts so that the network predicts its end at
z, and is safe for every run inside the tube. Either way of starting moves each k's plans by a
shift, which changes no volume, and leaves out no plan that succeeds or is certified: both are
shares of one volume. All settings of a system have equal eps and delta and spend equally many runs
on training, profile and claims, each on its own; the runs are the same. Bounds at 95 %: of
certified shares Clopper-Pearson, of truth from the spread over the k's; those of a yield join the
two, which both hold at 90 %.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.bench import Bench
from benchmarks.curves import Bar, shares
from benchmarks.metrics import metric
from benchmarks.result import Result, Skip, Table, percent
from benchmarks.yields import Setting, Task, tasks
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.counts import clopper_pearson, least_probability
from parc_jax.learning.bound.declared import declared_claim
from parc_jax.learning.bound.pipeline import bound_errors
from parc_jax.learning.bound.start_gap import try_starts
from parc_jax.learning.bound.tube import zero_tube
from parc_jax.learning.learn import fit_network
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import collect
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.verdict.outcomes import outcomes
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene, scene_of
from sims.shared_runs import SharedRuns

ENOUGH = 0.99  # of a plan's runs must succeed
ENDS = 8  # places z of each k
FIRST = (
    10  # runs of a plan that are looked at first: with too many failures the others do not matter
)
TOGETHER = 50  # values of k run in one batch


class Share(NamedTuple):
    """An estimate with its 95 % bounds."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{percent(self.value)} ({percent(self.low)} to {percent(self.high)})"


def run(bench: Bench) -> Result:
    """Truth once per system, then every setting under every kind of claim."""
    metrics, rows, bars = [], [], []
    for task in tasks(bench.quick):
        try:
            found = list(_of_task(bench, task))
        except (Skip, ImportError) as why:
            rows.append((task.name, "", "", str(why), "", "", ""))
            continue
        for number, (setting, kind, truth, share) in enumerate(found):
            whole = _yield(share, truth)
            label = f"yield.{task.name}"
            if number == 0:
                metrics.append(metric(f"{label}.truth", truth.value, "1", "same", abs_tol=0.05))
            certified = metric(
                f"{label}.{kind}.{setting.key}", share.value, "1", "higher", rel_tol=0.2
            )
            metrics.append(certified)
            runs = f"{setting.runs:,}"
            told = (str(truth), str(share), str(whole))
            rows.append((task.name, kind, setting.name, runs, *told))
            if isinstance(whole, Share):
                bars.append([task.title, kind, setting.name, *whole])
    if not metrics:
        raise Skip("no system of this workload can be simulated here")
    header = ("system", "claim", "setting", "runs", "truly succeed", "certified", "yield")
    note = "one: a claim over all of K. bins: a claim in every bin, or block of bins, at once."
    table = Table("Certified of what truly succeeds", header, rows, note)
    return Result(metrics, [table], {"bars": bars} if bars else {})


def figure(data: dict, path) -> None:
    """The yields as bars, a group per system and kind of claim."""
    kinds = {"one": "one claim", "bins": "claims in parts of K"}
    groups: dict[str, list[Bar]] = {}
    for system, kind, setting, *share in data["bars"]:
        groups.setdefault(f"{system}\n{kinds[kind]}", []).append(Bar(setting, *share))
    shares(groups, path, label="certified of what truly succeeds")


def _of_task(bench: Bench, task: Task) -> Iterator[tuple[Setting, str, Share, Share]]:
    """Setting, kind of claim, truth and certified share."""
    system, problem, key = task.system(), task.problem(), bench.key(1)
    start = try_starts(system, key, task.gap)
    largest = max(s.study.rollouts + s.study.bound.profile_runs for s in task.settings)
    learned = collect(system, key, largest, Stage.TRAIN, quiet=True)
    fresh = max(s.study.bound.fresh for s in task.settings)
    holdout = collect(system, key, fresh, Stage.BOUND, quiet=True)
    truth = None
    trained: dict[tuple, ReLUNetwork] = {}
    for setting in task.settings:
        study = setting.study
        train = learned.select(slice(0, study.rollouts))
        known = (study.hidden, study.rollouts, study.tail)
        if known not in trained:
            trained[known] = fit_network(train, study, key)
        net = trained[known]
        model = _without_errors(net, learned)
        if truth is None:
            truth = truly_safe(task, system, model, bench)
        runs = SharedRuns(holdout, learned.select(slice(study.rollouts, None)))
        kinds = ("one",) if study.bound.blocks is None else ("bins", "one")
        claims = bound_errors(net, runs, train, study.claims.replace(claims=kinds), start)
        for kind, claim in zip(kinds, claims, strict=True):
            yield setting, kind, truth, certified(problem, model, claim, bench)


def _yield(certified: Share, truth: Share) -> Share | str:
    """What a table says where there is no such share: nothing of nothing, or a contradiction."""
    if certified.low > truth.high:
        return "**more certified than truly succeed**"
    if not truth.value:
        return ""
    return Share(
        _part(certified.value, truth.value),
        _part(certified.low, truth.high),
        _part(certified.high, truth.low),
    )


def _part(share: float, whole: float) -> float:
    return min(1.0, share / whole) if whole > 0 else 1.0


def _without_errors(net: ReLUNetwork, runs: RolloutBatch) -> TrajectoryModel:
    """The model under a tube of no width: a scene that leaves out no plan."""
    n_c, n_end = runs.p.shape[2], runs.p.shape[2] + runs.n_q
    edges = tuple(np.array(pair) for pair in zip(runs.domain.lo, runs.domain.hi, strict=True))
    none = zero_tube(edges, runs.time.n_steps, n_c, n_end, len(runs.points))
    why = "truth is asked of the system itself"
    claim = declared_claim(none, why, net, runs.time, system="yield", points=runs.points)
    return trajectory_model(net, claim)


def truly_safe(task: Task, system, model: TrajectoryModel, bench: Bench) -> Share:
    """Plans that succeed in ENOUGH of their runs."""
    n = bench.size(task.plans if task.chance else 2000, 10)
    each = bench.size(task.repeats, 20) if task.chance else 1
    rng = np.random.default_rng(2)
    scene = scene_of(task.problem(), model)
    good = []
    for first in range(0, n, TOGETHER):
        k = rng.uniform(model.domain.lo, model.domain.hi, (min(TOGETHER, n - first), model.n_k))
        runs = collect(
            system,
            bench.key(2),
            len(k) * each,
            Stage.VALIDATE,
            k=k.repeat(each, axis=0),
            first_row=first * each,
            quiet=True,
        )
        ends = runs.p[:, -1, : model.n_p].reshape(len(k), each, -1)
        p0 = rng.uniform(scene.z_lo, scene.z_hi, (ENDS, len(k), model.n_p))
        p0 = (p0 - np.nanmedian(ends, axis=1)).swapaxes(0, 1).reshape(-1, model.n_p)
        good.append(_succeed(scene, runs, p0, each).reshape(len(k), ENDS).mean(axis=1))
    of_k = np.concatenate(good)
    value, error = float(of_k.mean()), 1.96 * float(of_k.std()) / np.sqrt(n)
    error = error or float(clopper_pearson(0, n, 0.025))  # all of them alike, which n show
    return Share(value, max(0.0, value - error), min(1.0, value + error))


def _succeed(scene: Scene, runs: RolloutBatch, p0: np.ndarray, each: int) -> np.ndarray:
    """Whether plans from p0 (n, n_p), ENDS of every k in turn, succeed in ENOUGH of the runs of
    their k, `each` of them in turn.
    """
    allowed = each - int(np.ceil(ENOUGH * each))
    failures = np.zeros(len(p0), int)
    for looked in (range(0, min(FIRST, each)), range(FIRST, each)):
        left = np.flatnonzero(failures <= allowed)
        if not len(looked) or not len(left):
            continue
        rows = ((left // ENDS) * each)[:, None] + np.array(looked)
        _, reached, distance = outcomes(
            scene, runs.select(rows.ravel()), p0[left].repeat(len(looked), axis=0)
        )
        failed = ~(reached & (distance > 0)).reshape(rows.shape)
        failures[left] += failed.sum(axis=1)
    return failures <= allowed


def certified(problem: Problem, model: TrajectoryModel, claim: ErrorClaim, bench: Bench) -> Share:
    """Plans that the exact test proves under a claim; none where its tube leaves no goal."""
    n, count = bench.size(1 << 13, 1 << 9), 0
    given = trajectory_model(model.net, claim)
    rng = np.random.default_rng(3)
    whole = scene_of(problem, model)
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    z = rng.uniform(whole.z_lo, whole.z_hi, (n, model.n_p))
    try:
        scene = scene_of(problem, given)
    except InputError:
        pass
    else:
        offsets, _ = trajectories(given.net, given.layout, k)
        count = int(verdicts(scene, z - offsets[:, -1, : given.n_p], k).safe.sum())
    high = float(clopper_pearson(count, n, 0.025))
    return Share(count / n, least_probability(count, n, 0.025), high)
