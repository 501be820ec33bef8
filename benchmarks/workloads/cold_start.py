"""From starting `python` to the first certified sample, in a process of its own.

With a saved model: the child loads model and scene, asks for one sample, has it proved by the
independent checker, and prints a line; the clock runs in the parent from before the start until
that line. From the shell: `parc-jax solve drift_parking --first`, with the model that comes along,
until the process has ended and its answer is a file. Nothing is compiled by either; so that this
stays true, first with an empty cache of programs, then with the one of the first child. Names: a
child that loads the planner and ends; jax: one that loads JAX alone, which is most of it.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.bench import ROOT, Bench
from benchmarks.metrics import exact, metric, times
from benchmarks.result import Result
from parc_jax.common.status import Status

SYSTEM = "drift_parking"
NAMES = {"names": "import parc_jax; parc_jax.Planner", "jax": "import jax"}
_CHILD = """
import sys
from benchmarks.cases import case
from parc_jax.common.keys import key_of
from parc_jax.learning.model import load
from parc_jax.method import FirstProved
from parc_jax.planner import Planner
from parc_jax.safe_set.settings import Settings
planner, problem = Planner(load(sys.argv[1])), case("drift").problem()
settings = Settings(samples=1, samples_only=True, method=FirstProved())
answer = planner.solve(problem, key_of(int(sys.argv[2])), settings)
print(answer.status, flush=True)
"""


def run(bench: Bench) -> Result:
    """One child with an empty cache, several with a filled one, of each kind; repeated."""
    import sims

    bench.model()  # skips when there is no saved model
    kinds = {"": first_sample}
    if SYSTEM in sims.models():
        kinds["shell."] = first_in_shell
    metrics, proved = [], []
    for kind, call in kinds.items():
        empty, filled = [], []
        for _ in range(bench.size(5, 1)):
            with tempfile.TemporaryDirectory() as cache:
                for seed in range(2):
                    seconds, ok = call(bench, cache, seed)
                    (filled if seed else empty).append(seconds)
                    proved.append(ok)
        metrics += times(f"cold_start.{kind}empty_cache", empty)
        metrics += times(f"cold_start.{kind}filled_cache", filled)
    for name, code in NAMES.items():
        spent = [seconds_of([sys.executable, "-c", code], "") for _ in range(bench.size(5, 1))]
        metrics += times(f"cold_start.{name}", spent)
    metrics.append(exact("cold_start.not_proved", len(proved) - sum(proved)))
    metrics.append(metric("cold_start.runs", len(proved), "count", "same"))
    return Result(metrics)


def first_sample(bench: Bench, cache: str, seed: int) -> tuple[float, bool]:
    """Wall time [s] of one child, and whether its sample was proved."""
    command = [sys.executable, "-c", _CHILD, str(bench.saved), str(seed)]
    begin = time.perf_counter()
    with subprocess.Popen(
        command,
        env=environment(cache),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=ROOT,
    ) as child:
        said = child.stdout.readline().strip()
        seconds = time.perf_counter() - begin
    return seconds, said == Status.PROVED.label


def first_in_shell(bench: Bench, cache: str, seed: int) -> tuple[float, bool]:
    """The same of the command."""
    out = Path(cache) / "answer.json"
    asked = ["solve", SYSTEM, "--first", "--quiet", "--seed", str(seed), "--out", str(out)]
    seconds = seconds_of([sys.executable, "-m", "parc_jax.app.cli", *asked], cache)
    return seconds, json.loads(out.read_text())["meta"]["status"] == Status.PROVED.label


def seconds_of(command: list[str], cache: str) -> float:
    """Wall time [s] of a process that has to end well. Raises CalledProcessError."""
    begin = time.perf_counter()
    subprocess.run(command, env=environment(cache), cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def environment(cache: str) -> dict[str, str]:
    """Ours, with another place for compiled programs."""
    ours = {name: at for name, at in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
    return ours | {"XDG_CACHE_HOME": cache}
