"""A header of `write_c`, compiled with the system's compiler and called through ctypes."""

import ctypes
import shutil
import subprocess

import numpy as np

COMPILER = shutil.which("cc")
FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fPIC")
CALLS = """#include "{name}.h"
void are_safe(long n, const double *p0, const double *k, unsigned char *out)
{{
    for (long i = 0; i < n; ++i)
        out[i] = (unsigned char){name}_is_safe(p0 + i * {name}_N_P, k + i * {name}_N_K);
}}
int nearest(const double *p0, const double *wanted, double *k)
{{
    return {name}_nearest_plan(p0, wanted, k);
}}
"""


class Header:
    """The functions of a header at `path`, which is compiled beside it."""

    def __init__(self, path, *flags: str, compiler: str | None = COMPILER):
        source = path.with_suffix(".c")
        source.write_text(CALLS.format(name=path.stem))
        compiled, built = str(path.with_suffix(".o")), str(path.with_suffix(".so"))
        _run([compiler, *FLAGS, *flags, "-c", str(source), "-o", compiled])
        # Linked without the flags: with -Ofast what is loaded here would make the processor take
        # subnormal numbers for zero, in all of this process.
        _run([compiler, "-shared", compiled, "-o", built])
        self._library = ctypes.CDLL(built)

    def are_safe(self, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
        """(n,) bool of p0 (n, n_p), k (n, n_k)."""
        out = np.zeros(len(p0), np.uint8)
        self._library.are_safe(ctypes.c_long(len(p0)), _at(p0), _at(k), _at(out))
        return out.astype(bool)

    def nearest(self, p0: np.ndarray, wanted: np.ndarray) -> np.ndarray | None:
        """The plan k (n_k,) that the header offers, or None."""
        k = np.full(len(wanted), np.nan)
        known = self._library.nearest(_at(p0), _at(wanted), _at(k))
        return k if known else None


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def _at(array: np.ndarray):
    if array.dtype != np.uint8:
        array = np.ascontiguousarray(array, np.float64)
    return array.ctypes.data_as(ctypes.c_void_p)
