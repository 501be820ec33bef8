"""How work is laid out on a kind of device: who takes other sizes on an accelerator asks here.

A CPU likes few rows, which stay in its caches, and plans that end as soon as they are decided. An
accelerator likes all rows at once: `benchmarks/gpu.sh` measures it.

Many devices: `solve_batch` hands each its share of the scenes.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.common.shapes import Index

# without emitters of fused loops XLA compiles kernels for a CPU in two thirds of the time, and they
# run as fast or faster; the option says nothing to other devices, and later lines have it not
COMPILER = {"xla_cpu_use_fusion_emitters": False} if jax.__version_info__ < (0, 10) else None


@dataclass(frozen=True)
class Backend:
    """Sizes of one kind of device.

    in_turn: plans and scenes of a call are judged in turn, so each ends at once; else side by side.
    threads: a thread per core, all on the first device; else one per device.
    round, rounds: plans drawn at a time for the first safe ones, and how many times at most; for a
        rarer plan the screen of many at once is the faster way.
    scenes: of a batch, in a compiled call. Where they run in turn fewer cost less.
    rollouts, rollout_bytes: rows of runs in a compiled call: so many, or as many as fill so many
        bytes where those are more.
    compiler: options for programs of runs.
    """

    in_turn: bool
    threads: bool
    round: int
    rounds: int
    scenes: int
    rollouts: int
    rollout_bytes: int
    compiler: tuple[tuple[str, str], ...]


CPU = Backend(
    in_turn=True,
    threads=True,
    round=16,
    rounds=32,
    scenes=128,
    rollouts=256,
    rollout_bytes=0,
    # with AVX-512 vectors of that width, where XLA stops at half of it: the same numbers in less
    # time. Other processors take what they have
    compiler=(("xla_cpu_prefer_vector_width", "512"),),
)
ACCELERATOR = Backend(
    in_turn=False,
    threads=False,
    round=512,
    rounds=1,
    scenes=4096,
    rollouts=256,
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
    devices: Sequence[jax.Device] | None = None,
    how: Backend | None = None,
):
    """one(row, start_row, shared) -> row of results, for all rows of stacked arrays, in calls of a
    fixed size; NumPy in and out.

    one: a kernel, which is compiled once for a device.
    devices: a thread for each. None: the one that JAX is set to, with a thread per core.
    how: by default as suits the kind of device.
    """
    how = how or backend()
    n = len(jax.tree.leaves(start)[0])
    lanes = devices or [None] * ((os.cpu_count() or 1) if how.threads else 1)
    share = min(how.scenes, -(-n // len(lanes)))  # rows of one lane in a call

    def call(begin: int):
        count = min(share, n - begin)
        index = np.minimum(begin + np.arange(how.scenes), n - 1)  # the last one fills up
        with x64():
            taken = jax.tree.map(lambda x: x[index], (rows, start))
            asked = np.int32(count), *taken, shared
            placed = jax.device_put(asked, lanes[begin // share % len(lanes)])
            got = jax.device_get(_many(one, how.in_turn, *placed))
        return jax.tree.map(lambda x: x[:count], got)

    with ThreadPoolExecutor(len(lanes)) as pool:
        parts = list(pool.map(call, range(0, n, share)))
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


@partial(jax.jit, static_argnums=(0, 1))
def _many(one: Callable, loop: bool, n: Index, rows: Any, start: Any, shared: Any):
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

    return jax.lax.fori_loop(0, n, step, out)
