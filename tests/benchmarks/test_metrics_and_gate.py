"""The metric contract and the gate: what is reported is gated, what got worse closes it, what was
skipped says why.
"""

import pytest

from benchmarks.gate import gate, worse
from benchmarks.metrics import Metric, exact, times


def report(*entries, device="chip", processors=2):
    environment = {"platform": "cpu", "device": device, "devices": 1, "processors": processors}
    return {"environment": environment, "workloads": list(entries)}


def entry(name, *metrics, status="ok", reason=""):
    return {
        "name": name,
        "status": status,
        "reason": reason,
        "metrics": [m.to_json() for m in metrics],
    }


@pytest.mark.parametrize(
    ("better", "value", "is_worse"),
    [
        ("lower", 121.0, True),
        ("lower", 119.0, False),
        ("lower", 1.0, False),
        ("higher", 79.0, True),
        ("higher", 81.0, False),
        ("higher", 1e9, False),
        ("same", 121.0, True),
        ("same", 79.0, True),
        ("same", 100.0, False),
    ],
)
def test_worse_is_beyond_the_tolerance_in_the_bad_direction(better, value, is_worse):
    before = Metric("w.x", 100.0, "count", better, rel_tol=0.1, abs_tol=10.0)
    assert worse(Metric("w.x", value, "count", better), before) is is_worse


def test_a_changed_count_closes_the_gate_on_every_machine():
    before = report(entry("w", exact("w.regions", 425)))
    assert gate(before, before).open
    for device in ("chip", "another"):
        verdict = gate(report(entry("w", exact("w.regions", 424)), device=device), before)
        assert not verdict.open and "w.regions" in verdict.failures[0]


def test_times_close_the_gate_on_the_same_machine_only():
    before, slow = report(entry("w", *times("w.t", [1.0]))), entry("w", *times("w.t", [9.0]))
    assert not gate(report(slow), before).open
    elsewhere = gate(report(slow, device="another"), before)
    assert elsewhere.open and "times not compared" in elsewhere.notes[0]
    assert gate(report(slow, processors=64), before).open


def test_lost_metrics_and_broken_workloads_close_the_gate_skipped_ones_are_noted():
    before = report(entry("w", exact("w.a", 1), exact("w.b", 2)), entry("v", exact("v.a", 1)))
    lost = gate(report(entry("w", exact("w.a", 1)), entry("v", exact("v.a", 1))), before)
    assert lost.failures == ["w.b: in the baseline, no longer reported by w"]
    broken = gate(report(entry("w", status="failed", reason="boom")), before)
    assert broken.failures == ["w: failed, boom"] and "v: not run" in broken.notes
    skipped = gate(report(entry("w", status="skipped", reason="no device")), before)
    assert skipped.open and "w: skipped, no device" in skipped.notes
    new = gate(
        report(entry("w", exact("w.a", 1), exact("w.b", 2), exact("w.c", 3)), entry("u")), before
    )
    assert new.open and {"w.c: new, not in the baseline", "u: not in the baseline"} <= set(
        new.notes
    )
    assert not gate(before, None).open
