"""Places to write to: tried before the long work, and locked while it runs."""

import contextlib
import os
import socket
import sys
import tempfile
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

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


try:
    import fcntl
except ImportError:  # Windows: no lock
    fcntl = None


@contextlib.contextmanager
def held(place: Path) -> Iterator[None]:
    """Lock a file or folder against other commands until the block exits. Raises InputError that
    names the holder.

    The lock is the operating system's, on .NAME.lock beside the place, and ends with its process,
    however that ends; the text in the file is for people.
    """
    if fcntl is None:
        yield
        return
    place_at = place.resolve()
    lock = place_at.parent / f".{place_at.name}.lock"
    with folders(lock), contextlib.closing(_locked(lock, place)) as handle:
        # text that its holder did not remove: the process was killed, and its lock went with it
        before = handle.read().strip()
        if before:
            print(f"parc-jax: {place} is taken over from {before}, which is gone.", file=sys.stderr)
        handle.truncate(0)
        now = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
        handle.write(f"process {os.getpid()} on {socket.gethostname()} since {now}\n")
        handle.flush()
        try:
            yield
        finally:
            lock.unlink(missing_ok=True)


def _locked(lock: Path, place: Path):
    """The open file, locked by this process. Raises InputError."""
    while True:
        handle = open(lock, "a+")
        handle.seek(0)
        try:
            fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            holder = handle.read().strip() or "another process"
            handle.close()
            raise InputError(
                f"{place}: expected a place that nobody else writes to; it is held by {holder}. "
                "Wait for it, stop it, or name another --out."
            ) from None
        with contextlib.suppress(FileNotFoundError):
            # the last holder may have removed the file that was opened here; opening it a second
            # time would give up the lock
            if os.path.samestat(os.stat(lock), os.fstat(handle.fileno())):
                return handle
        handle.close()
