"""Threads share what memory is free."""

import platform
import subprocess
import sys

import pytest

CODE = """
import ctypes, os, sys, threading
from parc_jax.app.study import cache

if sys.argv[1] == "spared":
    cache.spare_memory()
libc, n = ctypes.CDLL(None), 4 * os.cpu_count() + 4
together = threading.Barrier(n + 1)

def hold():
    some = [bytes(1000) for _ in range(100)]
    together.wait()
    together.wait()

for _ in range(n):
    threading.Thread(target=hold).start()
together.wait()
libc.fopen.restype = ctypes.c_void_p
out = libc.fopen(sys.argv[2].encode(), b"w")
libc.malloc_info(0, ctypes.c_void_p(out))
libc.fclose(ctypes.c_void_p(out))
together.wait()
raise SystemExit(int(open(sys.argv[2]).read().count("<heap nr=") > os.cpu_count()))
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of glibc alone")
def test_there_are_no_more_arenas_of_memory_than_cores(tmp_path):
    command = [sys.executable, "-c", CODE]
    for how, more in (("as it is", 1), ("spared", 0)):
        done = subprocess.run([*command, how, str(tmp_path / "heaps")], capture_output=True)
        assert done.returncode == more, done.stderr
