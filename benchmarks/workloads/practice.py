"""One scene by the ways of practice: starts from which some manoeuvre parks the car, and a plan
from each by every method, driven in the simulator.

Nav2's way, inflation and sampling as its MPPI does it: candidates scored on the nominal path, the
obstacles inflated, costs that fall off behind (its defaults: 2,000 candidates, temperature 0.3,
cost scaling 3); a softmin-weighted mean, around which the next round is drawn; of all that were
scored the cheapest one is driven. A manoeuvre of drifting cannot be planned anew on its way, so all
rounds come before it; the nominal path is parc_jax's own network, without its tube. A row for each
radius by which obstacles grow beyond the body. RTD's way: a nominal parameterised model,
polynomials of k fitted to runs, and the largest error of these runs at each time for all of K; of
2,000 plans whose reachable set meets no obstacle and ends in the goal the one with most clearance
is driven (RTD minimises a cost under these constraints). NeuralPARC as published: of the same 2,000
one that lies in no avoid set of its cell, by parc_jax's network and tube, which flatters it.
parc_jax: of the same the one with most clearance inside its tube.

A start is where a random run that parks began, so that a plan exists from each. The simulator of
this plant draws no noise: one run tells whether a plan touches or misses. Seconds are of the
processor, compiling apart.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric
from benchmarks.published import Partition, kept
from benchmarks.result import Result, Table, milliseconds
from parc_jax.common.keys import Stage
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.runs.collect import collect, stream_rollouts
from parc_jax.problem.problem import Problem, box_of_rows, goal_box
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.verdict.outcomes import reached_and_touched
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene, scene_of

SLACKS = (1.83, 0.91)  # [m] between circle and cars: as published, and narrower
RADII = (0.0, 0.1, 0.2, 0.3, 0.5, 0.8)  # [m] of inflation beyond the body
STARTS, CANDIDATES = 100, 2000
TRAINING = 10_240  # runs of RTD's nominal model and its error: as many as the network was made of
TRIED = 2560  # runs of which those that park give the starts
ROUNDS, TEMPERATURE, COST_SCALING = 5, 0.3, 3.0
SPREAD = 0.2  # [half sides of K] of MPPI's later rounds
DEGREE = 6  # of the polynomials
BETWEEN = 2  # places of a path that are looked at per interval: every 0.05 s, as Nav2 does


class Method(NamedTuple):
    """pick: (scene, start (2,), candidates (n, n_k)) -> parameters (n_k,), None for no plan."""

    key: str
    name: str
    promise: str
    pick: Callable[[Scene, np.ndarray, np.ndarray], np.ndarray | None]
    before: float = 0.0  # [s] once for a model, runs not counted


def run(bench: Bench) -> Result:
    """All methods from the same starts."""
    case, model = bench.model()
    system = case.system()
    train = collect(
        system, bench.key(), bench.size(TRAINING, 256), Stage.TRAIN, chunk=256, quiet=True
    )
    pool = collect(
        system, bench.key(1), bench.size(TRIED, 256), Stage.REPLAY, chunk=256, quiet=True
    )
    metrics, tables = [], []
    for slack in bench.size(SLACKS, SLACKS[:1]):
        problem = case.narrowed(slack)
        scene = scene_of(problem, model)
        starts = _starts(scene, pool, bench.size(STARTS, 4))
        methods = [*_inflated(model, bench), _rtd(train), _published(model), _ours(model)]
        rows = []
        for method in methods:
            found, spent = _plans(method, scene, starts, bench)
            reached, touched = _driven(system, scene, starts, found, bench)
            n = len(found)
            label = f"practice.slack_{slack:g}.{method.key}"
            plans = metric(f"{label}.found", len(found), "count", "higher", abs_tol=2)
            bad = metric(f"{label}.touched", touched.sum(), "count", "lower", abs_tol=2)
            missed = metric(f"{label}.missed", (~reached).sum(), "count", "lower", abs_tol=2)
            metrics += [plans, bad, missed]
            metrics.append(metric(f"{label}.cpu", np.median(spent), "s", "lower", rel_tol=2.0))
            good = f"{touched.sum()} of {n}", f"{(~reached & ~touched).sum()} of {n}"
            took = milliseconds(float(np.median(spent)))
            whole = f"{n} of {len(starts)}"
            before = "" if not method.before else milliseconds(method.before)
            rows.append((method.name, whole, *good, method.promise, before, took))
        head = ("method", "found", "touch", "miss the goal", "promise", "sets, once", "a plan")
        metrics.append(exact(f"practice.slack_{slack:g}.starts", len(starts)))
        note = "Seconds of the processor, median; touch and miss: of the plans found, driven once."
        tables.append(Table(f"Plans with {slack:g} m of slack", head, rows, note))
    return Result(metrics, tables)


def _starts(scene: Scene, pool, n: int) -> np.ndarray:
    """(n, 2) starts of runs that park, each run put so that its end is uniform over the goal."""
    rng = np.random.default_rng(0)
    ends = rng.uniform(scene.z_lo, scene.z_hi, (pool.n, 2))
    p0 = ends - np.asarray(pool.p, np.float64)[:, -1, :2]
    reached, touched = reached_and_touched(scene, pool, p0)
    good = np.flatnonzero(reached & ~touched)
    return p0[rng.choice(good, n, replace=len(good) < n)]


def _plans(method: Method, scene: Scene, starts: np.ndarray, bench: Bench):
    """Parameters by number of the start, and the seconds (starts,) of each answer."""
    rng = np.random.default_rng(1)
    lo, hi = scene.k_lo, scene.k_hi
    found, spent = {}, []
    draw = lambda: rng.uniform(lo, hi, (bench.size(CANDIDATES, 100), len(lo)))  # noqa: E731
    method.pick(scene, starts[0], draw())  # compiles
    for i, start in enumerate(starts):
        k, begin = draw(), time.process_time()
        plan = method.pick(scene, start, k)
        spent.append(time.process_time() - begin)
        if plan is not None:
            found[i] = plan
    return found, spent


def _driven(system, scene: Scene, starts: np.ndarray, found: dict, bench: Bench):
    """(plans,) bool: which runs of the plans reach the goal, and which touch."""
    if not found:
        return np.zeros(0, bool), np.zeros(0, bool)
    k, p0 = np.array(list(found.values())), starts[list(found)]
    seen, first = [], 0
    for runs in stream_rollouts(system, bench.key(2), len(k), Stage.REPLAY, k=k, quiet=True):
        seen.append(reached_and_touched(scene, runs, p0[first : first + runs.n]))
        first += runs.n
    reached, touched = zip(*seen, strict=True)
    return np.concatenate(reached), np.concatenate(touched)


def _clearance(problem: Problem, places: np.ndarray, half: np.ndarray | float = 0.0) -> np.ndarray:
    """(n,) [m] least distance of the body's circle from the cars along paths (n, T, 2), with boxes
    of half widths (T, 2) around their knots.
    """
    share = np.arange(BETWEEN) / BETWEEN
    fine = places[:, :-1, None] + share[:, None] * np.diff(places, axis=1)[:, :, None]
    half = np.broadcast_to(half, places.shape[1:])
    wide = np.maximum(half[:-1], half[1:])[:, None]
    least = np.full(len(places), np.inf)
    for obstacle in problem.obstacles:
        lo, hi = box_of_rows(obstacle)
        beyond = np.maximum(np.abs(fine - (lo + hi) / 2) - (hi - lo) / 2 - wide, 0.0)
        gap = np.sqrt((beyond * beyond).sum(axis=-1).min(axis=(1, 2)))
        least = np.minimum(least, gap - problem.body.radius)
    return least


def _outside(scene: Scene, ends: np.ndarray, yaw: np.ndarray, half: np.ndarray | float = 0.0):
    """(n,) by how much ends with boxes of half widths (3,) leave the goal: 0 for none, [m, rad]."""
    lo, hi = goal_box(scene.problem.goal, scene.model.layout)
    at = np.c_[ends, yaw]
    return np.maximum(np.maximum(lo - at, at - hi) + half, 0.0).max(axis=1)


def _inflated(model: TrajectoryModel, bench: Bench) -> list[Method]:
    rng = np.random.default_rng(2)

    def with_radius(radius: float):
        def pick(scene: Scene, start: np.ndarray, k: np.ndarray):
            lo, hi = scene.k_lo, scene.k_hi
            middle = sum(goal_box(scene.problem.goal, model.layout)) / 2
            best, cost_of_best = None, np.inf
            for _ in range(ROUNDS):
                offsets, q = trajectories(model.net, model.layout, k)
                yaw = q[:, 0]
                room = _clearance(scene.problem, start + offsets) - radius
                ends = start + offsets[:, -1]
                cost = np.linalg.norm(np.c_[ends, yaw] - middle, axis=1)
                cost += np.exp(-COST_SCALING * np.maximum(room, 0.0))
                valid = (room > 0) & (_outside(scene, ends, yaw) <= 0)
                if valid.any() and cost[valid].min() < cost_of_best:
                    i = int(np.flatnonzero(valid)[cost[valid].argmin()])
                    best, cost_of_best = k[i], cost[i]
                cost = cost + 1e3 * ~(room > 0)
                weight = np.exp(-(cost - cost.min()) / TEMPERATURE)
                mean = (weight[:, None] * k).sum(axis=0) / weight.sum()
                spread = SPREAD * (hi - lo) / 2
                k = np.clip(mean + spread * rng.standard_normal(k.shape), lo, hi)
            return best

        return pick

    return [
        Method(
            f"inflated_{radius:g}",
            f"inflated by {radius:g} m, sampled (Nav2's MPPI)",
            "none",
            with_radius(radius),
        )
        for radius in bench.size(RADII, RADII[:2])
    ]


def _rtd(train) -> Method:
    begin = time.process_time()
    k, p = np.asarray(train.k), np.asarray(train.p, np.float64)[:, :: train.time.stride, :2]
    y = np.concatenate([p.reshape(len(p), -1), np.asarray(train.q)], axis=1)
    lo, hi = np.asarray(train.domain.lo), np.asarray(train.domain.hi)

    def terms(k: np.ndarray) -> np.ndarray:
        x = 2 * (k - lo) / (hi - lo) - 1
        powers = np.polynomial.chebyshev.chebvander2d(x[:, 0], x[:, 1], [DEGREE, DEGREE])
        return powers.reshape(len(x), -1)

    weights, *_ = np.linalg.lstsq(terms(k), y, rcond=None)
    error = np.abs(terms(k) @ weights - y).max(axis=0)
    half, at_end = error[:-1].reshape(-1, 2), np.r_[error[:-1].reshape(-1, 2)[-1], error[-1]]

    def pick(scene: Scene, start: np.ndarray, k: np.ndarray):
        out = terms(k) @ weights
        places = start + out[:, :-1].reshape(len(k), -1, 2)
        room = _clearance(scene.problem, places, half)
        room[_outside(scene, places[:, -1], out[:, -1], at_end) > 0] = -np.inf
        return k[room.argmax()] if room.max() > 0 else None

    words = "while no error exceeds the largest of the runs seen"
    spent = time.process_time() - begin
    return Method("rtd", "parameterised sets (RTD)", words, pick, spent)


def _published(model: TrajectoryModel) -> Method:
    begin = time.process_time()
    parts = Partition(model, enumerate_regions(model.net, model.domain))
    spent = time.process_time() - begin

    def pick(scene: Scene, start: np.ndarray, k: np.ndarray):
        p0 = np.tile(start, (len(k), 1))
        seen = verdicts(scene, p0, k)
        rows = np.flatnonzero(seen.reaches)
        if not len(rows):
            return None
        free = kept(parts, scene.problem, p0[rows], k[rows], model.tube.bin_of(k[rows]))
        rows = rows[free & seen.safe[rows]]  # its avoid sets hold every unsafe one, up to rounding
        return k[rows[seen.clearance[rows].argmax()]] if len(rows) else None

    words = "for every run inside the tube"
    return Method("published", "NeuralPARC as published", words, pick, spent)


def _ours(model: TrajectoryModel) -> Method:
    def pick(scene: Scene, start: np.ndarray, k: np.ndarray):
        seen = verdicts(scene, np.tile(start, (len(k), 1)), k)
        room = np.where(seen.safe, seen.clearance, -np.inf)
        return k[room.argmax()] if room.max() > 0 else None

    # (E) is of a k drawn at random; the widest is picked
    words = "for every run inside the tube"
    return Method("ours", "parc_jax", words, pick)
