"""Unfinished work continues only with the program that it was begun with."""

import contextlib
import hashlib
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from parc_jax.app.cli.places import folders
from parc_jax.common.errors import InputError
from parc_jax.learning.runs.files import write_atomic

KINDS = (".py", ".xml", ".npz")  # files that a robot's program consists of


@contextlib.contextmanager
def only_of(module: ModuleType, work: Path) -> Iterator[None]:
    """Finished runs in `work` of another program, such as the system's own files before they were
    changed, are another robot's: they are discarded if the user says so. Raises InputError if not.

    When nothing was finished inside, `work` is removed again.
    """
    note, now = work / "source.sha256", source_hash(module)
    if work.is_dir() and any(work.iterdir()) and not (note.is_file() and note.read_text() == now):
        _ask_to_discard(work, module.__name__)
        shutil.rmtree(work)
    with folders(note):
        write_atomic(note, now.encode())
        try:
            yield
        finally:
            if work.is_dir() and list(work.iterdir()) == [note]:
                shutil.rmtree(work)


def _ask_to_discard(work: Path, module: str) -> None:
    """Raises InputError unless someone at a terminal says yes."""
    if sys.stdin.isatty() and sys.stderr.isatty():
        print(
            f"parc-jax: {work} holds unfinished runs of another program than {module} as it is "
            "now. Discard them? [y/N] ",
            end="",
            file=sys.stderr,
            flush=True,
        )
        if sys.stdin.readline().strip().lower() in ("y", "yes"):
            return
    raise InputError(
        f"{work}: expected unfinished runs of {module} as it is now; those there are of another "
        "program, or of that module before it was changed. Delete them, or name another --out."
    )


def source_hash(module: ModuleType) -> str:
    """Hash of the module's file, and for a package of everything beside it."""
    path = Path(module.__file__ or "")
    files = (
        [path]
        if path.name != "__init__.py"
        else sorted(p for p in path.parent.rglob("*") if p.suffix in KINDS)
    )
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
