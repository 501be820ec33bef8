"""From starting `python` to the first certified sample with a saved model, in a process of its own.

The child loads model and scene, asks for one sample, has it proved by the independent checker, and
prints a line; the clock runs in the parent from before the start until that line. First with an
empty compilation cache, then with the one that the first child filled (the cache that `parc-jax
run` keeps by default).
"""

import os
import subprocess
import sys
import tempfile
import time

from benchmarks.bench import ROOT, Bench
from benchmarks.metrics import exact, metric, times
from benchmarks.result import Result
from parc_jax.base.status import Status

_CHILD = """
import sys
from parc_jax.study.cache import keep_compiled
keep_compiled()
import jax
from benchmarks.cases import case
from parc_jax.model import load
from parc_jax.planner.planner import Planner
from parc_jax.settings import Settings
planner, problem = Planner(load(sys.argv[1])), case("drift").problem()
key = jax.random.PRNGKey(int(sys.argv[2]))
answer = planner.solve(problem, key, Settings(samples=1, samples_only=True))
print(answer.status, flush=True)
"""


def first_sample(bench: Bench, cache: str, seed: int) -> tuple[float, bool]:
    """Wall time [s] of one child, and whether its sample was proved."""
    environment = {
        name: value for name, value in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"
    }
    command = [sys.executable, "-c", _CHILD, str(bench.saved), str(seed)]
    begin = time.perf_counter()
    with subprocess.Popen(
        command,
        env=environment | {"XDG_CACHE_HOME": cache},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=ROOT,
    ) as child:
        said = child.stdout.readline().strip()
        seconds = time.perf_counter() - begin
    return seconds, said == Status.PROVED.label


def run(bench: Bench) -> Result:
    """One child with an empty cache, several with a filled one; repeated."""
    bench.model()  # skips when there is no saved model
    empty, filled, proved = [], [], []
    for _ in range(bench.size(2, 1)):
        with tempfile.TemporaryDirectory() as cache:
            for seed in range(bench.size(4, 2)):
                seconds, ok = first_sample(bench, cache, seed)
                (filled if seed else empty).append(seconds)
                proved.append(ok)
    return Result(
        [
            *times("cold_start.empty_cache", empty),
            *times("cold_start.filled_cache", filled),
            exact("cold_start.not_proved", len(proved) - sum(proved)),
            metric("cold_start.runs", len(proved), "count", "same"),
        ]
    )
