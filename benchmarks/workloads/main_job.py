"""The main job, `parc-jax run drift_parking`, in a process of its own, from nothing: no run, no
model, no compiled program.

Until the first picture of proved plans is on disk, and until the process has ended. Then its answer
goes to the checker, a program of its own. Medians over whole runs, and the last one stage by stage;
what several threads compile adds up.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.bench import ROOT, Bench
from benchmarks.metrics import exact, metric, times
from benchmarks.result import Result, Table
from benchmarks.workloads.cold_start import environment, seconds_of
from parc_jax.app.study.job import METRICS, UNFINISHED
from parc_jax.common.status import Status

SYSTEM = "drift_parking"
QUICK = (
    *("--plant", "ode", "--rollouts", "300", "--steps", "100", "--eps", "0.05"),
    *("--profile-runs", "0", "--driven", "False"),
)
LOOK_EVERY_S = 0.02


def run(bench: Bench) -> Result:
    """As often as it takes for a median, each time with an empty folder and an empty cache."""
    first, whole, checked, found = [], [], [], {}
    for _ in range(bench.size(3, 1)):
        with tempfile.TemporaryDirectory() as folder:
            picture_s, ended_s = job(Path(folder), bench.size((), QUICK))
            first.append(picture_s)
            whole.append(ended_s)
            found = json.loads((Path(folder) / METRICS).read_text())
            check = [sys.executable, "-m", "parc_jax.checker", f"{folder}/answer.json"]
            checked.append(seconds_of(check, folder))
    stages = [
        (name, f"{spent['seconds']:.1f} s", f"{spent['compile_seconds']:.1f} s")
        for name, spent in found["stages"].items()
        if spent["seconds"] > 0.05
    ]
    replay = found["replay"]
    metrics = [
        *times("main_job.first_picture", first),
        *times("main_job", whole),
        *times("main_job.check", checked),
        exact("main_job.not_proved", found["status"] != Status.PROVED.label),
        exact("main_job.touched_inside_the_tube", max(0, replay["touched"] - replay["left_tube"])),
        metric("main_job.safe_share", found["share"]["share"], "1", "higher", rel_tol=0.2),
    ]
    return Result(metrics, [Table("Stage by stage", ("stage", "time", "compiling"), stages)])


def job(folder: Path, options: tuple[str, ...]) -> tuple[float, float]:
    """Wall times [s] of one process until its first picture is there, and until it has ended well.
    Raises CalledProcessError, and RuntimeError where no first picture came.
    """
    picture = folder / UNFINISHED / "samples.png"
    command = [
        sys.executable,
        "-m",
        "parc_jax.app.cli",
        "run",
        SYSTEM,
        "--quiet",
        "--out",
        str(folder),
    ]
    seen = None
    begin = time.perf_counter()
    with subprocess.Popen(
        [*command, *options], env=environment(str(folder)), cwd=ROOT, stdout=subprocess.DEVNULL
    ) as child:
        while child.poll() is None:
            if seen is None and picture.exists():
                seen = time.perf_counter() - begin
            time.sleep(LOOK_EVERY_S)
        ended = time.perf_counter() - begin
    if child.returncode:
        raise subprocess.CalledProcessError(child.returncode, command)
    if seen is None:
        raise RuntimeError(f"{picture.name}: expected a first picture before the many runs.")
    return seen, ended
