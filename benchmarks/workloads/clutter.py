"""What obstacles near the way cost: 0 to 128 boxes of 0.1 m, 0.75 to 2 m around the start of a
rectangle that turns.

The Jackal's kinematic twin, learned in this run: five points, twelve intervals, 36 bins, an assumed
tube; two of its four parameters are measured at the start. It may come to rest anywhere, turned by
as much as it can. Processor time of this process for sixteen plans. Plain: from one place, any
speeds at the start; from here: from a pose with a heading, speeds as measured. Briefly: as plain,
each box there during one interval alone. Moving: as plain, boxes that go round the start at 0.5
m/s, each told as twelve obstacles, one an interval. Prepared: the scene is laid out once, and every
call has another key. New scene: it is laid out anew each time, by turns with the others. `near`:
obstacles that are not proved apart from every plan. Programs: what the compiler is asked for by the
first scene of so many obstacles, after those before it. Corridors: seconds until they cover 99 %
of the safe set among so many boxes, compiled, in the plain scene.
"""

import time

import jax
import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric, times
from benchmarks.result import Result, Table
from parc_jax.common.keys import Stage, stream
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.train import train
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.system import TimeGrid
from parc_jax.planner.planner import Planner
from parc_jax.problem.doubt import FREE, Doubt
from parc_jax.problem.problem import ReachAvoid, reach_avoid
from parc_jax.problem.world.moving import moving
from parc_jax.safe_set.settings import Settings

COUNTS = (0, 1, 4, 8, 16, 32, 64, 128)
PLANS = 16
BINS = (3, 3, 2, 2)
RING = (0.75, 2.0)  # [m] from the start to the middle of a box
SIZE = 0.1  # [m] of a box
GOAL = ((-3.0, -3.0, -4.0), (3.0, 3.0, 4.0))  # [m, m, rad] wherever it comes to rest
SPEEDS = {"speed at the start": 1.0, "turning at the start": 0.2}  # [m/s], [rad/s]
HERE, POSE = (0.0, 0.0), (0.0, 0.0, 0.3)  # [m], [m, m, rad]
WAYS = {"plain": HERE, "from_here": POSE, "briefly": HERE, "moving": HERE}
ROUND = 0.5  # [m/s] of boxes that move
COVERED = 64  # boxes among which corridors are looked for
COMPILED = "backend_compile_duration"

_compiled: list[str] = []
jax.monitoring.register_event_duration_secs_listener(
    lambda event, seconds, **_: _compiled.append(event) if event.endswith(COMPILED) else None
)


def turning(bench: Bench) -> TrajectoryModel:
    """The model of the twin."""
    import sims

    runs, steps = bench.size((4_096, 2_000), (256, 20))
    data = collect(
        sims.load("jackal", plant="twin"), bench.key(), runs, Stage.TRAIN, chunk=256, quiet=True
    )
    net = train(data, (8, 8), key=stream(bench.key(), Stage.FIT), seeds=1, steps=steps)
    return trajectory_model(net, assumed_claim(net, data, bench.size(BINS, (1, 1, 1, 1))))


def cluttered(n: int, way: str, grid: TimeGrid, seed: int = 0) -> ReachAvoid:
    """n boxes around the start, the first of them the same for every n."""
    from sims.rectangle import goal_of_centre, rectangle

    rng = np.random.default_rng(seed)
    angle, away = rng.uniform(0, 2 * np.pi, 128), rng.uniform(*RING, 128)
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    boxes = [box(at - SIZE / 2, at + SIZE / 2) for at in (away[:, None] * out)[:n]]
    spans = None
    if way == "briefly":
        spans = [(i % grid.n_steps,) * 2 for i in range(n)]
    if way == "moving":
        every, last = (grid.n_steps, (0, grid.n_steps - 1))
        velocities = ROUND * np.stack([-out[:, 1], out[:, 0]], axis=1)
        movers = zip(boxes[: -(-n // every)], velocities, strict=False)
        told = [moving(one, v, last, grid.dt) for one, v in movers]
        boxes = [place for places, _ in told for place in places][:n]
        spans = [span for _, each in told for span in each][:n]
    doubt = Doubt(given=SPEEDS if way == "from_here" else dict.fromkeys(SPEEDS, FREE))
    return reach_avoid(goal_of_centre(*GOAL), boxes, rectangle(), doubt=doubt, spans=spans)


def run(bench: Bench) -> Result:
    """Ask among ever more obstacles, in each way."""
    planner, counts = Planner(turning(bench)), bench.size(COUNTS, (0, 4, 16))
    grid = planner.model.time
    metrics, rows, curve = [], [], {"obstacles": list(counts)}
    for way, at in WAYS.items():
        scenes = {n: (cluttered(n, way, grid), at) for n in counts}
        near, programs = {}, {}
        for n, (problem, place) in scenes.items():
            before = len(_compiled)
            prepared = planner.prepare(problem, at=place)
            prepared.first(bench.key(), PLANS)
            near[n], programs[n] = int(prepared.scene.count), len(_compiled) - before
        spent = processor_times(planner, scenes, bench.size(40, 2))
        for n in counts:
            known, new = (float(np.median(seconds)) for seconds in spent[n][:2])
            found = float(np.median(spent[n][2]))
            told = (f"{1e3 * seconds:.2f} ms" for seconds in (known, new))
            rows.append((way, f"{n}", f"{near[n]}", f"{found:g}", *told, f"{programs[n]}"))
            for name, seconds in (("prepared", known), ("new_scene", new)):
                key = f"clutter.{way}.{name}.{n}"
                metrics.append(metric(key, seconds, "s", "lower", rel_tol=0.5, abs_tol=1e-3))
        curve[way] = {
            name: [float(np.median(spent[n][i])) for n in counts]
            for i, name in enumerate(("prepared_s", "new_scene_s"))
        }
        between = sum(programs[n] for n in counts[1:])
        metrics.append(exact(f"clutter.{way}.programs", between))
    covered = bench.size(COVERED, 4)
    seconds, share = corridors(planner, cluttered(covered, "plain", grid), bench.size(5, 1))
    metrics += times(f"clutter.corridors.{covered}", seconds)
    metrics.append(metric("clutter.corridors.cover", share, "1", "higher", abs_tol=0.01))
    header = ("asked", "obstacles", "near", "plans", "prepared", "new scene", "programs")
    return Result(metrics, [Table("Obstacles near the way", header, rows)], curve)


def corridors(planner: Planner, problem: ReachAvoid, n: int) -> tuple[list[float], float]:
    """Seconds (n,) that corridors take, each time with another key, and the least share of the safe
    set that they cover.
    """
    settings = Settings(samples=PLANS, proof=False)
    planner.warm_up(problem, settings, at=HERE)
    seconds, shares = [], []
    for seed in range(n):
        begin = time.perf_counter()
        answer = planner.solve(problem, jax.random.PRNGKey(seed), settings, at=HERE)
        seconds.append(time.perf_counter() - begin)
        shares.append(answer.coverage.at_least)
    return seconds, min(shares)


def processor_times(planner: Planner, scenes: dict, n: int) -> dict:
    """Of named (problem, place), by turns: processor times [s] of plans of a prepared scene (n,)
    and of a new one (n,), and how many plans the new ones have (n,).
    """
    prepared = {name: planner.prepare(problem, at=at) for name, (problem, at) in scenes.items()}
    out = {name: ([], [], []) for name in scenes}
    for seed in range(n):
        key = jax.random.PRNGKey(seed)
        for name, (problem, at) in scenes.items():
            begin = time.process_time()
            prepared[name].first(key, PLANS)
            middle = time.process_time()
            found = planner.prepare(problem, at=at).first(key, PLANS)
            end = time.process_time()
            for values, value in zip(
                out[name], (middle - begin, end - middle, len(found.plans)), strict=True
            ):
                values.append(value)
    return out
