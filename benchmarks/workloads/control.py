"""The machine against itself: one fixed piece of NumPy work, before everything else and again at the end of the run.

`control.spread` is how many times slower the slowest of many repeats was than the fastest. On a quiet machine it is
close to 1; beyond 2 the times of this run say little.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import metric
from benchmarks.result import Result
from benchmarks.timing import control


def run(bench: Bench) -> Result:
    """Repeat the fixed work."""
    seconds = np.array([control() for _ in range(bench.size(30, 3))])
    spread = float(seconds.max() / seconds.min())
    return Result([metric("control.spread", spread, "x", "lower", rel_tol=1.0, abs_tol=0.5)])
