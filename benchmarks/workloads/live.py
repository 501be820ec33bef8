"""The page of `live` without a browser: the drift-parking car with four corners, from the model
that comes along, among 1, 8 and 64 obstacles.

A drag moves one obstacle at random within a metre, or the goal, and waits for 32 safe plans and
all that the body passes on them. A release measures the set, and names what is in the way; closed:
with the two parked cars too near to each other. Processor time of this process (all threads), 95 %:
of all drags of a row. Programs: what the compiler is asked for after the page has opened.
"""

import time

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric
from benchmarks.result import Result, Table, milliseconds
from benchmarks.workloads.clutter import _compiled
from parc_jax.app.live import Live, swept
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import Problem, reach_avoid

COUNTS = (1, 8, 64)
SIDE = 0.3  # [m] of further obstacles
AWAY = (3.0, 9.0)  # [m] from the way of the nearest of some plans, where they stand
ABOUT = 1.0  # [m] of a drag
CLOSED = 1.2  # [m] by which one parked car is moved towards the other


def among(n: int, seed: int = 0) -> Problem:
    """The parking scene with one parked car, or both and n - 2 small obstacles beside the way."""
    import sims

    problem = sims.drift_parking.problem("rectangle")
    plans = Live(sims.model("drift_parking"), problem, seed=seed).draw()
    way = swept(plans.scene, plans.plans)[2][:, :, :2].reshape(-1, 2)
    rng = np.random.default_rng(seed)
    at = rng.uniform(way.min(axis=0) - AWAY[1], way.max(axis=0) + AWAY[1], (40 * COUNTS[-1], 2))
    far = np.linalg.norm(at[:, None] - way, axis=2).min(axis=1)
    at = at[(AWAY[0] < far) & (far < AWAY[1])][: max(n - 2, 0)]
    more = [box(x - SIDE / 2, x + SIDE / 2) for x in at]
    return reach_avoid(problem.goal, [*problem.obstacles[: min(n, 2)], *more], problem.body)


def run(bench: Bench) -> Result:
    """Drag and release among ever more obstacles."""
    import sims

    model = sims.model("drift_parking")
    metrics, rows = [], []
    for n in bench.size(COUNTS, (1,)):
        live = Live(model, among(n))
        live.warm_up()  # as the page does before it opens
        before, rng = len(_compiled), np.random.default_rng(1)
        drags, plans, releases = [], [], []
        names = [name for name in live.grips if name != "start"]
        for _ in range(bench.size(60, 3)):
            name = names[rng.integers(len(names))]
            live.move(name, live.grips[name].middle + rng.uniform(-ABOUT, ABOUT, 2))
            begin = time.process_time()
            drawn = live.draw()
            swept(drawn.scene, drawn.plans)
            drags.append(time.process_time() - begin)
            plans.append(len(drawn.plans))
            live.move(name, live.grips[name].middle)
        for _ in range(bench.size(10, 1)):
            name = names[rng.integers(len(names))]
            live.move(name, live.grips[name].middle + rng.uniform(-ABOUT, ABOUT, 2) / 4)
            releases.append(spent(live))
            live.move(name, live.grips[name].middle)
        shut = []
        if n > 1:
            car = live.grips["obstacle 0"]
            for more in np.linspace(0, 1, bench.size(5, 1)):
                live.move("obstacle 0", car.middle + np.array([CLOSED + more, 0.0]))
                shut.append(spent(live))
        programs = len(_compiled) - before
        middle, worst = np.median(drags), np.quantile(drags, 0.95)
        told = [milliseconds(s) for s in (middle, worst, np.median(releases), max(releases))]
        told.append(milliseconds(max(shut)) if shut else "")
        rows.append((f"{n}", f"{np.median(plans):g}", *told, f"{programs}"))
        key = f"live.{n}"
        metrics.append(metric(f"{key}.drag_95", worst, "s", "lower", rel_tol=0.5, abs_tol=5e-3))
        slowest = max([*releases, *shut])
        metrics.append(metric(f"{key}.release", slowest, "s", "lower", rel_tol=0.5, abs_tol=0.05))
        metrics.append(exact(f"{key}.programs", programs))
    header = ("obstacles", "plans", "drag", "95 %", "release", "slowest", "closed", "programs")
    return Result(metrics, [Table("A scene that is dragged", header, rows)])


def spent(live: Live) -> float:
    """Processor time [s] of a release."""
    begin = time.process_time()
    live.settle()
    return time.process_time() - begin
