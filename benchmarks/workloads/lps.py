"""Many tiny linear programs: 3 variables, 40 rows, half of them empty.

The batched kernel with its checks against Clarabel one by one with the same checks, same machine,
same float64. Every verdict rests on a re-checked witness in both; the statuses must agree, and how
many stay undecided is gated at zero.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric, rate, ratio
from benchmarks.neuralparc.lp_batch import solve_batch
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.lp_solve import solve
from benchmarks.result import Result
from benchmarks.timing import timed

BATCH, ROWS, N = 1024, 40, 3


def programs(rng: np.random.Generator, batch: int):
    """c (B, n), A (B, h, n) of unit rows, b (B, h): every second one has two rows that contradict
    each other.
    """
    A = rng.normal(size=(batch, ROWS, N))
    A /= np.linalg.norm(A, axis=2, keepdims=True)
    b = rng.uniform(0.3, 1.0, (batch, ROWS))
    A[::2, 1], b[::2, 1] = -A[::2, 0], -b[::2, 0] - 0.1
    return rng.normal(size=(batch, N)), A, b


def run(bench: Bench) -> Result:
    """Solve the batch together, and a part of it one by one."""
    batch, single = bench.size(BATCH, 64), bench.size(256, 8)
    c, A, b = programs(np.random.default_rng(0), batch)
    lo, hi = np.full(N, -10.0), np.full(N, 10.0)
    together = timed(lambda: solve_batch(c, A, b, lo, hi), bench.size(7, 1))

    def one_by_one():
        return [solve(c[i], A[i], b[i], lo=lo, hi=hi) for i in range(single)]

    one = timed(one_by_one, bench.size(3, 1))
    apart, answers, found = one.warm, one.result, together.result
    differ = sum(int(answer.status) != found.status[i] for i, answer in enumerate(answers))
    return Result(
        [
            rate("lps.batched", batch, together.warm, batch=batch),
            rate("lps.one_by_one", single, apart, batch=1),
            ratio("lps.ratio", np.median(apart) / single, np.median(together.warm) / batch),
            metric("lps.compile", together.compile_s, "s", "lower", rel_tol=1.0, abs_tol=0.5),
            exact("lps.unknown", (found.status == int(LPStatus.UNKNOWN)).sum()),
            exact("lps.disagree", differ),
            metric("lps.left_to_host", found.n_host / batch, "1", "lower", abs_tol=0.02),
        ]
    )
