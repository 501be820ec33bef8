"""BRS and BAS of all regions: the published LP method against the LP-free one, side by side in one
run.

Same model, same scene, same machine, same float64. Published: per region one LP for the reach set,
one AH-polytope and one LP per obstacle and interval for the avoid sets (Clarabel, one thread).
LP-free: reach sets by the vertices of their cells (a batched LP kernel for what those leave open),
avoid sets as polygons through support functions, on all cores. Both prune empty sets and both only
claim what they re-checked. The LP method is timed on a random tenth of the regions (at least ten)
and scaled up; the spread is two standard errors of that. The LP-free one does all regions, warm;
its compile time is reported apart. The programs of the sampled regions are then solved once more by
the same solver with nothing around it: the lean yardstick, against which a ratio is worth stating;
the last ratio counts only the seconds that the solver itself reports, assembly not included.
Starts drawn in the goal-reaching sets are then judged by both: nowhere may they contradict each
other beyond rounding.
"""

import time
from dataclasses import dataclass

import jax
import numpy as np

from benchmarks.bench import Bench
from benchmarks.lean_lps import recorded, solve_lean
from benchmarks.metrics import Metric, exact, metric, ratio, times
from benchmarks.neuralparc.by_lp import avoid_by_lp, reach_by_lp, safe_by_lp
from benchmarks.neuralparc.by_support import margins
from benchmarks.neuralparc.lp_program import LinearProgram, LPStatus
from benchmarks.neuralparc.scene import PaperScene, Tally, paper_scene
from benchmarks.neuralparc.sets.sampling import sample_polytopes
from benchmarks.published import AllSets, Partition, all_sets, rows_of
from benchmarks.result import Result, Table, milliseconds
from benchmarks.timing import timed
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.proof.regions import enumerate_regions

BAND = 1e-7  # [m] rounding of the LP solver: closer starts may be judged either way


@dataclass(frozen=True)
class Comparison:
    """Both methods on one model and scene.

    regions, measured: all, and those timed with LPs. reachable: cells with a non-empty reach set.
    lp_s: [s] for all regions, scaled up; lp_error_s: two standard errors. lean_s: [s] the same
        programs with nothing around the solver; solver_s: [s] what the solver reports of that.
    free_s: (repeats,) [s]
        LP-free. unknown: undecided LPs.
    judged, contradictions: starts judged by both, and those on which they differ beyond BAND.
    """

    regions: int
    measured: int
    reachable: int
    lp_s: float
    lp_error_s: float
    lean_s: float
    solver_s: float
    free_s: np.ndarray
    compile_s: float
    unknown: int
    judged: int
    contradictions: int


def compare(model: TrajectoryModel, problem: Problem, bench: Bench, starts: int = 0) -> Comparison:
    """Time both methods. starts: per measured region, judged by both (slow)."""
    parts = Partition(model, enumerate_regions(model.net, model.domain))
    scene = paper_scene(problem, model.tube)
    free_done = timed(lambda: all_sets(parts.cells, scene), bench.size(7, 1))
    sets = free_done.result
    rng, count = np.random.default_rng(0), len(parts.regions)
    tenth = rng.permutation(count)[: min(count, bench.size(max(10, -(-count // 10)), 2))]
    tally = Tally()
    spent: list[float] = []
    programs: list[LinearProgram] = []
    judged = differ = 0
    for number in tenth:
        with recorded() as asked:
            begin = time.perf_counter()
            found = [(cell, *_by_lp(cell, scene, tally)) for cell in parts.regions[number]]
            spent.append(time.perf_counter() - begin)
        programs += asked
        for cell, omega, avoid_sets in found:
            if starts and int(omega.status) == int(LPStatus.FEASIBLE):
                at = parts.number[int(cell.region), int(cell.bin)]
                some = _judge(sets, at, scene, omega, avoid_sets, starts)
                judged, differ = judged + some[0], differ + some[1]
    lean = solve_lean(programs)
    scale = count / len(tenth)
    spent = np.array(spent)
    error = 2 * spent.std(ddof=1) / np.sqrt(len(spent)) * count if 1 < len(spent) < count else 0.0
    return Comparison(
        count,
        len(tenth),
        len(sets.live),
        float(spent.mean() * count),
        float(error),
        lean.seconds * scale,
        lean.solver_seconds * scale,
        free_done.warm,
        free_done.compile_s,
        tally.unknown,
        judged,
        differ,
    )


def _by_lp(cell, scene: PaperScene, tally: Tally):
    """Reach set and avoid sets of one cell, as published."""
    omega = reach_by_lp(cell, scene)
    alive = int(omega.status) == int(LPStatus.FEASIBLE)
    return omega, avoid_by_lp(cell, omega, scene, tally) if alive else []


def _judge(
    sets: AllSets, number: int, scene: PaperScene, omega, avoid_sets, n: int
) -> tuple[int, int]:
    """Draw n points of one Omega; how many, and on how many starts the two methods contradict each
    other.
    """
    keys, inner = jax.random.PRNGKey(number)[None], np.nan_to_num(omega.inner)[None]
    drawn = sample_polytopes(keys, omega.A[None], omega.b[None], inner, n, 16)
    p0 = drawn[0, :, : scene.n_p]
    by_lp = safe_by_lp(p0, avoid_sets, Tally())
    numbers, polygons, clear = next(entry for entry in sets.avoid if number in entry[0])
    row = np.flatnonzero(numbers == number)
    touching = scene.grown.active.T & ~clear[row[0]]
    room = np.where(touching, margins(rows_of(polygons, row), p0[None])[0], np.inf).min(axis=(1, 2))
    return n, int(((by_lp & (room < -BAND)) | (~by_lp & (room > BAND))).sum())


def metrics_of(key: str, c: Comparison) -> list[Metric]:
    """All numbers of one comparison."""
    return [
        *times(f"{key}.lp_free", c.free_s),
        metric(f"{key}.lp", c.lp_s, "s", "lower", rel_tol=1.0),
        metric(f"{key}.lp_free.compile", c.compile_s, "s", "lower", rel_tol=1.0, abs_tol=1.0),
        ratio(f"{key}.ratio", c.lp_s, float(np.median(c.free_s))),
        metric(f"{key}.lean_lp", c.lean_s, "s", "lower", rel_tol=1.0),
        metric(f"{key}.lean_lp.solver", c.solver_s, "s", "lower", rel_tol=1.0),
        ratio(f"{key}.lean_ratio", c.lean_s, float(np.median(c.free_s))),
        ratio(f"{key}.solver_ratio", c.solver_s, float(np.median(c.free_s))),
        metric(f"{key}.unknown", c.unknown, "count", "lower"),
    ]


def run(bench: Bench) -> Result:
    """The saved drift model: under its own tube of many bins, and under its widest errors in a
    single bin.
    """
    case, model = bench.model()
    metrics, rows = [], []
    for name, one in (("one_bin", one_bin(model)), ("bins", model)):
        c = compare(one, case.problem(), bench, starts=bench.size(4, 2) if name == "one_bin" else 0)
        metrics += [*metrics_of(f"bras.{name}", c), exact(f"bras.{name}.regions", c.regions)]
        if name == "one_bin":
            metrics.append(exact("bras.contradictions", c.contradictions))
        free = np.median(c.free_s)
        rows.append(
            (
                name.replace("_", " "),
                str(c.regions),
                str(c.reachable),
                f"{c.lp_s:.3g} ± {c.lp_error_s:.2g} s",
                f"{c.measured} of {c.regions}",
                f"{c.lean_s:.3g} s",
                milliseconds(free),
                f"{c.lp_s / free:,.0f}",
                f"{c.lean_s / free:,.0f}",
                f"{c.solver_s / free:,.0f}",
            )
        )
    header = (
        "tube",
        "regions",
        "cells that reach",
        "with LPs",
        "timed",
        "lean LPs",
        "LP-free, median",
        "times faster",
        "than lean LPs",
        "than the solver's own seconds",
    )
    note = (
        "One bin: the median over bins of the saved tube's errors. With bins, regions "
        "are cut into more cells."
    )
    return Result(metrics, [Table("BRS and BAS of all regions, drift 4x8", header, rows, note)])


def one_bin(model: TrajectoryModel) -> TrajectoryModel:
    """The model with a single bin that has the median errors of its bins: for timing only, its
    claim is void.
    """
    from parc_jax.learning.bound.declared import stand_in
    from parc_jax.learning.bound.tube import tube

    t = model.tube
    edges = [np.array([e[0], e[-1]]) for e in t.edges]
    middle = [np.median(a, axis=0, keepdims=True) for a in (t.interval, t.final)]
    return model.replace(claim=stand_in(model.claim, tube(edges, *middle)))
