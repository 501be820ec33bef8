"""Run the one-scene kernels over many scenes: a loop per core on CPU, vectorised on accelerators,
sharded on a mesh.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from parc_jax.common.arrays import x64
from parc_jax.common.backend import Backend, backend
from parc_jax.safe_set.batch.proposals import Best, pool_at_random, rewarm, search


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
