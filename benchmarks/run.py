"""Run workloads one after another into a report: a plain dictionary that is JSON and from which the
page is made.
"""

import time
import traceback
from collections.abc import Sequence

from benchmarks.bench import Bench
from benchmarks.environment import environment
from benchmarks.metrics import repeated_keys
from benchmarks.result import Result, Skip
from benchmarks.workloads import NAMES, workload

FORMAT = "parc_jax.benchmarks/1"


def run_workloads(bench: Bench, names: Sequence[str] = NAMES, say=lambda line: None) -> dict:
    """Report of the named workloads. A workload that cannot run is skipped with its reason; one
    that breaks is reported as failed and the others go on. say: called with a line of progress."""
    report = {"format": FORMAT, "quick": bench.quick, "environment": environment(), "workloads": []}
    for name in names:
        say(f"{name} ...")
        entry = _one(name, bench)
        report["workloads"].append(entry)
        say(
            f"{name}: {entry['status']}{', ' + entry['reason'] if entry['reason'] else ''} "
            f"({entry['seconds']:.1f} s)"
        )
    return report


def _one(name: str, bench: Bench) -> dict:
    module, begin = workload(name), time.perf_counter()
    status, reason, result = "ok", "", Result([])
    try:
        result = module.run(bench)
        if repeated := repeated_keys(result.metrics):
            raise ValueError(f"metrics reported twice: {', '.join(repeated)}")
        if strange := [m.key for m in result.metrics if not m.key.startswith(f"{name}.")]:
            raise ValueError(f"metrics of another workload: {', '.join(strange)}")
    except Skip as why:
        status, reason = "skipped", str(why)
    except Exception as error:  # one broken workload must not lose the results of the others
        last = traceback.extract_tb(error.__traceback__)[-1]
        status, reason = (
            "failed",
            f"{type(error).__name__}: {error} ({last.name}, line {last.lineno})",
        )
        result = Result([])
    return {
        "name": name,
        "method": module.__doc__,
        "status": status,
        "reason": reason,
        "seconds": round(time.perf_counter() - begin, 1),
        "metrics": [m.to_json() for m in result.metrics],
        "tables": [t.to_json() for t in result.tables],
        "data": result.data,
    }


def failed(report: dict) -> list[str]:
    """Names and reasons of the workloads that broke."""
    return [f"{w['name']}: {w['reason']}" for w in report["workloads"] if w["status"] == "failed"]


def merged(before: dict | None, now: dict) -> dict:
    """`now`, with the workloads of an earlier report that were not run this time, in the order of
    `NAMES`. These say under "earlier" where and when they were run.
    """
    earlier = []
    if before is not None:
        own = {name: before["environment"][name] for name in ("commit", "date", "load")}
        earlier = [{"earlier": own, **entry} for entry in before["workloads"]]
    entries = {entry["name"]: entry for entry in [*earlier, *now["workloads"]]}
    return now | {"workloads": [entries[name] for name in NAMES if name in entries]}
