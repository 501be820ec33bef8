"""What a fleet costs on paper, and the one call that measures a GPU."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import pytest

from benchmarks.baseline import load_baselines
from benchmarks.fleet import MACHINES, POWER, PRICE, WORK, cost, table

ROOT = Path(__file__).parents[2]


def measured(*run, python=Path(sys.executable).parent):
    """The call with the Python of these tests, which need not be the shell's."""
    environment = os.environ | {"PATH": os.pathsep.join([str(python), os.environ["PATH"]])}
    return subprocess.run(run, cwd=ROOT, env=environment, capture_output=True, text=True)


def test_costs_are_time_times_power_and_price_and_machines_save_time_alone():
    one = cost(3600, 1, rate=1.0, start=0.0, processors=2)
    assert one == (3600.0, 2 * POWER, 2 * PRICE)
    ten = cost(3600, 10, rate=1.0, start=0.0, processors=2)
    assert ten == (360.0, *one[1:])
    # what it takes to start is paid by each
    late = cost(3600, 10, rate=1.0, start=36.0, processors=2)
    assert late.seconds == 396.0 and late.watt_hours == pytest.approx(1.1 * one.watt_hours)


def test_the_table_is_made_of_the_committed_figures():
    rows = table(load_baselines()["cpu"])
    assert len(rows) == 2 + len(WORK) and rows[0].count("machine") == len(MACHINES)


@pytest.mark.slow
@pytest.mark.skipif(jax.default_backend() == "gpu", reason="it would measure it")
def test_without_a_gpu_the_measurement_says_so_at_once(tmp_path):
    done = measured("benchmarks/gpu.sh", tmp_path / "gpu")
    assert done.returncode == 2 and "JAX offers cpu here" in done.stderr


def test_a_measurement_in_an_environment_without_jax_does_not_pass(tmp_path):
    (tmp_path / "python").write_text("#!/bin/sh\necho no module named jax >&2\nexit 1\n")
    (tmp_path / "python").chmod(0o755)
    done = measured("benchmarks/gpu.sh", tmp_path / "gpu", python=tmp_path)
    assert done.returncode == 1 and "control: not finished" in done.stderr


@pytest.mark.night
def test_the_measurement_is_one_call_that_leaves_a_report_of_all_workloads(tmp_path):
    done = measured("env", "DEVICE=cpu", "benchmarks/gpu.sh", tmp_path, "--quick")
    assert done.returncode == 0 and "not finished" not in done.stderr, done.stderr
    text = (tmp_path / "report.md").read_text()
    for name in ("control", "batch_query", "rollouts", "query"):
        assert f"## {name}" in text and (tmp_path / f"{name}.json").is_file()
