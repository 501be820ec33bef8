"""The benchmarks as a whole: quick runs of cheap workloads, reports, the page, the command line."""

import json
import types

import numpy as np
import pytest

from benchmarks import baseline, main, run
from benchmarks.bench import Bench
from benchmarks.metrics import exact
from benchmarks.report import page
from benchmarks.result import Result, Skip, Table
from benchmarks.workloads import NAMES, workload

CHEAP = ("regions", "lps", "fails_safely")


@pytest.fixture(scope="module")
def quick():
    return run.run_workloads(Bench(quick=True), CHEAP)


def fake(monkeypatch, **runs):
    """Workloads that cost nothing: name -> function of bench."""
    modules = {
        name: types.SimpleNamespace(__doc__=f"{name}: how it is done.", run=run)
        for name, run in runs.items()
    }
    for module in (run, baseline):
        monkeypatch.setattr(module, "workload", modules.__getitem__)
    monkeypatch.setattr(run, "NAMES", tuple(runs))


def skipping(bench):
    raise Skip("nothing to measure here")


def breaking(bench):
    raise RuntimeError("boom")


def counting(bench):
    return Result(
        [exact("good.count", 3)], [Table("T", ("a", "b"), [("1", "x|y")], "Mind the gap.")]
    )


@pytest.mark.slow
def test_quick_workloads_report_metrics_of_their_own(quick):
    assert [w["status"] for w in quick["workloads"]] == ["ok"] * len(CHEAP), [
        w["reason"] for w in quick["workloads"]
    ]
    for entry in quick["workloads"]:
        keys = [m["key"] for m in entry["metrics"]]
        assert len(keys) == len(set(keys)) > 3
        assert all(
            key.startswith(entry["name"] + ".") and np.isfinite(m["value"])
            for key, m in zip(keys, entry["metrics"], strict=True)
        )
    values = {m["key"]: m["value"] for entry in quick["workloads"] for m in entry["metrics"]}
    assert values["lps.unknown"] == values["lps.disagree"] == 0
    assert values["regions.2-8-8-8-8.count"] == 394  # as the baseline of the full run must say, too
    assert json.loads(json.dumps(quick)) == quick


def test_every_workload_says_how_it_measures():
    for name in NAMES:
        module = workload(name)
        assert len(module.__doc__) > 100 and callable(module.run)


def test_skipped_and_broken_workloads_do_not_stop_the_others(monkeypatch):
    fake(monkeypatch, first=skipping, second=breaking, good=counting)
    report = run.run_workloads(Bench(quick=True), ("first", "second", "good"))
    assert [w["status"] for w in report["workloads"]] == ["skipped", "failed", "ok"]
    assert "nothing to measure" in report["workloads"][0]["reason"]
    assert (
        run.failed(report) == [f"second: {report['workloads'][1]['reason']}"]
        and "boom" in run.failed(report)[0]
    )


def test_the_committed_page_is_that_of_the_committed_baseline():
    assert baseline.PAGE.read_text() == page(baseline.load_baselines())


def test_command_line_runs_gates_and_refuses(monkeypatch, tmp_path, capsys):
    fake(monkeypatch, good=counting, bad=breaking)
    monkeypatch.setattr("benchmarks.command.NAMES", ("good", "bad"))
    out = tmp_path / "report.json"
    assert main(["--quick", "--only", "good", "--json", str(out)]) == 0
    assert json.loads(out.read_text())["workloads"][0]["metrics"][0]["value"] == 3
    assert main(["--quick", "--only", "bad"]) == 1
    monkeypatch.setattr("benchmarks.baseline.load_baselines", dict)
    assert main(["--only", "good", "--gate"]) == 1 and "no baseline" in capsys.readouterr().out
    assert main(["--only", "bad", "--update-baseline"]) == 1
    for wrong in (
        ["--quick", "--gate"],
        ["--quick", "--update-baseline"],
        ["--only", "nothing"],
        ["--device", "gpu"],
    ):
        assert main(wrong) == 2
    assert main(["--help"]) == 0
