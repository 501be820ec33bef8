"""The C99 header of a drift parking answer: microseconds a call, and agreement with Python.

Plans are drawn around the safe ones and, a quarter of them, all over K, so that most keep to some
corridors nearly. The header is compiled with the system's compiler and -O2; a call is timed inside
a loop in C, in seconds of the processor.
"""

import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.bench import Bench
from benchmarks.compiled_header import COMPILER, FLAGS, Header
from benchmarks.metrics import exact, metric
from benchmarks.result import Result, Skip, Table
from parc_jax.drive.onboard.header import write_c
from parc_jax.planner.planner import Planner
from parc_jax.safe_set.settings import Settings

SPREAD = 0.05  # [1] of a plan around a safe one, in shares of the sides of K and of the starts


def run(bench: Bench) -> Result:
    """Compile, compare, time."""
    if COMPILER is None:
        raise Skip("no C compiler (cc) on this machine")
    case, model = bench.model()
    settings = Settings(samples=bench.size(100, 5), target=bench.size(0.01, 0.5))
    answer = Planner(model).solve(case.problem(), bench.key(1), settings)
    p0, k = _plans(answer, bench.size(100_000, 1000))
    with tempfile.TemporaryDirectory() as folder:
        written = write_c(answer, Path(folder) / "safe_set.h")
        size = written.stat().st_size
        header = Header(written)
        said = header.are_safe(p0, k)
        known = answer.contains(p0, k)
        repeats = bench.size(9, 1)
        seconds = [_of_a_call(header, p0[of], k[of], repeats) for of in (known >= 0, known)]
    rows = [
        ("any plan", f"{1e6 * seconds[0]:.2f} µs", f"{len(p0):,}"),
        ("a safe one", f"{1e6 * seconds[1]:.2f} µs", f"{int(known.sum()):,}"),
    ]
    title = f"{len(answer.corridors)} corridors, {size / 1e3:.0f} kB of C, {' '.join(FLAGS[:2])}"
    return Result(
        [
            metric("onboard.call", seconds[0], "s", "lower", rel_tol=0.5),
            metric("onboard.safe_call", seconds[1], "s", "lower", rel_tol=0.5),
            exact("onboard.differs_from_python", int((said != known).sum())),
            metric("onboard.size", size, "count", "lower", rel_tol=0.5),
        ],
        [Table(title, ("asked about", "a call", "plans"), rows)],
    )


def _of_a_call(header: Header, p0, k, repeats: int) -> float:
    """[s] of one processor, the median of some repeats."""
    spent = []
    for _ in range(repeats):
        begin = time.process_time()
        header.are_safe(p0, k)
        spent.append(time.process_time() - begin)
    return float(np.median(spent)) / max(len(p0), 1)


def _plans(answer, n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    n_p, domain = answer.model.n_p, answer.model.domain
    plans = answer.samples[rng.integers(0, len(answer.samples), n)]
    sides = np.concatenate([np.ptp(answer.samples[:, :n_p], axis=0), domain.hi - domain.lo])
    plans = plans + SPREAD * sides * rng.normal(size=plans.shape)
    plans[::4, n_p:] = rng.uniform(domain.lo, domain.hi, (len(plans[::4]), len(domain.lo)))
    return plans[:, :n_p], np.clip(plans[:, n_p:], domain.lo, domain.hi)
