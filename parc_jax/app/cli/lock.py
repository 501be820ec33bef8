"""One command at a time at a place: who holds it, and since when."""

import contextlib
import os
import socket
import sys
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from parc_jax.app.cli.places import folders
from parc_jax.common.errors import InputError

try:
    import fcntl
except ImportError:  # Windows: nobody is kept out
    fcntl = None


@contextlib.contextmanager
def held(place: Path) -> Iterator[None]:
    """Keep other commands away from a file or folder until the block exits. Raises InputError that
    says who holds it.

    The lock is the operating system's, on .NAME.lock beside the place, and ends with its process,
    however that ends; what the file says is for people.
    """
    if fcntl is None:
        yield
        return
    whole = place.resolve()
    lock = whole.parent / f".{whole.name}.lock"
    with folders(lock), contextlib.closing(_locked(lock, place)) as handle:
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
            # whoever held it may have removed the file that was opened here; to open it a second
            # time would give up the lock
            if os.path.samestat(os.stat(lock), os.fstat(handle.fileno())):
                return handle
        handle.close()
