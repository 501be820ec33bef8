"""The independent checker, in exact arithmetic, standard library only: per sample, per set, and as
a program.

One answer of the drift scene with 100 samples and its safe polytopes. `checking.program` is the
wall time of `python -m parc_jax.checker answer.json`, interpreter start included.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric, times
from benchmarks.result import Result
from benchmarks.timing import seconds_of
from parc_jax import checker
from parc_jax.answer.answer import answer_data
from parc_jax.planner.planner import Planner
from parc_jax.safe_set.settings import Settings


def run(bench: Bench) -> Result:
    """Check every entry of one answer, then the whole file."""
    case, model = bench.model()
    target, n = bench.size((0.01, 100), (0.5, 3))
    answer = Planner(model).solve(
        case.problem(),
        bench.key(),
        Settings(samples=n, target=target, proof=False),
    )
    polytopes = answer.polytopes(bench.key(), bench.size(20_000, 500))
    data = answer_data(answer, polytopes)
    context = checker.Context(data["problem"], data["network"], data["tube"])
    samples, sets, rejected = [], [], 0
    for entries, check, seconds in (
        (data["samples"], context.check_sample, samples),
        (data["sets"][: bench.size(100, 3)], context.check_set, sets),
    ):
        for entry in entries:
            begin = time.perf_counter()
            try:
                check(entry)
            except checker.Rejected:
                rejected += 1
            seconds.append(time.perf_counter() - begin)
    with tempfile.TemporaryDirectory() as folder:
        path = answer.save(Path(folder) / "answer.json", polytopes)
        command = [sys.executable, "-m", "parc_jax.checker", str(path)]
        program, done = seconds_of(
            lambda: subprocess.run(command, capture_output=True, check=False), bench.size(3, 1)
        )
    sizes = [
        np.mean([len(json.dumps(e, separators=(",", ":"))) for e in data[part]])
        for part in ("samples", "sets")
    ]
    return Result(
        [
            *times("checking.sample", samples),
            *times("checking.set", sets),
            *times("checking.program", program),
            exact("checking.program_exit_code", done.returncode),
            exact("checking.rejected", rejected),
            metric("checking.sample_bytes", sizes[0], "count", "lower", rel_tol=0.2),
            metric("checking.set_bytes", sizes[1], "count", "lower", rel_tol=0.2),
        ]
    )
