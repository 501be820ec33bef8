"""Compare a report with the committed baseline. A worse metric, a lost metric or a failed workload
closes the gate.
"""

from typing import NamedTuple

from benchmarks.metrics import Metric


class Verdict(NamedTuple):
    """failures close the gate; notes do not."""

    failures: list[str]
    notes: list[str]

    @property
    def open(self) -> bool:
        """Nothing got worse."""
        return not self.failures


def worse(now: Metric, before: Metric) -> bool:
    """Is `now` worse than `before` by more than the tolerances of `before`?"""
    room = before.rel_tol * abs(before.value) + before.abs_tol
    if before.better == "lower":
        return now.value > before.value + room
    if before.better == "higher":
        return now.value < before.value - room
    return abs(now.value - before.value) > room


def gate(report: dict, baseline: dict | None) -> Verdict:
    """Judge the workloads of a report by those of the baseline of the same platform.

    Times count only when device and number of processors are those of the baseline. A workload that
    was skipped, or not asked for, is noted with its reason.
    """
    failures, notes = [], []
    if baseline is None:
        return Verdict(["no baseline for this platform: make one with --update-baseline"], [])
    same_machine = _machine(report) == _machine(baseline)
    if not same_machine:
        notes.append(
            f"times not compared: baseline on {_machine(baseline)}, this run on {_machine(report)}"
        )
    now = {w["name"]: w for w in report["workloads"]}
    for before in baseline["workloads"]:
        name, run = before["name"], now.pop(before["name"], None)
        if run is None:
            notes.append(f"{name}: not run")
        elif run["status"] == "skipped":
            notes.append(f"{name}: skipped, {run['reason']}")
        elif run["status"] == "failed":
            failures.append(f"{name}: failed, {run['reason']}")
        elif before["status"] == "ok":
            _compare(name, run, before, same_machine, failures, notes)
    for run in now.values():
        (failures if run["status"] == "failed" else notes).append(
            f"{run['name']}: not in the baseline"
        )
    return Verdict(failures, notes)


def _compare(name, run, before, same_machine, failures, notes) -> None:
    values = {m["key"]: Metric(**m) for m in run["metrics"]}
    for old in (Metric(**m) for m in before["metrics"]):
        new = values.pop(old.key, None)
        if new is None:
            failures.append(f"{old.key}: in the baseline, no longer reported by {name}")
        elif (same_machine or not old.tied_to_machine) and worse(new, old):
            failures.append(
                f"{old.key}: {new.value:.4g} {new.unit}, was {old.value:.4g} ({old.better} is "
                "better, "
                f"tolerance {100 * old.rel_tol:g} % + {old.abs_tol:g})"
            )
    notes += [f"{key}: new, not in the baseline" for key in values]


def _machine(report: dict) -> str:
    environment = report["environment"]
    return (
        f"{environment['device']} x {environment['devices']}, {environment['processors']} "
        "processors"
    )
