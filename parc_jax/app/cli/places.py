"""Places to write to: tried before the long work, and locked while it runs."""

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from parc_jax.common.errors import InputError


def require_place(path: Path | None, *, folder: bool = False) -> None:
    """Raise InputError when no file can be written at `path`, or no folder be filled there, its
    folders made as needed. None is fine. Leaves nothing behind.
    """
    if path is None:
        return
    if path.is_dir() and not folder:
        raise InputError(
            f"{path}: expected a place for a file; there is a folder of that name. Name a file in "
            "it, or another place."
        )
    inside = path if folder else path.parent
    there = next(p for p in (inside, *inside.parents) if p.exists())
    if not there.is_dir():
        raise InputError(
            f"{path}: cannot be written, since {there} is a file and no folder. Name another place."
        )
    try:
        tempfile.TemporaryFile(dir=there).close()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be written in {there.resolve()} ({error.strerror}). Name another "
            "place, or make room and give the right to write."
        ) from None


@contextlib.contextmanager
def folders(path: Path) -> Iterator[None]:
    """Make the folders above a file; those of them that are empty when the block exits go again."""
    made = [folder for folder in path.parents if not folder.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield
    finally:
        for folder in made:
            with contextlib.suppress(OSError):  # it is not empty, or gone already
                folder.rmdir()


@contextlib.contextmanager
def held(place: Path) -> Iterator[None]:
    """Lock a file or folder against other commands until the block exits: by the operating system,
    on .NAME.lock beside it, until its process ends, however that ends. Raises InputError.
    """
    at = place.resolve()
    lock = at.parent / f".{at.name}.lock"
    with folders(lock), contextlib.ExitStack() as until:
        try:
            until.enter_context(FileLock(lock, timeout=0))
        except Timeout:
            raise InputError(
                f"{place}: expected a place that nobody else writes to; another process does. "
                "Wait for it, stop it, or name another --out."
            ) from None
        until.callback(lock.unlink, missing_ok=True)
        yield
