"""What a body and a fitted tube cost: the drift model with its disc and with a rectangle of four
points, its tube as boxes and between fitted faces (four pairs, six bases each).

Processor time of this process; the four take turns with the same seeds, and ratios are medians over
them. The rectangle does not turn and its points share the disc's tube: the same network, safe sets
nearly the same, four points for one. Compiling is over before anything counts.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import metric
from benchmarks.result import Result, Table
from benchmarks.shaped import as_rectangle, fitted, processor_times

AGAINST = (("rectangle", "disc"), ("disc_fitted", "disc"), ("rectangle_fitted", "rectangle"))


def run(bench: Bench) -> Result:
    """Query the drift scene with every body and tube."""
    case, model = bench.model()
    shaped, problem = as_rectangle(model, case.problem("disc"))
    scenes = {
        "disc": (model, case.problem("disc")),
        "rectangle": (shaped, problem),
        "disc_fitted": (fitted(model), case.problem("disc")),
        "rectangle_fitted": (fitted(shaped), problem),
    }
    if bench.quick:
        scenes = {name: scenes[name] for name in ("disc", "rectangle")}
    found = processor_times(scenes, bench.size(15, 2), bench.size(3, 1))
    rows = [
        (name, *(f"{1e3 * np.median(found[name][what]):.3g} ms" for what in range(2)))
        for name in scenes
    ]
    metrics = []
    for name, base in AGAINST:
        for what, label in enumerate(("first_sample", "corridors")):
            if name in found:
                times = np.median(found[name][what] / found[base][what])
                key = f"bodies.{label}.{name}_by_{base}"
                metrics.append(metric(key, times, "x", "lower", rel_tol=0.5))
    return Result(metrics, [Table("Bodies and tubes", ("", "first sample", "corridors"), rows)])
