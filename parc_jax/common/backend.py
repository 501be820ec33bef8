"""How work is laid out on a kind of device: who takes other sizes on an accelerator asks here.

A CPU likes few rows, which stay in its caches, and plans that end as soon as they are decided. An
accelerator likes all rows at once: `benchmarks/gpu.sh` measures it.

Many devices: one mesh with one axis of rows, over which `solve_batch` splits its scenes.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from parc_jax.common.arrays import x64

AXIS = "rows"
ROLLOUTS = 256  # rows of runs in a compiled call, at least
# without emitters of fused loops XLA compiles kernels for a CPU in two thirds of the time, and they
# run as fast or faster; the option says nothing to other devices, and later lines have it not
COMPILER = {"xla_cpu_use_fusion_emitters": False} if jax.__version_info__ < (0, 10) else None
compiled = partial(jax.jit, compiler_options=COMPILER)  # of a kernel that loops over many plans


def mesh(devices=None) -> jax.sharding.Mesh:
    """All devices, or the given ones, in one axis; of Auto type, so code for one works as it is."""
    devices = jax.devices() if devices is None else devices
    auto = (jax.sharding.AxisType.Auto,)
    return jax.make_mesh((len(devices),), (AXIS,), axis_types=auto, devices=devices)


@dataclass(frozen=True)
class Backend:
    """Sizes of one kind of device.

    in_turn: plans and scenes of a call are judged in turn, so each ends at once, and a thread per
        core works on the first device; else side by side, and one per device.
    round, rounds: plans drawn at a time for the first safe ones, and how many times at most; for a
        rarer plan the screen of many at once is the faster way.
    scenes: of a batch, in a compiled call. Where they run in turn fewer cost less.
    rollout_bytes: that rows of runs fill in a compiled call, where they are more than ROLLOUTS.
    compiler: options for programs of runs.
    """

    in_turn: bool
    round: int
    rounds: int
    scenes: int
    rollout_bytes: int
    compiler: tuple[tuple[str, str], ...]


CPU = Backend(
    in_turn=True,
    round=16,
    rounds=32,
    scenes=128,
    rollout_bytes=0,
    # with AVX-512 vectors of that width, where XLA stops at half of it: the same numbers in less
    # time. Other processors take what they have
    compiler=(("xla_cpu_prefer_vector_width", "512"),),
)
ACCELERATOR = Backend(
    in_turn=False,
    round=512,
    rounds=1,
    scenes=4096,
    rollout_bytes=2**28,
    compiler=(),
)


def refused(name: str, value: str | bool) -> str:
    """Why this version of XLA does not take a compiler option; nothing where it does."""
    try:
        jax.jit(lambda x: x + 1, compiler_options={name: value})(1.0)
    except jax.errors.JaxRuntimeError as error:
        return f"{name}: {str(error).splitlines()[0]}"
    return ""


@cache
def options(kind: Backend) -> dict[str, str] | None:
    """Of its options for programs of runs those that XLA takes: they only make runs faster."""
    return {name: value for name, value in kind.compiler if not refused(name, value)} or None


def backend(device=None) -> Backend:
    """The sizes for a device; None: for the kind that JAX is set to."""
    platform = jax.default_backend() if device is None else device.platform
    return CPU if platform == "cpu" else ACCELERATOR


def spread(
    one: Callable,
    rows: Any,
    start: Any,
    shared: Any,
    mesh: jax.sharding.Mesh | None = None,
    how: Backend | None = None,
):
    """one(row, start_row, shared) -> row of results, for all rows of stacked arrays, in calls of a
    fixed size; NumPy in and out.

    one: a kernel, which is compiled once.
    mesh: spread over its devices. None: over the cores of this machine.
    how: by default as suits the kind of device.
    """
    how = how or backend()
    n = len(jax.tree.leaves(start)[0])
    cores = (os.cpu_count() or 1) if how.in_turn else 1
    lanes = cores if mesh is None else mesh.size
    share = min(how.scenes, -(-n // lanes))  # rows of a lane in a call
    # a thread runs the rows of one lane in a call, a mesh those of all
    together, threads = (1, lanes) if mesh is None else (lanes, 1)

    def run(counts: np.ndarray, taken: Any):
        if mesh is None:
            return _local(one, how.in_turn, counts, *taken, shared)
        split, whole = (jax.NamedSharding(mesh, jax.P(*axis)) for axis in (mesh.axis_names, ()))
        placed = jax.device_put((counts, *taken), split)
        return _sharded(one, how.in_turn, mesh)(*placed, jax.device_put(shared, whole))

    def call(begin: int):
        first = begin + share * np.arange(together)
        counts = np.clip(n - first, 0, share).astype(np.int32)
        # of one compiled size: the last row is repeated
        index = np.minimum(first[:, None] + np.arange(how.scenes), n - 1).ravel()
        with x64():
            got = jax.device_get(run(counts, jax.tree.map(lambda x: x[index], (rows, start))))
        kept = np.concatenate([d * how.scenes + np.arange(count) for d, count in enumerate(counts)])
        return jax.tree.map(lambda x: x[kept], got)

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(call, range(0, n, share * together)))
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def _many(one: Callable, loop: bool, n: Int[jax.Array, " lanes"], rows: Any, start: Any, shared):
    """The first n rows of stacked arrays. Kernel.

    loop: one after another, so that a solved one ends at once and its program never sees another;
    rows beyond n are not run. Otherwise by vmap.
    """
    if not loop:
        return jax.vmap(one, in_axes=(0, 0, None))(rows, start, shared)
    row = partial(jax.tree.map, lambda x: x[0])
    out = jax.eval_shape(one, row(rows), row(start), shared)
    count = len(jax.tree.leaves(start)[0])
    out = jax.tree.map(lambda x: jnp.zeros((count, *x.shape), x.dtype), out)

    def step(i, out):
        got = one(*jax.tree.map(lambda x: x[i], (rows, start)), shared)
        return jax.tree.map(lambda whole, x: whole.at[i].set(x), out, got)

    return jax.lax.fori_loop(0, n[0], step, out)


_local = jax.jit(_many, static_argnums=(0, 1))


@lru_cache
def _sharded(one: Callable, loop: bool, mesh: jax.sharding.Mesh):
    """The kernel on every device of a mesh, on its own rows: none waits for those of another."""
    rows = jax.P(mesh.axis_names[0])
    everywhere = jax.P()
    specs = {"mesh": mesh, "in_specs": (rows, rows, rows, everywhere), "out_specs": rows}
    # the checker of replication does not see through loops whose first state is a constant
    return jax.jit(jax.shard_map(partial(_many, one, loop), **specs, check_vma=False))


def while_open(one: Callable, state: tuple, of: Any, at_once: tuple[int, int]) -> tuple:
    """The state, of rows, of which the first (b,) bool says where `one` is asked again: (state, of)
    -> state, of one row; until it is nowhere. Kernel.

    at_once: rows that are asked in one round where they run in turn, and of the last ones.
    """
    n, (most, few) = len(state[0]), at_once

    def some(state: tuple, size: int):
        at = jnp.nonzero(state[0], size=size, fill_value=n)[0]
        rows = jax.tree.map(lambda x: x.at[at].get(mode="clip"), (state, of))
        new = jax.vmap(one)(*rows)
        return tuple(x.at[at].set(y, mode="drop") for x, y in zip(state, new, strict=True))

    for size, left in ((most, few), (few, 0)) if backend().in_turn else ((n, 0),):
        more = partial(lambda state, left: state[0].sum() > left, left=left)
        state = jax.lax.while_loop(more, partial(some, size=min(size, n)), state)
    return state
