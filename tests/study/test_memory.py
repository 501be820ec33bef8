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
