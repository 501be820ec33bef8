"""Tables of an answer for the computer of a robot: every number that a verdict there reads."""

from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.checker.plans import GRID
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.error_set import NO_CLAIM, ErrorBox, ErrorSet, ErrorTemplate, at
from parc_jax.learning.network.rounding import SAFETY, rounding_bound
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import Scene

PROBES = 4  # intervals of a corridor that are tried before all others


class RunTable(NamedTuple):
    """Directions of all corridors, each over some intervals of one pair of obstacle and part.

    first_run (n_corridors + 1,): index of a corridor's first run. pair, first, end (n_runs,):
    intervals first up to, not including, end. w (n_runs, n_p). support (n_runs,) [m], with slack.
    """

    first_run: np.ndarray
    pair: np.ndarray
    first: np.ndarray
    end: np.ndarray
    w: np.ndarray
    support: np.ndarray


class Tables(NamedTuple):
    """Everything that `is_safe` reads, in float64. [T11, T27]

    edges: of the bins, axis by axis. errors: by bin, interval and point, in finite numbers. runs:
    of the corridors, those that hold most plans first. probes (n_corridors, PROBES, 2): a run and
    an interval in which other plans often leave it; (n_corridors, 0, 2) where nothing is in the
    way. pair_points (o, i). far (n_p,) [m]: a plan that ends in the goal starts no farther out
    along an axis; all others are refused, so that the size of every number is bounded. start_A (s,
    n_p), start_b (s,): rows of P0 less the slack. goal_A (g, n_c + n_q), goal_b (n_bins, g): rows
    of the goal less the support of the errors of a bin, and the slack. plans (n_plans, n_k): safe
    ones. ends (n_plans, n_p) [m]: of their first point, from its start. near (2, n_p) [m]: the box
    where it has to end; other plans are not tried. order (n_corridors,): of the answer's corridors.
    """

    edges: tuple[np.ndarray, ...]
    errors: ErrorSet
    runs: RunTable
    probes: np.ndarray
    pair_points: np.ndarray
    far: np.ndarray
    start_A: np.ndarray
    start_b: np.ndarray
    goal_A: np.ndarray
    goal_b: np.ndarray
    plans: np.ndarray
    ends: np.ndarray
    near: np.ndarray
    order: np.ndarray


def tables(answer: Answer) -> Tables:
    """The tables of an answer with corridors. Raises InputError for one without, or
    about one pose."""
    model, scene = answer.model, answer.scene
    if scene.nominal.pose is not None:
        raise InputError(
            "export: expected an answer about any start; this one is told from one pose, perhaps "
            "in the robot's own frame, which a header would not say. Solve without `at`."
        )
    if scene.box_of_k != model.claim.law.box:
        raise InputError(
            f"export: expected an answer about all of {model.claim.law.box}; this one is of k in "
            f"{scene.box_of_k} alone, which a header would not say. Solve without that part."
        )
    if not len(answer.corridors):
        raise InputError(
            "export: expected an answer with corridors; this one has none. Ask again with more "
            "work, or for an easier scene."
        )
    plans = answer.samples
    if not len(plans):
        plans = np.array([np.concatenate([c.p0, c.k]) for c in answer.corridors])
    p0, k = plans[:, : model.n_p], plans[:, model.n_p :]
    paths, bins = paths_of(model, p0, k), model.tube.bins_of(k)[:, 0]
    left = [_left(corridor, model.tube.during(bins), paths) for corridor in answer.corridors]
    # most tests end in the corridor that holds most samples, so it comes first
    order = np.argsort([outside.any(axis=(1, 2)).sum() for outside in left], kind="stable")
    corridors = [answer.corridors[i] for i in order]
    runs = _runs(corridors)
    goal_A, goal_b = _real_rows(scene.goal_A, scene.goal_b, scene)
    # how far out a plan can start that ends in the goal, rounded up
    moved = rounding_bound(model.net, model.domain).magnitude.max()
    far = SAFETY * (np.maximum(np.abs(scene.z_lo), np.abs(scene.z_hi)) + moved)
    lost_at_end = np.stack([model.tube.final_errors.support(row) for row in goal_A], axis=1)
    start_A, start_b = _real_rows(scene.start_A, scene.start_b, scene)
    some = np.unique(np.concatenate([k, *([c.k] for c in corridors)]), axis=0)
    ends = paths_of(model, np.zeros((len(some), model.n_p)), some)[:, -1, : model.n_p]
    return Tables(
        edges=model.tube.edges,
        errors=in_numbers(model.tube.errors),
        runs=runs,
        probes=np.array([_probes(left[i], runs, place) for place, i in enumerate(order)]),
        pair_points=np.asarray(scene.obstacles.points),
        far=far,
        start_A=start_A,
        start_b=start_b,
        goal_A=goal_A,
        # a bin without claim leaves no goal: its rows hold for no number
        goal_b=np.where(np.isfinite(lost_at_end), goal_b - lost_at_end, -NO_CLAIM),
        plans=some,
        ends=ends,
        near=np.stack([scene.z_lo, scene.z_hi]),
        order=order,
    )


def in_numbers(errors: ErrorSet) -> ErrorSet:
    """The errors without infinity. A basis without claim is one of the axes, wider than any world:
    along an axis no number of it cancels another.
    """
    if isinstance(errors, ErrorBox):
        return ErrorBox(np.minimum(errors.half, NO_CLAIM))
    none = np.isinf(errors.half).any(axis=-1, keepdims=True)
    return ErrorTemplate(
        np.where(none[..., None], np.eye(errors.half.shape[-1]), errors.dual),
        np.where(none, 0.0, errors.centre),
        np.where(none, NO_CLAIM, errors.half + 2 / GRID),  # the checker rounds outward to it
    )


def _real_rows(A, b, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """The rows that are not padding, each less the float slack."""
    real = np.abs(A).sum(axis=1) > 0
    A = np.asarray(A)[real]
    return A, np.asarray(b)[real] - float(scene.slack) * np.abs(A).sum(axis=1)


def _left(corridor: Corridor, errors: ErrorSet, paths: np.ndarray) -> np.ndarray:
    """(n, o, T) bool: pairs and intervals in which plans with paths (n, T + 1, n_c) and errors
    (n, T, n_points) leave a corridor. It orders tests and decides nothing.
    """
    n_p = corridor.w.shape[2]
    outside = np.zeros((len(paths), *corridor.support.shape), bool)
    for plan, path in enumerate(paths):
        least = corridor.threshold(at(errors, plan))
        places = path.reshape(len(path), -1, n_p)[:, corridor.points]  # (T + 1, o, i, n_p)
        along = np.einsum("otc,toic->oti", corridor.w, places[:-1])
        after = np.einsum("otc,toic->oti", corridor.w, places[1:])
        outside[plan] = ~(np.minimum(along, after) > least).all(axis=2)
    return outside


def _runs(corridors: list[Corridor]) -> RunTable:
    """All runs, corridor by corridor."""
    rows: list[tuple] = []
    first_run = [0]
    for one in corridors:
        for pair, runs in enumerate(one.own_runs):
            rows += [(pair, *run[:2], *(x[pair, run.first] for x in one[:2])) for run in runs]
        first_run.append(len(rows))
    pair, first, end, w, support = zip(*rows, strict=True) if rows else ((),) * 5
    n_p = corridors[0].w.shape[2]
    numbers = (np.array(column, int) for column in (first_run, pair, first, end))
    return RunTable(*numbers, np.array(w, float).reshape(-1, n_p), np.array(support, float))


def _probes(outside: np.ndarray, runs: RunTable, corridor: int) -> np.ndarray:
    """Runs and intervals (PROBES, 2) of a corridor to test first: greedily those that most plans
    leave of the ones that no probe before them refused. outside (n, o, T).
    """
    first, end = runs.first_run[corridor : corridor + 2]
    if first == end:
        return np.zeros((0, 2), int)
    every = [(run, t) for run in range(first, end) for t in range(runs.first[run], runs.end[run])]
    run, t = np.array(every).T
    refused = outside[:, runs.pair[run], t]  # (n, intervals of this corridor)
    chosen = []
    for _ in range(PROBES):
        best = int(np.argmax(refused.sum(axis=0)))
        chosen.append(every[best])
        refused = refused[~refused[:, best]]
    return np.array(chosen)
