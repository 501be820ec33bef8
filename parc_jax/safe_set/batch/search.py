"""Safe plans of hundreds to a million problems against one model, in a few compiled calls: scenes
of one padded size share a program, run in a loop per core on CPU, vectorised on accelerators,
sharded on a mesh. [T15]
"""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int
from numpy.typing import ArrayLike

from parc_jax.common.arrays import x64
from parc_jax.common.backend import Backend, backend
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, key_data, stream
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.batch.box_scenes import BoxScenes, lay_out_boxes
from parc_jax.safe_set.batch.proposals import (
    PROPOSED,
    About,
    Best,
    along_fan,
    pool_at_random,
    rewarm,
    search,
)
from parc_jax.safe_set.verdict.scene import (
    SceneArrays,
    padded_to_class,
    prune,
    scene_arrays,
    size_class,
)

FEW = 4  # obstacles, up to which pruning costs more than it saves

Problems = Sequence[Problem] | BoxScenes | SceneArrays


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
    key: jax.Array,
    samples: int,
    draws: int,
    pool: int,
    numbers: ArrayLike | None,
    warm: Any,
    mesh: jax.sharding.Mesh | None,
) -> tuple[Best, np.ndarray, float]:
    """The best safe plans of s nominal problems. Arguments as of `Planner.solve_batch`.

    Returns plans (s, samples, n_p + n_k) and clearances (s, samples) [m], NaN where fewer were
    found; plans proposed (s,); seconds of the lowering to arrays. Raises InputError.
    """
    if samples < 1 or draws < 1 or pool < 1:
        raise InputError(
            f"solve_batch: expected samples, draws, pool >= 1; got {samples}, {draws}, {pool}."
        )
    begin = time.perf_counter()
    classes = _size_classes(problems, model)
    s = sum(len(one.rows) for one in classes)
    dims = model.n_p + model.n_k
    numbers = _numbers(numbers, s)
    warm = _warm(warm, s, dims)
    seconds = time.perf_counter() - begin
    best = Best(np.full((s, samples, dims), np.nan), np.full((s, samples), -np.inf))
    drawn = np.zeros(s, np.int64)
    for one in classes:
        rows = one.rows
        begin_with = None if warm is None else warm[rows]
        part, rounds = _search(
            model, one.scenes, numbers[rows], begin_with, key, samples, draws, pool, mesh
        )
        best.plans[rows], best.clearance[rows] = part.plans, part.clearance
        drawn[rows] = rounds * PROPOSED
    none = ~(best.clearance > 0)
    best.plans[none] = np.nan
    best.clearance[none] = np.nan
    return best, drawn, seconds


def problem_of(problems: Problems, row: int) -> Problem:
    """One problem of a batch, as `Planner.solve` takes it. Raises InputError for stacked arrays."""
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
    """Rounds (first, last), last excluded, of every pass over a fresh pool: one round first, then
    up to four times as many in all.
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
    """All rounds of one size class; solved scenes leave, the others go on with fresh pools.

    warm: (s, w, n_p + n_k) earlier plans, or None.
    Returns the best plans, and the rounds (s,).
    """
    s = len(numbers)
    dims = model.n_p + model.n_k
    best = Best(np.zeros((s, samples, dims)), np.full((s, samples), -np.inf))
    pool_key, scene_key, warm_key = jax.random.split(stream(key, Stage.SEARCH), 3)
    about = About(model.net, model.tube, along_fan(model.tube))
    if warm is not None:
        best, _ = run(rewarm_many, (scenes, numbers, warm), best, (about, warm_key), mesh)
    rounds = np.zeros(s, np.int64)
    for number, span in enumerate(passes(-(-draws // PROPOSED))):
        open_rows = np.flatnonzero(~(best.clearance > 0).all(axis=1))
        if not len(open_rows):
            break
        with x64():
            pass_key = jax.random.fold_in(pool_key, number)
            k_box = (model.domain.lo, model.domain.hi)
            items = jax.device_get(make_pool(model.net, model.tube, pass_key, *k_box, pool))
        shared = (about, items, key_data(scene_key), *map(np.int32, span))
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
        try:
            few = len(problem.obstacles) <= FEW
            one = scene_arrays(problem, model, None if few else prune(problem, model))
        except InputError as error:
            raise InputError(f"problem {row} of the batch: {error}") from None
        alike.setdefault(size_class(len(problem.obstacles)), []).append((row, one))
    groups: dict[tuple, list[tuple[int, SceneArrays]]] = {}
    for some in alike.values():
        # all padded to the largest: pruning must not make more programs
        most = size_class(max(len(one.obstacles.active) for _, one in some))
        for row, one in some:
            padded = padded_to_class(one, most)
            shape = tuple(np.shape(x) for x in jax.tree.leaves(padded))
            groups.setdefault(shape, []).append((row, padded))
    return [
        SizeClass(
            np.array([row for row, _ in group]),
            jax.tree.map(lambda *x: np.stack(x), *(one for _, one in group)),
        )
        for group in groups.values()
    ]


def check_stack(scenes: SceneArrays, model: TrajectoryModel) -> int:
    """Number of scenes in stacked arrays. Raises InputError if they do not fit the model."""
    leaves = jax.tree.leaves(scenes)
    counts = {np.shape(x)[0] if np.ndim(x) else None for x in leaves}
    if scenes.count is not None or len(counts) != 1 or None in counts:
        raise InputError(
            "solve_batch: expected stacked scenes, every array with the same leading axis; "
            f"got {sorted(map(str, counts))}. Build them with box_scenes or stack_problems."
        )
    want = (model.time.n_steps, model.n_p, model.n_k)
    have = (
        scenes.obstacles.active.shape[-1],
        scenes.z_lo.shape[-1],
        scenes.k_lo.shape[-1],
    )
    if want != have:
        raise InputError(
            f"solve_batch: expected scenes of this model, (T, n_p, n_k) = {want}; got {have}."
        )
    return counts.pop()


class Calls(NamedTuple):
    """How n scenes are spread over calls of one compiled size.

    n: scenes. size: rows of a call, padding included. lanes: devices of a mesh, or threads.
    share: scenes of one lane in one call. loop: see `over_scenes`.
    """

    n: int
    size: int
    lanes: int
    share: int
    loop: bool

    def padded(self, first: np.ndarray) -> np.ndarray:
        """Scenes of the calls that begin at `first` (...): (..., size), the last one repeated."""
        return np.minimum(first[..., None] + np.arange(self.size), self.n - 1)

    def counts(self, first: np.ndarray) -> np.ndarray:
        """How many of those are no padding: (...)."""
        return np.clip(self.n - first, 0, self.share).astype(np.int32)


def over_scenes(one: Callable, loop: bool, n: Int[jax.Array, ""], rows: Any, start: Any):
    """one(row, start_row) -> row of results, for the first n rows of stacked arrays. Kernel.

    loop: one after another, so that a solved scene ends at once and its program never sees another
    scene; rows beyond n are not run. Otherwise by vmap.
    """
    if not loop:
        return jax.vmap(one)(rows, start)
    row = partial(jax.tree.map, lambda x: x[0])
    out = jax.eval_shape(one, row(rows), row(start))
    count = len(jax.tree.leaves(start)[0])
    out = jax.tree.map(lambda x: jnp.zeros((count, *x.shape), x.dtype), out)

    def step(i, out):
        got = one(*jax.tree.map(lambda x: x[i], (rows, start)))
        return jax.tree.map(lambda whole, x: whole.at[i].set(x), out, got)

    return jax.lax.fori_loop(0, n, step, out)


def search_many(loop: bool, n: Int[jax.Array, " lanes"], rows: tuple, start: Best, shared: tuple):
    """rows: (scenes, numbers). shared: (about, pool, key, first, last). Returns best, rounds."""
    about, pool, key, first, last = shared

    def one(row, best):
        scene, number = row
        return search(about, scene, number, best, pool, key, first, last)

    return over_scenes(one, loop, n[0], rows, start)


def rewarm_many(loop: bool, n: Int[jax.Array, " lanes"], rows: tuple, start: Best, shared: tuple):
    """rows: (scenes, numbers, earlier plans). shared: (about, key).
    Returns (Best, rounds (s,), all zero).
    """
    about, key = shared

    def one(row, best):
        scene, number, plans = row
        again = rewarm(about, scene, number, best, plans, key)
        return again, jnp.zeros((), jnp.int32)

    return over_scenes(one, loop, n[0], rows, start)


def run(
    kernel: Callable,
    rows: tuple,
    start: Best,
    shared: tuple,
    mesh: jax.sharding.Mesh | None = None,
    how: Backend | None = None,
):
    """All rows through a kernel in calls of a fixed size; NumPy in and out.

    mesh: spread over its devices. None: over the cores of this machine. how: by default
    as suits the kind of device.
    """
    calls = _calls(len(start.clearance), mesh, how or backend())
    if mesh is not None:
        begins = range(0, calls.n, calls.share * calls.lanes)
        parts = [_on_mesh(mesh, kernel, calls, rows, start, shared, begin) for begin in begins]
    else:
        call = partial(_here, kernel, calls, rows, start, shared)
        with ThreadPoolExecutor(calls.lanes) as pool:
            parts = list(pool.map(call, range(0, calls.n, calls.share)))
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def _calls(n: int, mesh: jax.sharding.Mesh | None, how: Backend) -> Calls:
    if mesh is not None:
        lanes = mesh.size
    else:
        lanes = (os.cpu_count() or 1) if how.threads else 1
    return Calls(n, how.scenes, lanes, min(how.scenes, -(-n // lanes)), how.in_turn)


def _here(kernel: Callable, calls: Calls, rows: tuple, start: Best, shared: tuple, begin: int):
    """The scenes from `begin` on of one lane, on this machine."""
    first = np.array([begin])
    count = calls.counts(first)
    index = np.minimum(calls.padded(first)[0], begin + int(count[0]) - 1)
    with x64():
        taken = jax.tree.map(lambda x: x[index], (rows, start))
        got = jax.device_get(_local[kernel](calls.loop, count, *taken, shared))
    return jax.tree.map(lambda x: x[: int(count[0])], got)


def _on_mesh(
    mesh: jax.sharding.Mesh,
    kernel: Callable,
    calls: Calls,
    rows: tuple,
    start: Best,
    shared: tuple,
    begin: int,
):
    """The scenes from `begin` on of one call on all devices."""
    first = begin + calls.share * np.arange(mesh.size)
    counts = calls.counts(first)
    index = calls.padded(first).ravel()
    taken = jax.tree.map(lambda x: x[index], (rows, start))
    with x64():
        split, whole = (jax.NamedSharding(mesh, jax.P(*axis)) for axis in (mesh.axis_names, ()))
        placed = jax.device_put((counts, *taken), split)
        everywhere = jax.device_put(shared, whole)
        got = jax.device_get(_sharded(kernel, calls.loop, mesh)(*placed, everywhere))
    kept = np.concatenate([d * calls.size + np.arange(count) for d, count in enumerate(counts)])
    return jax.tree.map(lambda x: x[kept], got)


@lru_cache
def _sharded(kernel: Callable, loop: bool, mesh: jax.sharding.Mesh):
    """The kernel on every device of a mesh, each on a part of the rows: no device waits for the
    scenes of another one.
    """
    rows = jax.P(mesh.axis_names[0])
    everywhere = jax.P()
    specs = {"mesh": mesh, "in_specs": (rows, rows, rows, everywhere), "out_specs": rows}
    # the checker of replication does not see through loops whose first state is a constant
    return jax.jit(jax.shard_map(partial(kernel, loop), **specs, check_vma=False))


make_pool = jax.jit(pool_at_random, static_argnums=5)
_local = {kernel: jax.jit(kernel, static_argnums=0) for kernel in (search_many, rewarm_many)}
