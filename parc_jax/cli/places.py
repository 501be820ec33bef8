"""Places to write to, looked at before the long work."""

import os
from pathlib import Path

from parc_jax.errors import InputError


def require_place(path: Path | None) -> None:
    """Raise InputError when no file can be written at `path`, its folders made as needed. None is
    fine.
    """
    if path is None:
        return
    if path.is_dir() and path.suffix:
        raise InputError(f"{path}: expected a place for a file; there is a folder of that name.")
    there = next(p for p in (path.parent, *path.parent.parents) if p.exists())
    if not there.is_dir():
        raise InputError(
            f"{path}: cannot be written, since {there} is a file and no folder. Name another place."
        )
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(
            f"{path}: cannot be written, since you may not write in {there.resolve()}. Name "
            "another place, or change its permissions."
        )
