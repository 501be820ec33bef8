"""A cache of compiled programs, in a private folder per jaxlib version and processor."""

import contextlib
import ctypes
import hashlib
import os
import platform
from pathlib import Path

WORTH_KEEPING_S = 0.005  # [s] of compiling: reading a program takes less
M_ARENA_MAX = -8  # of malloc.h: as many as eight times the cores leave hundreds of MB in holes


def spare_memory() -> None:
    """Have glibc, where it is the library, keep an arena per core, from now on."""
    with contextlib.suppress(OSError, AttributeError):  # no glibc
        ctypes.CDLL(None).mallopt(M_ARENA_MAX, os.cpu_count() or 1)


def keep_compiled() -> None:
    """Turn JAX's persistent cache on, in a folder of its version and processor, readable by its
    owner only, since it holds native code; or where JAX_COMPILATION_CACHE_DIR is set.
    """
    import jax
    import jaxlib

    if os.environ.get("JAX_COMPILATION_CACHE_DIR") is None:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder = base / "parc_jax" / f"jaxlib-{jaxlib.__version__}-{processor()}"
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError:
            return  # a read-only home: compile anew
        jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", WORTH_KEEPING_S)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)


def processor() -> str:
    """A name of the processor that code is compiled for."""
    text = platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        text += next((line for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        text += platform.processor()
    return hashlib.sha256(text.encode()).hexdigest()[:12]
