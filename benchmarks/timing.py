"""Wall times that mean something: blocked on the result, the first call apart, the compiler's share
apart.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.stopwatch import Stopwatch


class Timed(NamedTuple):
    """cold_s: first call [s]. compile_s: of it in the compiler [s]. warm: (repeats,) later calls
    [s]. result: last.
    """

    cold_s: float
    compile_s: float
    warm: np.ndarray
    result: object


def timed(call: Callable, repeats: int) -> Timed:
    """Call once cold, then `repeats` times warm."""
    watch = Stopwatch()
    with watch("first"):
        jax.block_until_ready(call())
    warm, result = seconds_of(call, repeats)
    return Timed(
        watch.stages["first"]["seconds"], watch.stages["first"]["compile_seconds"], warm, result
    )


def seconds_of(call: Callable, repeats: int) -> tuple[np.ndarray, object]:
    """(repeats,) wall times [s] of a call, and its last result."""
    spent, result = [], None
    for _ in range(repeats):
        begin = time.perf_counter()
        result = jax.block_until_ready(call())
        spent.append(time.perf_counter() - begin)
    return np.array(spent), result


def control() -> float:
    """Smallest of a few wall times [s] of a fixed piece of NumPy work: it only changes when the
    machine is busy.
    """
    a = np.linspace(0.0, 1.0, 256 * 256).reshape(256, 256)

    def work():
        b = a
        for _ in range(8):
            b = np.tanh(b @ a * 1e-2)
        return b

    return float(seconds_of(work, 5)[0].min())
