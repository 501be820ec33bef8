"""What a fleet costs on paper, and the one call that measures a GPU."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import pytest

from benchmarks.baseline import load_baselines
from benchmarks.fleet import MACHINES, WORK, table

ROOT = Path(__file__).parents[2]


def measured(*run, python=Path(sys.executable).parent):
    """The call with the Python of these tests, which need not be the shell's."""
    environment = os.environ | {"PATH": os.pathsep.join([str(python), os.environ["PATH"]])}
    return subprocess.run(run, cwd=ROOT, env=environment, capture_output=True, text=True)


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
