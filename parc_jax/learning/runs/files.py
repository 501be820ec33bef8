"""Files that are either whole or absent: atomic writes, and the .npz form of a rollout batch."""

import contextlib
import json
import os
import secrets
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import BinaryIO

import numpy as np

from parc_jax.common.errors import InputError, reading
from parc_jax.common.sets.box import box
from parc_jax.learning.runs.batch import BY_ROW, RolloutBatch, rollout_batch
from parc_jax.learning.runs.law import LawSpec
from parc_jax.learning.system import time_grid
from parc_jax.learning.systems.content import whole_digest

FORMAT = "parc_jax.rollouts/1"
STATED = ("seed", "stage", "points", "rotation", "given", "source")  # of a batch, as plain values
KNOWN = "lo hi meta format time law made_by labels digest".split()  # of a file, beside these
# of an archive with a wrong byte, which may also look encrypted or of a later version
DAMAGED = (zipfile.BadZipFile, zlib.error, EOFError, OSError, AttributeError, RuntimeError)
RAGGED = (
    "Runs of different lengths go onto one record grid first: interpolate each at the times of the "
    "grid, with NaN after its end (page Your own robot, door 3)."
)


def write_atomic(path, data: bytes | Callable[[BinaryIO], None]) -> Path:
    """Write bytes, or call data(file), into a temporary file beside `path`, then rename: a reader
    never sees half a file. A failed write leaves nothing behind.
    """
    with reading(path, "a place for a file; name another"):
        path = Path(path)
        temporary = path.with_name(f".{path.name[:50]}.{secrets.token_hex(8)}.tmp")  # of this call
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise IsADirectoryError("a folder of that name is there")
    try:
        with open(temporary, "wb") as handle:
            if callable(data):
                data(handle)
            else:
                handle.write(data)
            handle.flush()
            os.fsync(handle.fileno())
        os.replace(temporary, path)
    except BaseException:  # a full disk, a folder of that name, Ctrl-C
        temporary.unlink(missing_ok=True)
        raise
    return path


def write_npz(path, arrays: dict, compressed: bool = False) -> Path:
    """Atomic .npz of named arrays. compressed: smaller and slower."""
    write = np.savez_compressed if compressed else np.savez
    return write_atomic(path, lambda file: write(file, **arrays))


def read_npz(path) -> dict[str, np.ndarray]:
    """All arrays of an .npz file. Raises InputError when it is missing or damaged."""
    try:
        with open(Path(path), "rb") as handle, np.load(handle, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (ValueError, TypeError, *DAMAGED) as error:
        told = f"a complete .npz file; it is truncated or damaged ({error}). Write it again."
        if "Object arrays" in str(error):
            told = f"arrays of numbers; one is a list. {RAGGED}"
        raise InputError(f"{path}: expected {told}") from None


def save_rollouts(path, batch: RolloutBatch, made_by: dict | None = None) -> Path:
    """Save a batch as .npz, atomically. `load_rollouts` gives back equal numbers.

    made_by: JSON-able facts about the program that made the runs, for `collect(path=)`.
    """
    return write_npz(path, rollouts_to_npz(batch, made_by))


def rollouts_to_npz(batch: RolloutBatch, made_by: dict | None = None) -> dict[str, np.ndarray]:
    """The arrays of `save_rollouts`."""
    meta = {"format": FORMAT, "time": asdict(batch.time), "law": asdict(batch.law)}
    meta |= {"made_by": made_by, "labels": batch.labels and batch.labels._asdict()}
    meta |= {name: getattr(batch, name) for name in STATED}
    arrays = {name: np.asarray(x) for name in BY_ROW if (x := getattr(batch, name)) is not None}
    arrays |= {"lo": batch.domain.lo, "hi": batch.domain.hi}
    meta["digest"] = digest_of(arrays, meta)
    return arrays | {"meta": np.array(json.dumps(meta))}


def rollouts_from_npz(path, arrays: dict) -> RolloutBatch:
    """The batch in the arrays of a file written by `save_rollouts`. Raises InputError."""
    meta = meta_of(arrays)
    if meta.get("format") != FORMAT:
        raise InputError(f"{path}: expected format {FORMAT}; got {meta.get('format')!r}.")
    if others := sorted({*arrays, *meta} - {*KNOWN, *BY_ROW, *STATED}):  # said for nothing
        raise InputError(f"{path}: expected names of save_rollouts; got {', '.join(others)} too.")
    with reading(path, "all parts of a file of save_rollouts"):
        runs = [arrays.get(name) for name in BY_ROW]  # older files have a digest of these, or none
        now = digest_of(arrays, meta) if "digest" in meta else whole_digest(runs)
        if meta.get("digest", (meta.get("made_by") or {}).get("runs")) not in (None, now):
            raise InputError(
                f"{path}: holds other rollouts than were made; expected the same runs, time, K, "
                "law and labels as saved. To change some, load it, and save the other batch."
            )
        law = meta["law"] | {"parameters": tuple(tuple(pair) for pair in meta["law"]["parameters"])}
        law = LawSpec(**(law | {"lo": tuple(law["lo"]), "hi": tuple(law["hi"])}))
        about = {name: meta[name] for name in (*STATED, "labels") if meta.get(name) is not None}
        about = {x: tuple(of) if isinstance(of, list) else of for x, of in about.items()}
        about |= {name: arrays[name] for name in BY_ROW if name in arrays or name in BY_ROW[:4]}
        K, time = box(arrays["lo"], arrays["hi"]), time_grid(**meta["time"])
        return rollout_batch(time=time, domain=K, law=law, **about)


def digest_of(arrays: dict, meta: dict) -> str:
    """Of all else that a file of rollouts holds, as it is there: one that was edited is refused."""
    told = {"meta": json.dumps(meta | {"digest": None})}
    return whole_digest(sorted((arrays | told).items()))


def meta_of(arrays: dict) -> dict:
    """What `save_rollouts` wrote beside the arrays of a file; empty for a file of others."""
    with contextlib.suppress(KeyError, ValueError, RecursionError):
        meta = json.loads(str(arrays["meta"]))
        return meta if isinstance(meta, dict) and "format" in meta else {}
    return {}
