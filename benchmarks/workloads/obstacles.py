"""What obstacles cost that no plan comes near: 2 to 1,000 boxes far away, added to the drift scene.

Processor time of this process, so that other work on the machine counts little; all scenes take
turns with the same seeds, and what is reported are medians of ratios to the scene without. A query
lays its scene out anew. First sample: one draw, until a plan is safe. Corridors: until they are
certified to hold 99 % of the safe set.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric
from benchmarks.result import Result, Table
from benchmarks.shaped import far_away, processor_times

FAR = (2, 8, 20, 50, 100, 300, 1000)


def run(bench: Bench) -> Result:
    """Query the drift scene with ever more obstacles far away."""
    case, model = bench.model()
    counts = bench.size(FAR, (2, 100))
    scenes = {0: (model, case.problem())}
    scenes |= {n: (model, far_away(case.problem(), n)) for n in counts}
    found = processor_times(scenes, bench.size(25, 2), bench.size(5, 1))
    metrics, rows = [], []
    for n in scenes:
        first, corridors = (np.median(found[n][what] / found[0][what]) for what in range(2))
        rows.append(
            (
                f"{n:,}",
                *(f"{1e3 * np.median(found[n][what]):.3g} ms" for what in range(2)),
                f"{first:.2f}",
                f"{corridors:.2f}",
            )
        )
        if n:
            wide = {"rel_tol": 0.5}
            metrics.append(metric(f"obstacles.first_sample.{n}", first, "x", "lower", **wide))
            metrics.append(metric(f"obstacles.corridors.{n}", corridors, "x", "lower", **wide))
    alike = {tuple(found[n][2]) for n in scenes}
    metrics.append(exact("obstacles.other_answers", len(alike) - 1))
    header = ("far obstacles", "first sample", "corridors", "ratio", "ratio")
    curve = {
        "far": [int(n) for n in scenes],
        "first_s": [float(np.median(found[n][0])) for n in scenes],
        "corridors_s": [float(np.median(found[n][1])) for n in scenes],
    }
    return Result(metrics, [Table("Obstacles far away", header, rows)], curve)
