"""How work is laid out on a kind of device: who takes other sizes on an accelerator asks here.

A CPU likes few rows, which stay in its caches, and plans that end as soon as they are decided. An
accelerator likes all rows at once. Its sizes have never been measured: no accelerator was at hand.
`benchmarks/gpu.sh` measures them.

Many devices: one mesh with one axis of rows, over which `solve_batch` splits its scenes.
"""

from dataclasses import dataclass

import jax

AXIS = "rows"


def mesh(devices=None) -> jax.sharding.Mesh:
    """All devices, or the given ones, in one axis; of Auto type, so code for one device works as it
    is.
    """
    devices = jax.devices() if devices is None else devices
    return jax.make_mesh(
        (len(devices),), (AXIS,), axis_types=(jax.sharding.AxisType.Auto,), devices=devices
    )


@dataclass(frozen=True)
class Backend:
    """Sizes of one kind of device.

    in_turn: plans and scenes of one call are judged one after another, so that each ends at once;
        else side by side.
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


def backend(device=None) -> Backend:
    """The sizes for a device; None: for the kind that JAX is set to."""
    platform = jax.default_backend() if device is None else device.platform
    return CPU if platform == "cpu" else ACCELERATOR
