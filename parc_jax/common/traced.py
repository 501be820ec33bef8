"""Kernels that a later process need not trace: what one is traced to is kept, as StableHLO, in the
folder of compiled programs, since to trace and lower it takes longer than to read it compiled.

A file's name is a hash of all that it depends on: sources, versions, settings of JAX, shapes,
device. What does not fit is not found; what cannot be read is traced anew.
"""

import contextlib
import hashlib
import os
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import jax
import jaxlib
from jax import export

from parc_jax.common.backend import platform_of

# all that kernels of `safe_set` are made from: tests/test_traced.py holds them to it
ROOMS = ("checker", "common", "learning", "problem", "safe_set")
ABOUT_FILES = ("cache", "dump", "log", "traceback")  # settings that change no program
_folders: list[Path] = []
_programs: dict[str, Callable] = {}


def keep_traced(folder: Path) -> None:
    """Keep in that folder what kernels are traced to from now on, and look for it there."""
    _folders[:] = [folder]


def traced(
    kernel: Callable, args: tuple, static: tuple, device: jax.Device, options: dict | None
) -> Callable:
    """kernel(*args, *static) as a compiled function of arguments like these.

    kernel: of `jax.jit`, static: its arguments that are no arrays; options: for the compiler.
    Without a folder it is the kernel itself.
    """
    if not _folders:
        return lambda *args: kernel(*args, *static)
    leaves, tree = jax.tree.flatten(args)
    platform = platform_of(device)
    shapes = [(x.shape, str(x.dtype), getattr(x, "weak_type", False)) for x in leaves]
    about = (kernel.__qualname__, str(tree), shapes, static, platform, _settings(), _sources())
    name = hashlib.sha256(repr(about).encode()).hexdigest()
    if name not in _programs:

        def flat(*leaves: jax.Array):
            return kernel.__wrapped__(*jax.tree.unflatten(tree, leaves), *static)

        call = _kept(_folders[0] / f"{name}.stablehlo", flat, leaves, platform)

        def program(*args):
            return call(*jax.tree.leaves(args))

        program.__name__ = kernel.__name__
        _programs[name] = jax.jit(program, compiler_options=options)
    return _programs[name]


def _kept(file: Path, flat: Callable, leaves: list[jax.Array], platform: str) -> Callable:
    """The function as it was traced once and is kept in that file; as it is if it cannot be."""
    with contextlib.suppress(Exception):  # none yet, or cut off, or of another form
        return export.deserialize(bytearray(zlib.decompress(file.read_bytes()))).call
    with contextlib.suppress(Exception):  # what the format lacks, a disk that is full or read-only
        text = export.export(jax.jit(flat), platforms=[platform])(*leaves).serialize()
        part = file.with_suffix(f".{os.getpid()}")
        part.write_bytes(zlib.compress(text))
        part.replace(file)
        return export.deserialize(text).call  # as later processes do: one compiled program for all
    return flat


@cache
def _sources() -> str:
    """A hash of all that kernels are made from, and of the versions of JAX."""
    digest = hashlib.sha256(f"{jax.__version__} {jaxlib.__version__}".encode())
    for room in ROOMS:
        for file in sorted(Path(__file__).parents[1].joinpath(room).rglob("*.py")):
            digest.update(f"{file} {file.stat().st_size} ".encode() + file.read_bytes())
    return digest.hexdigest()


def _settings() -> list[tuple[str, str]]:
    """What JAX is set to here."""
    names = (name for name in jax.config.values if not any(word in name for word in ABOUT_FILES))
    return [(name, repr(getattr(jax.config, name, None))) for name in sorted(names)]
