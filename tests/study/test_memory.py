"""Memory that is free goes back to the system."""

import platform
import subprocess
import sys

import pytest

CODE = """
import threading
from pathlib import Path
from parc_jax.app.study import cache

def resident():
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) // 1024

cache.EVERY_S = 0.05
cache.spare_memory()
some = [bytes(1000) for _ in range(200_000)]
held = some[::50]  # which leave no long piece free
before = resident()
del some
for _ in range(200):
    if resident() < before / 2:
        break
    threading.Event().wait(0.05)
else:
    raise SystemExit(f"{resident()} MB of {before} are still held")
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of glibc alone")
def test_what_is_free_between_what_is_held_is_handed_back():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of glibc alone")
def test_one_thread_hands_memory_back_however_many_commands_a_process_runs(tmp_path):
    code = """
import sys, threading
from parc_jax.app import cli
for _ in range(3):
    try:
        cli.main(["solve", sys.argv[1]])
    except SystemExit:
        pass
raise SystemExit(threading.active_count() - 1)
"""
    command = [sys.executable, "-c", code, str(tmp_path / "absent.json")]
    assert subprocess.run(command, capture_output=True).returncode == 1
