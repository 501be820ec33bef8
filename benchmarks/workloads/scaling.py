"""How cost grows as work grows: obstacles, horizon, parameters, neurons, rareness of safe plans.

Robots that bend arcs through a random network, between two blocks (`benchmarks/arcs.py`); for rare
plans straight lines through a slit. Of each: processor time until corridors are certified to hold
99 % of the safe set, with confidence 99 %, of the exact proof of these corridors and 20 samples,
and of the checker over the file. Medians over three seeds; a query of the same size has compiled
before. A curve's power is the slope between its ends, both axes logarithmic.
"""

import time
from typing import NamedTuple

import numpy as np

from benchmarks.arcs import bending_arcs, between_blocks
from benchmarks.bench import Bench
from benchmarks.curves import line
from benchmarks.metrics import exact, metric
from benchmarks.result import Result, Table
from benchmarks.workloads.rare import lines, slit, whole
from parc_jax import checker
from parc_jax.answer.answer import answer_data
from parc_jax.learning.model import TrajectoryModel
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem
from parc_jax.proof.certificate.prove import prove
from parc_jax.safe_set.settings import Settings

SEEDS = 3
WIDE = (64, 64)  # neurons, where parameters are counted
SMALL = (16, 16)  # elsewhere
BINS = (4, 4)  # of the tube, along the first two axes of K


class Point(NamedTuple):
    """One point of a curve: how much work, and the medians [s] of what it cost."""

    work: float
    corridors_s: float
    proof_s: float
    check_s: float
    corridors: int
    missed: int


class Curve(NamedTuple):
    """name: in keys. along: of the axis, with unit. scenes: (work, model, problem); no work is
    known of the last curve before it is measured.
    """

    name: str
    along: str
    scenes: list[tuple[float | None, TrajectoryModel, Problem]]


def run(bench: Bench) -> Result:
    """One curve after another."""
    metrics, rows, data = [], [], {}
    for curve in _curves(bench):
        points = [
            _measured(work, Planner(model), problem, bench) for work, model, problem in curve.scenes
        ]
        power = _power(points)
        metrics += [
            metric(f"scaling.{curve.name}.power", power, "1", "lower", abs_tol=0.5),
            metric(f"scaling.{curve.name}.most", points[-1].corridors_s, "s", "lower", rel_tol=1.0),
            exact(f"scaling.{curve.name}.missed", sum(p.missed for p in points)),
        ]
        for p in points:
            costs = (p.corridors_s, p.proof_s, p.check_s)
            shown = [f"{seconds:.2g} s" for seconds in costs]
            rows.append((curve.along, f"{p.work:.4g}", *shown, str(p.corridors)))
        data[curve.name] = {"along": curve.along, "points": [p._asdict() for p in points]}
    header = ("along", "work", "corridors", "proof", "check", "corridors built")
    return Result(metrics, [Table("How cost grows", header, rows)], data)


def _curves(bench: Bench) -> list[Curve]:
    """What is made larger, one thing at a time."""

    def sizes(*full):
        return full if not bench.quick else full[:2]

    base = between_blocks()
    n_k = [(n, bending_arcs(n, WIDE, bins=BINS), base) for n in sizes(2, 4, 6, 8)]
    width = [(n, bending_arcs(4, (n, n)), base) for n in sizes(8, 16, 32, 64, 128)]
    horizon = [
        (T, bending_arcs(2, SMALL, n_steps=T), base) for T in sizes(25, 50, 100, 200, 400, 1000)
    ]
    robot = bending_arcs(2, SMALL)
    obstacles = [(2 + n, robot, between_blocks(more=n)) for n in sizes(0, 6, 14, 30)]
    through = lines()
    rare = [(None, through, slit(half)) for half in sizes(0.03, 3e-3, 3e-4, 3e-5)]
    return [
        Curve("parameters", "parameters, 2 x 64 neurons, 16 bins", n_k),
        Curve("neurons", "neurons a layer, two layers", width),
        Curve("horizon", "intervals", horizon),
        Curve("obstacles", "obstacles near the way", obstacles),
        Curve("rareness", "plans for one that is safe", rare),
    ]


def _measured(work, planner: Planner, problem: Problem, bench: Bench) -> Point:
    """Medians over seeds. work: None for one over the share that is safe."""
    settings = Settings(samples=20, target=bench.size(0.01, 0.5), proof=False)
    planner.solve(problem, bench.key(99), settings)
    spent, missed = [], 0
    for seed in range(bench.size(SEEDS, 1)):
        begin = time.process_time()
        answer = planner.solve(problem, bench.key(seed), settings)
        found = time.process_time()
        parts, asked = answer.certificates, answer.scene.problem
        accepted = prove(asked, answer.model, parts, answer.corridors)
        proved = time.process_time()
        checker.check_answer(answer_data(answer))
        spent.append((found - begin, proved - found, time.process_time() - proved))
        missed += answer.coverage.at_least < 1 - settings.target
        missed += int(sum((~kept).sum() for kept in accepted))
    if work is None:
        share = answer.share
        work = whole() / share.volume[0] if share is not None and share.share else float("nan")
    return Point(float(work), *np.median(spent, axis=0).tolist(), len(answer.corridors), missed)


def _power(points: list[Point]) -> float:
    """Slope of the cost of corridors between the ends of a curve."""
    first, last = points[0], points[-1]
    return float(np.log(last.corridors_s / first.corridors_s) / np.log(last.work / first.work))


def figure(data: dict, path) -> None:
    """One panel per curve."""
    from parc_jax.app.plot import style

    kinds = (("corridors_s", "corridors"), ("proof_s", "proof"), ("check_s", "check of the file"))
    with style.sheet(path, (9.6, 2.6), 1, len(data), sharey=True) as sheet:
        for ax, curve in zip(sheet.axes, data.values(), strict=True):
            work = [p["work"] for p in curve["points"]]
            for number, (kind, name) in enumerate(kinds):
                cost = [p[kind] for p in curve["points"]]
                ax.plot(work, cost, marker="o", markersize=3, label=name, **line(number))
            ax.set(xscale="log", yscale="log", title=curve["along"].split(",")[0])
            some = [work[0], work[len(work) // 2], work[-1]]
            ax.set_xticks(some, [f"{w:.0f}" if w < 1e4 else f"{w:.0e}" for w in some])
            ax.set_xticks([], minor=True)
            ax.grid(True)
        sheet.axes[0].set_ylabel("processor time [s]")
        style.legend(sheet.figure, sheet.axes[0].lines, len(kinds))
