"""Many devices and many hosts give the numbers of one process; a killed process ends the run, which
then continues.
"""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest
from local_rows import local_rows

from parc_jax.common import distributed
from parc_jax.common.errors import HostLost, InputError

HERE = Path(__file__).parent / "helpers"
# Hosts compile for themselves, and say all they have to say: the settings of conftest.py stay here.
OURS = ("JAX_COMPILATION_CACHE_DIR", "TF_CPP_MIN_LOG_LEVEL")
ENV = {name: value for name, value in os.environ.items() if name not in OURS}
ENV |= {"PYTHONPATH": f"{HERE}:{HERE.parents[1]}", "JAX_PLATFORMS": "cpu"}


def start(out, devices: int, *more: str):
    command = [sys.executable, HERE / "distributed_job.py", out, str(devices), *more]
    return subprocess.Popen(
        command, env=ENV, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def start_two(folder, *last: str):
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{s.getsockname()[1]}"
    return [
        start(folder / f"host{i}.npz", 1, f"{address},2,{i}", *(last if i else ()))
        for i in range(2)
    ]


def end(process) -> str:
    text, _ = process.communicate()
    assert process.returncode == 0, text
    return text


def same(a, b):
    for name in a.files:
        if name == "agreed":
            np.testing.assert_array_equal(a[name], 0.0)  # the first host's value everywhere
        else:
            np.testing.assert_array_equal(a[name], b[name], err_msg=name)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """What one process with one device says."""
    out = tmp_path_factory.mktemp("alone") / "alone.npz"
    end(start(out, 1))
    return np.load(out)


@pytest.mark.night
def test_eight_devices_in_one_process_give_the_same_bits(alone, tmp_path):
    end(start(tmp_path / "eight.npz", 8))
    same(np.load(tmp_path / "eight.npz"), alone)
    assert alone["found"].any() and not alone["found"].all()


@pytest.mark.night
def test_two_processes_give_the_same_bits_on_both_sides(alone, tmp_path):
    for process in start_two(tmp_path):
        end(process)
    for host in range(2):
        same(np.load(tmp_path / f"host{host}.npz"), alone)


@pytest.mark.night
def test_a_killed_process_ends_the_run_with_a_message_and_the_run_continues(alone, tmp_path):
    first, second = start_two(tmp_path, "--die-after", "2")
    (text, _), _ = (process.communicate() for process in (first, second))
    assert first.returncode == 1 and second.returncode == -signal.SIGKILL
    assert (
        "another process of this run has ended" in text and "start the same command again" in text
    )
    assert len([*tmp_path.glob("*.parts/chunk_*.npz")]) >= 3  # of both hosts
    for process in start_two(tmp_path):
        end(process)
    same(np.load(tmp_path / "host0.npz"), alone)


def test_one_process_needs_nothing():
    x = {"a": np.arange(6.0).reshape(3, 2)}
    over = distributed.mesh(jax.devices()[:1])
    assert distributed.pad(5, over) == 5
    for placed in (distributed.shard_rows(over, x), distributed.replicate(over, x)):
        np.testing.assert_array_equal(local_rows(placed)["a"], x["a"])
        np.testing.assert_array_equal(distributed.all_rows(placed)["a"], x["a"])
    assert distributed.gather_arrays(x) == [x] and distributed.gather("here") == ["here"]
    np.testing.assert_array_equal(distributed.broadcast(x)["a"], x["a"])
    distributed.require_same("work", {"seed": 1})


def test_hosts_that_describe_other_work_are_refused(monkeypatch):
    monkeypatch.setattr(distributed, "gather", lambda value: [value, value | {"seed": 2}])
    with pytest.raises(InputError, match=r"host 1 differs from host 0 in \['seed'\]"):
        distributed.require_same("rollouts", {"seed": 1, "n": 3})


@pytest.mark.parametrize("hosts", ["here", "a:1,2", "a:1,2,2", "nowhere,2,0"])
def test_bad_hosts_are_explained(hosts):
    with pytest.raises(InputError, match="hosts: expected"):
        distributed.init(hosts)


def test_an_error_of_the_connection_says_that_a_host_was_lost():
    with pytest.raises(HostLost, match="another process"), distributed.reporting_lost_hosts():
        raise jax.errors.JaxRuntimeError("Connection closed by peer")


@pytest.mark.night
def test_one_flag_of_the_shell_shares_a_whole_run(tmp_path):
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{s.getsockname()[1]}"
    words = "run toy_cart --rollouts 300 --hidden 4 4 --eps 0.1 --budget 1"
    words += " --no-figures --no-cache --quiet --out out"
    program = [
        sys.executable,
        "-c",
        "import sys; from parc_jax.app.cli import main; main(sys.argv[1:])",
        *words.split(),
    ]
    env = ENV | {"PYTHONPATH": f"{ENV['PYTHONPATH']}:{HERE}"}
    both = [
        subprocess.Popen(
            [*program, "--hosts", f"{address},2,{i}"],
            cwd=tmp_path,
            env=env,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        for i in range(2)
    ]
    first, second = (end(process) for process in both)
    assert "Written to out" in first and "Written" not in second  # the first one reports
    mine, theirs = (np.load(tmp_path / "out" / where / "model.npz") for where in (".", "hosts/1"))
    for name in mine.files:
        np.testing.assert_array_equal(mine[name], theirs[name])
