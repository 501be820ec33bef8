"""Hundreds to a million problems against one model in a few compiled calls."""

import time
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, key_data, stream
from parc_jax.common.status import Status
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import ReachAvoid
from parc_jax.problem.robust.executions import require_given
from parc_jax.problem.robust.question import Plain
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import sample_part
from parc_jax.safe_set.batch.box_scenes import BoxScenes, lay_out_boxes
from parc_jax.safe_set.batch.proposals import PROPOSED, Best, along_fan
from parc_jax.safe_set.batch.run import make_pool, rewarm_many, run, search_many
from parc_jax.safe_set.batch.stack import SizeClass, check_stack, stack_problems
from parc_jax.safe_set.verdict.near import near_scene
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import SceneArrays

Problems = Sequence[ReachAvoid] | BoxScenes | SceneArrays


class BatchAnswer(NamedTuple):
    """The answer to s problems. Row i belongs to problem i.

    found: (s,) bool: a safe plan is in hand. Not found means not found within the draws, never that
        none exists.
    plans: (s, samples, n_p + n_k), largest clearance first, NaN where fewer were found.
    clearance: (s, samples) [m] kept by each plan for every trajectory inside the tube, rounding
        paid; NaN likewise.
    draws: (s,) plans proposed. proved: (s,) bool: the exact checker accepted the best plan; None
        when not asked.
    seconds: of layout, search and proof, apart.
    answers: full answers of the problems in `whole`, by row.
    """

    found: np.ndarray
    plans: np.ndarray
    clearance: np.ndarray
    draws: np.ndarray
    proved: np.ndarray | None
    seconds: dict[str, float]
    answers: dict

    @property
    def status(self) -> np.ndarray:
        """(s,) Status: PROVED where the exact checker accepted the best plan, else BOUNDED [T11],
        or NOT_FOUND.
        """
        out = np.where(self.found, Status.BOUNDED, Status.NOT_FOUND)
        if self.proved is not None:
            out[self.proved] = Status.PROVED
        return out

    def __repr__(self) -> str:
        proved = "" if self.proved is None else f", {int(self.proved.sum())} proved"
        return f"<BatchAnswer: {int(self.found.sum())} of {len(self.found)} found{proved}>"

    @property
    def best(self) -> np.ndarray:
        """(s, n_p + n_k): the plan of the largest clearance of every problem, NaN where none was
        found.
        """
        return self.plans[:, 0]


def solve_batch(
    model: TrajectoryModel,
    problems: Problems,
    key: jax.Array,
    *,
    samples: int,
    draws: int,
    pool: int,
    numbers: ArrayLike | None,
    warm: Any,
    proof: bool,
    mesh: jax.sharding.Mesh | None,
) -> BatchAnswer:
    """See `Planner.solve_batch`."""
    if samples < 1 or draws < 1 or pool < 1:
        raise InputError(
            f"solve_batch: expected samples, draws, pool >= 1; got {samples}, {draws}, {pool}."
        )
    if isinstance(problems, BoxScenes | SceneArrays):
        require_given(None, model)
    if proof and isinstance(problems, SceneArrays):
        problem_of(problems, 0)
    begin = time.perf_counter()
    classes = _size_classes(problems, model)
    s = sum(len(one.rows) for one in classes)
    dims = model.n_p + model.n_k
    numbers = _numbers(numbers, s)
    warm = _warm(warm, s, dims)
    stacked = time.perf_counter()
    plans = np.full((s, samples, dims), np.nan)
    clearance = np.full((s, samples), -np.inf)
    drawn = np.zeros(s, np.int64)
    for one in classes:
        begin_with = None if warm is None else warm[one.rows]
        best, rounds = _search(
            model, one.scenes, numbers[one.rows], begin_with, key, samples, draws, pool, mesh
        )
        plans[one.rows] = best.plans
        clearance[one.rows] = best.clearance
        drawn[one.rows] = rounds * PROPOSED
    found = clearance[:, 0] > 0
    none = ~(clearance > 0)
    plans[none] = np.nan
    clearance[none] = np.nan
    searched = time.perf_counter()
    proved = _proved(model, problems, plans[:, 0], found) if proof else None
    seconds = {
        "layout": stacked - begin,
        "search": searched - stacked,
        "proof": time.perf_counter() - searched,
    }
    return BatchAnswer(found, plans, clearance, drawn, proved, seconds, {})


def problem_of(problems: Problems, row: int) -> ReachAvoid:
    """One problem of a batch, for `Planner.solve`. Raises InputError for stacked arrays."""
    if isinstance(problems, SceneArrays):
        raise InputError(
            "solve_batch: proof and answers need problems or BoxScenes; stacked arrays spell none."
        )
    return problems.problem(row) if isinstance(problems, BoxScenes) else problems[row]


def _size_classes(problems: Problems, model: TrajectoryModel) -> list[SizeClass]:
    if isinstance(problems, BoxScenes):
        if not len(problems):
            return []
        return [SizeClass(np.arange(len(problems)), lay_out_boxes(problems, model))]
    if isinstance(problems, SceneArrays):
        return [SizeClass(np.arange(check_stack(problems, model)), problems)]
    return stack_problems(problems, model)


def passes(rounds: int) -> Iterator[tuple[int, int]]:
    """Rounds first..last - 1 of every pass, each of which meets a fresh pool: one round first, then
    always up to four times the rounds so far.
    """
    first, last = 0, 1
    while first < rounds:
        yield first, min(last, rounds)
        first, last = last, 4 * last


def _search(
    model: TrajectoryModel,
    scenes: SceneArrays,
    numbers: np.ndarray,
    warm: np.ndarray | None,
    key: jax.Array,
    samples: int,
    draws: int,
    pool: int,
    mesh: jax.sharding.Mesh | None,
) -> tuple[Best, np.ndarray]:
    """All rounds of one size class; scenes that are done leave, the others meet fresh pools and
    more rounds. warm: (s, w, n_p + n_k) earlier plans, or None. Returns rounds (s,) as well.
    """
    s = len(numbers)
    dims = model.n_p + model.n_k
    best = Best(np.zeros((s, samples, dims)), np.full((s, samples), -np.inf))
    pool_key, scene_key, warm_key = jax.random.split(stream(key, Stage.SEARCH), 3)
    fan = along_fan(model.tube)
    if warm is not None:
        shared = (model.net, model.tube, fan, warm_key)
        best, _ = run(rewarm_many, (scenes, numbers, warm), best, shared, mesh)
    rounds = np.zeros(s, np.int64)
    for number, span in enumerate(passes(-(-draws // PROPOSED))):
        open_rows = np.flatnonzero(~(best.clearance > 0).all(axis=1))
        if not len(open_rows):
            break
        with x64():
            pass_key = jax.random.fold_in(pool_key, number)
            k_box = (model.domain.lo, model.domain.hi)
            items = jax.device_get(make_pool(model.net, model.tube, pass_key, *k_box, pool))
        shared = (model.net, model.tube, fan, items, key_data(scene_key), *map(np.int32, span))
        part, start = jax.tree.map(lambda x, i=open_rows: x[i], ((scenes, numbers), best))
        got, ran = run(search_many, part, start, shared, mesh)
        best.plans[open_rows] = got.plans
        best.clearance[open_rows] = got.clearance
        rounds[open_rows] += ran
    return best, rounds


def _numbers(numbers: ArrayLike | None, s: int) -> np.ndarray:
    out = np.arange(s) if numbers is None else np.asarray(numbers)
    if (
        out.shape != (s,)
        or not np.issubdtype(out.dtype, np.integer)
        or (s and not 0 <= out.min() <= out.max() < 2**32)
    ):
        raise InputError(
            f"solve_batch numbers: expected ({s},) whole numbers from 0 to 2^32 - 1; got "
            f"{out.shape}."
        )
    return out.astype(np.uint32)


def _warm(warm: Any, s: int, dims: int):
    """(s, w, dims) earlier plans, or None."""
    if warm is None:
        return None
    plans = np.asarray(warm.plans if isinstance(warm, BatchAnswer) else warm, np.float64)
    plans = plans[:, None] if plans.ndim == 2 else plans
    if plans.ndim != 3 or plans.shape[::2] != (s, dims) or not 1 <= plans.shape[1] <= PROPOSED:
        raise InputError(
            f"solve_batch warm: expected an earlier answer, or plans ({s}, {dims}) or ({s}, w, "
            f"{dims}) with w <= {PROPOSED}, NaN where there is none; got {plans.shape}."
        )
    return plans


def _proved(
    model: TrajectoryModel, problems: Problems, plans: np.ndarray, found: np.ndarray
) -> np.ndarray:
    """(s,) bool: which best plans the independent checker accepts, in exact arithmetic; one problem
    at a time.
    """
    out = np.zeros(len(found), bool)
    rows = np.flatnonzero(found)
    p0 = plans[rows, : model.n_p]
    k = plans[rows, model.n_p :]
    paths = paths_of(model, p0, k)
    for i, row in enumerate(rows):
        problem = problem_of(problems, row)
        scene = near_scene(Plain(problem, model))
        part = sample_part(scene, model.tube, p0[i], k[i], paths[i])
        out[row] = prove(problem, model, [part])[0][0]
    return out
