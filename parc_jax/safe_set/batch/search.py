"""Safe plans of hundreds to a million problems against one model, in a few compiled calls: scenes
of one padded size share a program, run in a loop per core on CPU, vectorised on accelerators,
sharded on a mesh. [T15]
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import Sealed, x64
from parc_jax.common.backend import spread
from parc_jax.common.errors import InputError, naming, reading
from parc_jax.common.keys import Stage, key_data, stream
from parc_jax.common.shapes import Key
from parc_jax.common.status import Status
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.safe_set.batch.box_scenes import BoxScenes, lay_out_boxes
from parc_jax.safe_set.batch.estimate import along_fan
from parc_jax.safe_set.batch.proposals import PROPOSED, About, pool_at_random, rewarm, search
from parc_jax.safe_set.separation.pruning import prune
from parc_jax.safe_set.verdict.rounds import Best
from parc_jax.safe_set.verdict.scene import SceneArrays, lowered, padded_to_class, size_class

POOL = 256  # values of k that all scenes share, drawn anew after 1, 4, 16 ... rounds
FEW = 4  # obstacles, up to which pruning costs more than it saves

Problems = Sequence[Problem] | BoxScenes


@dataclass(frozen=True, eq=False, repr=False)
class BatchAnswer(Sealed):
    """The answer to s problems. Row i belongs to problem i.

    found: (s,) bool: a safe plan was found; False never says that none exists.
    plans: (s, samples, n_p + n_k), largest clearance first, NaN where fewer were found.
    clearance: (s, samples) [m] kept by each plan for every trajectory inside the tube, rounding
        paid; NaN likewise.
    draws: (s,) plans proposed. proved: (s,) bool: the exact checker accepted the best plan; None
        without that check.
    seconds: of layout, search and proof, apart.
    answers: full answers of the problems in `whole`, by row. under: in words, what all of it is
        under, as `repr` says.
    """

    found: np.ndarray
    plans: np.ndarray
    clearance: np.ndarray
    draws: np.ndarray
    proved: np.ndarray | None
    seconds: dict[str, float]
    answers: dict
    under: str

    @property
    def status(self) -> np.ndarray:
        """(s,) Status: PROVED if the exact checker accepted the best, else BOUNDED, NOT_FOUND."""
        out = np.where(self.found, Status.BOUNDED, Status.NOT_FOUND)
        if self.proved is not None:
            out[self.proved] = Status.PROVED
        return out

    def __repr__(self) -> str:
        proved = "" if self.proved is None else f", {int(self.proved.sum())} proved"
        return (
            f"<BatchAnswer: {int(self.found.sum())} of {len(self.found)} found{proved}{self.under}>"
        )

    @property
    def best(self) -> np.ndarray:
        """(s, n_p + n_k): every problem's plan of largest clearance, NaN where none was found."""
        return self.plans[:, 0]


class SizeClass(NamedTuple):
    """Scenes of one padded size.

    rows: (s,) their rows in the batch.
    scenes: stacked, with a leading axis s.
    """

    rows: np.ndarray
    scenes: SceneArrays


def search_batch(
    model: TrajectoryModel,
    problems: Problems,
    key: Key,
    samples: int,
    draws: int,
    numbers: ArrayLike | None,
    warm: Any,
    mesh: jax.sharding.Mesh | None,
) -> tuple[Best, np.ndarray, float]:
    """The best safe plans of s nominal problems. Arguments as of `Planner.solve_batch`.

    Returns plans (s, samples, n_p + n_k) and clearances (s, samples) [m], NaN where fewer were
    found; plans proposed (s,); seconds of the lowering to arrays. Raises InputError.
    """
    begin = time.perf_counter()
    if isinstance(problems, BoxScenes):
        some = np.arange(len(problems))
        classes = [SizeClass(some, lay_out_boxes(problems, model))] if len(some) else []
    else:
        classes = stack_problems(problems, model)
    s = sum(len(one.rows) for one in classes)
    dims = model.n_p + model.n_k
    numbers = _numbers(numbers, s)
    warm = _warm(warm, s, dims)
    seconds = time.perf_counter() - begin
    best = Best(np.zeros((s, samples, dims)), np.full((s, samples), -np.inf))
    drawn = np.zeros(s, np.int64)
    pool_key, scene_key, warm_key = jax.random.split(stream(key, Stage.SEARCH), 3)
    about = About(model.net, model.tube, along_fan(model.tube))

    def put(rows: np.ndarray, part: Best) -> None:
        best.plans[rows], best.clearance[rows] = part.plans, part.clearance

    for rows, scenes in classes:
        if warm is not None:
            start = jax.tree.map(lambda x, rows=rows: x[rows], best)
            known = scenes, numbers[rows], warm[rows]
            put(rows, spread(rewarm, known, start, (about, warm_key), mesh))
        # solved scenes leave, the others go on with fresh pools
        rounds = -(-draws // PROPOSED)
        for number, span in enumerate(passes(rounds)):
            left = np.flatnonzero(~(best.clearance[rows] > 0).all(axis=1))
            if not len(left):
                break
            with x64():
                pass_key = jax.random.fold_in(pool_key, number)
                k_box = (model.domain.lo, model.domain.hi)
                items = jax.device_get(make_pool(model.net, model.tube, pass_key, *k_box, POOL))
            order = np.arange(PROPOSED, dtype=np.int32)
            shared = (about, items, key_data(scene_key), order, *map(np.int32, span))
            of = rows[left]
            part = jax.tree.map(lambda x, left=left: x[left], scenes), numbers[of]
            start = jax.tree.map(lambda x, of=of: x[of], best)
            found, ran = spread(search, part, start, shared, mesh)
            put(of, found)
            drawn[of] += ran * len(order)
    none = ~(best.clearance > 0)
    best.plans[none] = np.nan
    best.clearance[none] = np.nan
    return best, drawn, seconds


def problem_of(problems: Problems, row: int) -> Problem:
    """One problem of a batch, as `Planner.solve` takes it."""
    return problems.problem(row) if isinstance(problems, BoxScenes) else problems[row]


def passes(rounds: int) -> Iterator[tuple[int, int]]:
    """Rounds [first, last) of passes over fresh pools: one, then up to 4 times as many in all."""
    first, last = 0, 1
    while first < rounds:
        yield first, min(last, rounds)
        first, last = last, 4 * last


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
    with reading("solve_batch warm", "an earlier answer, or plans"):
        plans = np.asarray(getattr(warm, "plans", warm), np.float64)
    plans = plans[:, None] if plans.ndim == 2 else plans
    if plans.ndim != 3 or plans.shape[::2] != (s, dims) or not 1 <= plans.shape[1] <= PROPOSED:
        raise InputError(
            f"solve_batch warm: expected an earlier answer, or plans ({s}, {dims}) or ({s}, w, "
            f"{dims}) with w <= {PROPOSED}, NaN where there is none; got {plans.shape}."
        )
    return plans


def stack_problems(problems: Sequence[Problem], model: TrajectoryModel) -> list[SizeClass]:
    """Stacked arrays of a list of problems by padded size, pruned. Raises InputError that names the
    first bad one.

    About a millisecond of Python per problem: the corners of grown obstacles are exact.
    `box_scenes` has no such cost.
    """
    alike: dict[int, list[tuple[int, SceneArrays]]] = {}
    for row, problem in enumerate(problems):
        with naming(f"problem {row} of the batch"):
            few = len(problem.obstacles) <= FEW
            nominal = NominalProblem(problem, model)
            one = lowered(nominal, None if few else prune(problem, model)).arrays
        alike.setdefault(size_class(len(problem.obstacles)), []).append((row, one))
    groups: dict[tuple, list[tuple[int, SceneArrays]]] = {}
    for some in alike.values():
        # all padded to the largest: pruning must not make more programs
        most = size_class(max(len(one.obstacles.active) for _, one in some))
        for row, one in some:
            padded = padded_to_class(one, most).replace(count=None)  # all are tested side by side
            shape = tuple(np.shape(x) for x in jax.tree.leaves(padded))
            groups.setdefault(shape, []).append((row, padded))
    return [
        SizeClass(
            np.array([row for row, _ in group]),
            jax.tree.map(lambda *x: np.stack(x), *(one for _, one in group)),
        )
        for group in groups.values()
    ]


make_pool = jax.jit(pool_at_random, static_argnums=5)
