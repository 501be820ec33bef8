"""Hundreds to a million problems against one model in a few compiled calls."""

import time
from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.certify.batch_boxes import BoxScenes, lay_out_boxes
from parc_jax.certify.batch_run import make_pool, rewarm_many, run, search_many
from parc_jax.certify.batch_scenes import SizeClass, check_stack, stack_problems
from parc_jax.certify.batch_search import PROPOSED, Best
from parc_jax.certify.certificate import sample_part
from parc_jax.certify.evaluate import paths_of
from parc_jax.certify.prove import prove
from parc_jax.certify.scene import Scene, floats_within, scene
from parc_jax.errors import InputError
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

Problems = Sequence[ReachAvoid] | BoxScenes | Scene


class BatchAnswer(NamedTuple):
    """The answer to s problems. Row i belongs to problem i.

    found: (s,) bool: a safe plan is in hand. Not found means not found within the draws, never that none exists.
    plans: (s, n_samples, n_p + n_k), largest clearance first, NaN where fewer were found.
    clearance: (s, n_samples) [m] kept by each plan for every trajectory inside the tube, rounding paid; NaN likewise.
    draws: (s,) plans proposed. proved: (s,) bool: the exact checker accepted the best plan; None when not asked.
    level: "float-bounded" [T11]. seconds: of layout, search and proof, apart.
    answers: full answers, with safe polytopes, of the problems that were asked for, by row.
    """

    found: np.ndarray
    plans: np.ndarray
    clearance: np.ndarray
    draws: np.ndarray
    proved: np.ndarray | None
    level: str
    seconds: dict[str, float]
    answers: dict

    @property
    def best(self) -> np.ndarray:
        """(s, n_p + n_k): the plan of the largest clearance of every problem, NaN where none was found."""
        return self.plans[:, 0]


def solve_batch(
    model: TrajectoryModel, problems: Problems, key: jax.Array, *, n_samples: int, draws: int, pool: int,
    numbers, warm, proof: bool, mesh,
) -> BatchAnswer:  # fmt: skip
    """See `Planner.solve_batch`."""
    if n_samples < 1 or draws < 1 or pool < 1:
        raise InputError(f"solve_batch: expected n_samples, draws, pool >= 1; got {n_samples}, {draws}, {pool}.")
    if proof and isinstance(problems, Scene):
        problem_of(problems, 0)
    begin = time.perf_counter()
    classes = _laid_out(problems, model)
    s, dims = sum(len(c.rows) for c in classes), model.n_p + model.n_k
    numbers = _numbers(numbers, s)
    warm = _warm(warm, s, dims)
    laid_out = time.perf_counter()
    plans, clearance = np.full((s, n_samples, dims), np.nan), np.full((s, n_samples), -np.inf)
    drawn = np.zeros(s, np.int64)
    for one in classes:
        got, rounds = _search(model, one.scenes, numbers[one.rows], warm, one.rows, key, n_samples, draws, pool, mesh)
        plans[one.rows], clearance[one.rows], drawn[one.rows] = got.plans, got.clearance, rounds * PROPOSED
    found = clearance[:, 0] > 0
    none = ~(clearance > 0)
    plans[none], clearance[none] = np.nan, np.nan
    searched = time.perf_counter()
    proved = _proved(model, problems, plans[:, 0], found) if proof else None
    seconds = {"layout": laid_out - begin, "search": searched - laid_out, "proof": time.perf_counter() - searched}
    return BatchAnswer(found, plans, clearance, drawn, proved, "float-bounded", seconds, {})


def problem_of(problems: Problems, row: int) -> ReachAvoid:
    """One problem of a batch, for `Planner.solve`. Raises InputError for stacked arrays."""
    if isinstance(problems, Scene):
        raise InputError("solve_batch: proof and polytopes need problems or BoxScenes; stacked arrays spell none.")
    return problems.problem(row) if isinstance(problems, BoxScenes) else problems[row]


def _laid_out(problems: Problems, model: TrajectoryModel) -> list[SizeClass]:
    if isinstance(problems, BoxScenes):
        return [SizeClass(np.arange(len(problems)), lay_out_boxes(problems, model))] if len(problems) else []
    if isinstance(problems, Scene):
        return [SizeClass(np.arange(check_stack(problems, model)), problems)]
    return stack_problems(problems, model)


def _search(model, scenes: Scene, numbers, warm, rows, key, n_samples: int, draws: int, pool: int, mesh):
    """All rounds of one size class; scenes that are done leave, the others meet fresh pools and more rounds."""
    s, dims = len(numbers), model.n_p + model.n_k
    best = Best(np.zeros((s, n_samples, dims)), np.full((s, n_samples), -np.inf))
    pool_key, scene_key, warm_key = jax.random.split(stream(key, Stage.SEARCH), 3)
    if warm is not None:
        begin = (scenes, numbers, warm[rows])
        best, _ = run(rewarm_many, begin, best, (model.net, model.tube, warm_key), mesh)
    rounds, open_rows = np.zeros(s, np.int64), np.arange(s)
    last, passes = 0, 0
    while last < -(-draws // PROPOSED):
        open_rows = open_rows[~(best.clearance[open_rows] > 0).all(axis=1)]
        if not len(open_rows):
            break
        first, last = last, min(max(1, 4 * last), -(-draws // PROPOSED))
        with x64():
            key_here, box = jax.random.fold_in(pool_key, passes), floats_within(model.domain)
            table = jax.device_get(make_pool(model.net, model.tube, key_here, *box, pool))
        shared = (model.net, model.tube, table, np.asarray(scene_key), np.int32(first), np.int32(last))
        part, start = jax.tree.map(lambda x, i=open_rows: x[i], ((scenes, numbers), best))
        got, ran = run(search_many, part, start, shared, mesh)
        best.plans[open_rows], best.clearance[open_rows] = got.plans, got.clearance
        rounds[open_rows] += ran
        passes += 1
    return best, rounds


def _numbers(numbers, s: int) -> np.ndarray:
    out = np.arange(s) if numbers is None else np.asarray(numbers)
    if out.shape != (s,) or not np.issubdtype(out.dtype, np.integer) or (s and not 0 <= out.min() <= out.max() < 2**32):
        raise InputError(f"solve_batch numbers: expected ({s},) whole numbers from 0 to 2^32 - 1; got {out.shape}.")
    return out.astype(np.uint32)


def _warm(warm, s: int, dims: int):
    """(s, w, dims) earlier plans, or None."""
    if warm is None:
        return None
    plans = np.asarray(warm.plans if isinstance(warm, BatchAnswer) else warm, np.float64)
    plans = plans[:, None] if plans.ndim == 2 else plans
    if plans.ndim != 3 or plans.shape[::2] != (s, dims) or not 1 <= plans.shape[1] <= PROPOSED:
        raise InputError(
            f"solve_batch warm: expected an earlier answer, or plans ({s}, {dims}) or ({s}, w, {dims}) with w <= "
            f"{PROPOSED}, NaN where there is none; got {plans.shape}."
        )
    return plans


def _proved(model: TrajectoryModel, problems, plans: np.ndarray, found: np.ndarray) -> np.ndarray:
    """(s,) bool: which best plans the independent checker accepts, in exact arithmetic; one problem at a time."""
    out, rows = np.zeros(len(found), bool), np.flatnonzero(found)
    p0, k = plans[rows, : model.n_p], plans[rows, model.n_p :]
    paths, bins = paths_of(model, p0, k), model.tube.bin_of(k)
    for i, row in enumerate(rows):
        problem = problem_of(problems, row)
        part = sample_part(problem, scene(problem, model), model.tube, p0[i], k[i], paths[i], int(bins[i]))
        out[row] = prove(problem, model, [part])[0][0]
    return out
