"""Many devices in one process give the numbers of one."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent / "helpers"
# Jobs compile for themselves, and say all they have to say: the settings of conftest.py stay here.
OURS = ("JAX_COMPILATION_CACHE_DIR", "TF_CPP_MIN_LOG_LEVEL")
ENV = {name: value for name, value in os.environ.items() if name not in OURS}
ENV |= {"PYTHONPATH": f"{HERE}:{HERE.parents[1]}", "JAX_PLATFORMS": "cpu"}


def said_by(out, devices: int):
    """What one process with so many devices says."""
    command = [sys.executable, HERE / "distributed_job.py", out, str(devices)]
    done = subprocess.run(command, env=ENV, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return np.load(out)


@pytest.mark.night
def test_eight_devices_in_one_process_give_the_same_bits(tmp_path):
    eight, alone = (said_by(tmp_path / f"{n}.npz", n) for n in (8, 1))
    for name in alone.files:
        np.testing.assert_array_equal(eight[name], alone[name], err_msg=name)
    assert alone["found"].any() and not alone["found"].all()
