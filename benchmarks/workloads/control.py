"""The machine against itself: one fixed piece of NumPy work, many times, before everything else.

`control.spread` is how many times slower the slow tenth of the repeats was than the fastest. On a
quiet machine it is close to 1; beyond 2 the times of this run say little.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import metric
from benchmarks.result import Result
from benchmarks.timing import control


def run(bench: Bench) -> Result:
    """Repeat the fixed work."""
    seconds = np.array([control() for _ in range(bench.size(50, 3))])
    spread = float(np.quantile(seconds, 0.9) / seconds.min())
    return Result([metric("control.spread", spread, "x", "lower", rel_tol=1.0, abs_tol=0.5)])
