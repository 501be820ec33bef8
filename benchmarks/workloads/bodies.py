"""What a body and a fitted tube cost: the drift model with its disc and with a rectangle of four
points, its tube as boxes and between fitted faces (four pairs, six bases each).

Processor time of this process; the four take turns with the same seeds, and ratios are medians over
them: a first plan, corridors to 99 %, a scene of a batch, the exact proof of a plan. The rectangle
does not turn and its points share the disc's tube: the same network, safe sets nearly the same,
four points for one. Compiling is over before anything counts.
"""

import time

import numpy as np

from benchmarks.bench import Bench
from benchmarks.cases import Case
from benchmarks.metrics import metric
from benchmarks.result import Result, Table
from benchmarks.shaped import as_rectangle, fitted, processor_times
from benchmarks.workloads import batch_query
from parc_jax.planner import Planner
from parc_jax.safe_set.settings import Settings

LABELS = ("first_sample", "corridors", "batch_scene", "proof")
BATCH = 256  # scenes
PROOFS = 16  # plans
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
    batches = processor_times_of_batches(bench, case, scenes)
    for name in scenes:
        found[name] = (*found[name][:2], *batches[name])
    rows = [
        (name, *(f"{1e3 * np.median(times):.3g} ms" for times in found[name])) for name in scenes
    ]
    metrics = []
    for name, base in AGAINST:
        for what, label in enumerate(LABELS):
            if name in found:
                times = np.median(found[name][what] / found[base][what])
                key = f"bodies.{label}.{name}_by_{base}"
                metrics.append(metric(key, times, "x", "lower", rel_tol=0.5))
    head = ("", *(label.replace("_", " ") for label in LABELS))
    return Result(metrics, [Table("Bodies and tubes", head, rows)])


def processor_times_of_batches(bench: Bench, case: Case, scenes: dict) -> dict:
    """Of named (model, problem), by turns: processor times [s] of a scene of a batch and of the
    exact proof of a plan, (n,) each.
    """
    n_scenes = bench.size(BATCH, 8)
    n_proofs = bench.size(PROOFS, 2)
    fast = Settings.fast().replace(samples=1)
    asked = {}
    for name, (model, problem) in scenes.items():
        many, few = (batch_query.scenes(case, model, n, problem) for n in (n_scenes, n_proofs))
        asked[name] = Planner(model), many, few
        asked[name][0].solve_batch(many, bench.key(), fast)  # compiles
        asked[name][0].solve_batch(few, bench.key(), fast.replace(proof=True))
    out: dict = {name: ([], []) for name in scenes}
    for _ in range(bench.size(5, 1)):
        for name, (planner, many, few) in asked.items():
            begin = time.process_time()
            planner.solve_batch(many, bench.key(), fast)
            out[name][0].append((time.process_time() - begin) / n_scenes)
            begin = time.process_time()
            found = planner.solve_batch(few, bench.key(), fast)
            searched = time.process_time()
            proved = planner.solve_batch(few, bench.key(), fast.replace(proof=True))
            spent = time.process_time() - searched - (searched - begin)
            assert proved.proved.sum() == found.found.sum()
            out[name][1].append(spent / max(1, proved.found.sum()))
    return {name: tuple(np.array(x) for x in lists) for name, lists in out.items()}
