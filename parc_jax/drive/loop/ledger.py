"""The folder of a claim about episodes: a line for each, written whole."""

import fcntl
import json
import os
from pathlib import Path

from parc_jax.common.errors import InputError
from parc_jax.drive.loop.outcome import Driven
from parc_jax.learning.runs.chunks import refuse_other_work
from parc_jax.learning.runs.files import write_atomic

LINES, ABOUT = "episodes.jsonl", "meta.json"


class Ledger:
    """Open while it is written: `with Ledger(folder, meta) as ledger`.

    meta: what the episodes are of; a folder of others is refused. done: episodes by their number.
    """

    def __init__(self, folder: str | Path, meta: dict):
        self.folder, self.meta = Path(folder), meta
        self.done: dict[int, Driven] = {}

    def __enter__(self) -> "Ledger":
        self.folder.mkdir(parents=True, exist_ok=True)
        self._file = os.open(self.folder / LINES, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            self._open()
        except BaseException:
            os.close(self._file)
            raise
        return self

    def __exit__(self, *_) -> None:
        os.close(self._file)

    def add(self, one: Driven) -> None:
        """Keep an episode, on the disk when this returns."""
        line = json.dumps(one._asdict()) + "\n"
        os.write(self._file, line.encode())
        os.fsync(self._file)
        self.done[one.number] = one

    def _open(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # ends with the process
        except OSError:
            raise InputError(
                f"{self.folder}: expected a folder that nobody writes; another run does."
            ) from None
        about = self.folder / ABOUT
        if about.exists():
            refuse_other_work(self.folder, json.loads(about.read_text()), self.meta)
        else:
            write_atomic(about, json.dumps(self.meta, sort_keys=True, indent=1).encode())
        text = (self.folder / LINES).read_bytes()
        whole = text.rfind(b"\n") + 1
        os.ftruncate(self._file, whole)  # a line that a killed run did not finish
        for i, line in enumerate(text[:whole].splitlines()):
            one = _read(self.folder / LINES, i, line)
            if one.number in self.done:
                raise InputError(
                    f"{self.folder / LINES}: expected every episode once; {one.number} stands "
                    "there twice."
                )
            self.done[one.number] = one


def _read(path: Path, i: int, line: bytes) -> Driven:
    try:
        return Driven(**json.loads(line))
    except (ValueError, TypeError):
        raise InputError(
            f"{path}: expected an episode in every line; line {i + 1} is none. Lines are not to be "
            "changed: take the folder away and drive again."
        ) from None
