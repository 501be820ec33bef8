"""Unfinished work continues only with the program that it was begun with."""

import contextlib
import hashlib
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from parc_jax.rollout.files import write_atomic

KINDS = (".py", ".xml", ".npz")  # files that a robot's program consists of


@contextlib.contextmanager
def only_of(module: ModuleType, work: Path) -> Iterator[None]:
    """Finished runs in `work` are discarded if the system's own files have changed since: they are
    another robot's.

    When nothing was finished inside, `work` is removed again.
    """
    note, now = work / "source.sha256", source_hash(module)
    if work.is_dir() and any(work.iterdir()) and not (note.is_file() and note.read_text() == now):
        print(
            f"parc-jax: {module.__name__} has changed; the unfinished runs in {work} are "
            "discarded.",
            file=sys.stderr,
        )
        shutil.rmtree(work)
    write_atomic(note, now.encode())
    try:
        yield
    finally:
        if work.is_dir() and list(work.iterdir()) == [note]:
            shutil.rmtree(work)


def source_hash(module: ModuleType) -> str:
    """Hash of the module's file, and for a package of everything beside it."""
    path = Path(module.__file__ or "")
    files = (
        [path]
        if path.name != "__init__.py"
        else sorted(p for p in path.parent.rglob("*") if p.suffix in KINDS)
    )
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
