"""A dozen worlds of the BARN challenge, of all densities, driven on odometry and a lidar alone.

The robot, its model and its guide are those of `python -m sims.barn`: the outline over the wheels,
60 ms from a scan to the command. The robot waits while it is planned, so that a machine decides
nothing; a cycle is told in processor time, scan, free space and guidance included. Contacts, tubes
that were left and drift beyond what is allowed for are judged on true poses.
"""

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import LOOSE, exact, metric
from benchmarks.result import Result, Table, milliseconds
from parc_jax.common.spelling import rounded_down


def run(bench: Bench) -> Result:
    """Drive them one after the other."""
    from sims.barn.job import WORLDS
    from sims.barn.series import Options, drive_worlds

    worlds = bench.size(WORLDS, WORLDS[:1])
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "drives.jsonl"
        told, _ = drive_worlds(Options(worlds, odometry=True, out=out, jobs=1, quiet=True))
    reached = sum(one["reached"] and not one["touched"] for one in told)
    median, late = np.median([one["cycle_ms"][:2] for one in told], axis=0) / 1e3
    score, seconds = (np.mean([one[name] for one in told]) for name in ("metric", "seconds"))
    metrics = [
        metric("barn.reached", reached, "count", "higher", abs_tol=1),
        exact("barn.touched", sum(one["touched"] for one in told)),
        exact("barn.left", sum(one["left"] for one in told)),
        metric(
            "barn.drifted", sum(one["drifted"] > 0 for one in told), "count", "lower", abs_tol=1
        ),
        metric("barn.metric", score, "1", "higher", abs_tol=0.05),
        metric("barn.cycle.median", median, "s", "lower", rel_tol=LOOSE),
        metric("barn.cycle.p95", late, "s", "lower", rel_tol=LOOSE),
    ]
    rows = [
        ("goal reached, nothing touched", f"{reached} of {len(told)}"),
        ("metric of the challenge, at most 0.5", f"{score:.3f}"),
        ("time of the 10 m, mean", f"{seconds:.1f} s"),
        ("nearest", f"{rounded_down(100 * min(one['clearance'] for one in told))} cm"),
        ("processor time of a cycle, middle episode", milliseconds(median)),
        ("the same, 95 %", milliseconds(late)),
    ]
    return Result(metrics, [Table("A Jackal on its lidar in clutter", ("what", "value"), rows)])
