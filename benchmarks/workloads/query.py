"""One query to a model in memory, over many seeds: first safe sample, first corridor, 99 % of the
safe set by corridors; and the first safe plan of a problem that is laid out.

Every query starts from nothing but the model: the scene is laid out anew, and that is part of all
three times. Warm: one query has run before; the first query's compile time is reported apart. 99 %
means that a fresh draw proves, with confidence 99 %, that at most 1 % of the model's safe set is
left out. The last query is proved in exact arithmetic.

Prepared: the problem is laid out once, and every call asks for one safe plan with another key, as a
loop that replans does; `new_scene` lays the problem out anew each time, `proved` also proves the
plan. These three are CPU seconds, one way after the other, as a loop makes its calls.
"""

import time

import jax

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric, times
from benchmarks.result import Result
from benchmarks.timing import timed
from parc_jax.planner.planner import Planner
from parc_jax.problem.problem import ReachAvoid
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.scene import scene_of

SEEDS = {"cpu": 100, "gpu": 20}  # on a GPU in the time that `gpu.sh` has


def run(bench: Bench) -> Result:
    """Query the drift scene with one seed after another."""
    case, model = bench.model()
    planner, problem = Planner(model), case.problem()
    options = {"target": bench.size(0.01, 0.5), "proof": False}
    cold = timed(lambda: planner.solve(problem, bench.key(1), Settings(**options)) and None, 0)
    first, corridor, corridors, none_found, missed = [], [], [], 0, 0
    for seed in range(bench.size(SEEDS[bench.platform], 2)):
        begin = time.perf_counter()
        scene_of(problem, model)
        layout = time.perf_counter() - begin
        answer = planner.solve(problem, bench.key(seed + 2), Settings(**options))
        if not answer.status.found:
            none_found += 1
            continue
        first.append(layout + answer.cover.timings["first_sample_s"])
        corridor.append(layout + answer.cover.timings["first_corridor_s"])
        corridors.append(layout + answer.cover.timings["corridors_s"])
        missed += answer.coverage.at_least < 1 - options["target"]
    proved = planner.solve(
        problem,
        bench.key(1),
        Settings(**options | {"proof": True, "samples": bench.size(100, 5)}),
    )
    prepared = replanning(planner, problem, bench.size(300, 3))
    safe_of_reaching = answer.cover.safe / answer.cover.reaching
    return Result(
        [
            *times("query.first_sample", first),
            *times("query.first_corridor", corridor),
            *times("query.corridors_cover", corridors),
            *times("query.prepared", prepared["prepared"]),
            *times("query.prepared_new_scene", prepared["new_scene"]),
            *times("query.prepared_proved", prepared["proved"]),
            exact("query.prepared_none_found", prepared["none_found"]),
            metric("query.compile", cold.compile_s, "s", "lower", rel_tol=1.0, abs_tol=1.0),
            metric("query.cold", cold.cold_s, "s", "lower", rel_tol=1.0, abs_tol=1.0),
            exact("query.none_found", none_found),
            exact("query.short_of_target", missed),
            metric("query.safe_of_reaching", safe_of_reaching, "1", "same", abs_tol=0.02),
            metric("query.corridors", float(len(answer.corridors)), "count", "lower", rel_tol=0.5),
            metric("query.proof", proved.cover.timings["proof_s"], "s", "lower", rel_tol=0.5),
            exact("query.refused_by_checker", proved.cover.refused),
        ]
    )


def replanning(planner: Planner, problem: ReachAvoid, n: int) -> dict:
    """CPU seconds (n,) of a plan each: from what is laid out, from a new scene, proved as well."""
    prepared = planner.prepare(problem)
    one = Settings(samples=1, samples_only=True)
    keys = [jax.random.PRNGKey(seed) for seed in range(n)]
    found = []
    ways = {
        "prepared": lambda key: found.append(len(prepared.first(key).plans)),
        "new_scene": lambda key: planner.prepare(problem).first(key),
        "proved": lambda key: prepared.solve(key, one),
    }
    spent = {name: [] for name in ways}
    for call in ways.values():
        call(keys[0])
    found.clear()
    for name, call in ways.items():
        for key in keys:
            begin = time.process_time()
            call(key)
            spent[name].append(time.process_time() - begin)
    return spent | {"none_found": n - sum(found)}
