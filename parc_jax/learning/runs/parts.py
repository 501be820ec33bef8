"""A folder of runs that several jobs fill, each its part of the rows, and that is whole or refused.

Row i depends on (key, stage, i) alone, so the jobs need not know of each other: one line in
meta.json says what all of them run, and a file per part holds its rows.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import jax

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.runs.batch import RolloutBatch, concatenate
from parc_jax.learning.runs.chunks import ChunkStore
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.files import read_npz, rollouts_from_npz
from parc_jax.learning.runs.law import law_of
from parc_jax.learning.runs.resume import refuse_other_work
from parc_jax.learning.runs.rows import k_law, seed_of
from parc_jax.learning.systems.identity import identity_of

FORMAT = "parc_jax.parts/1"


def part_of(rows: range, number: int, parts: int) -> range:
    """The rows of part 1, 2, ... of so many, in order, of sizes that differ by one at most. Raises
    InputError.
    """
    if not 1 <= number <= parts <= len(rows):
        raise InputError(
            f"part: expected NUMBER/PARTS with 1 <= NUMBER <= PARTS <= {len(rows):,}, the rows "
            f"there are; got {number}/{parts}."
        )
    first, last = ((len(rows) * i) // parts for i in (number - 1, number))
    return rows[first:last]


def collect_part(
    system, key: jax.Array, whole: range, rows: range, folder, program: str, quiet: bool = False
) -> Path:
    """Run these rows of the whole, k uniform on K, and keep them in the folder. Returns their file;
    what was stopped goes on where it was, what is finished is looked at again.

    program: what else must be the same for all parts, such as a hash of its files. Raises
    InputError for a folder of other work.
    """
    folder = Path(folder)
    about = _about(system, key, whole, program)
    if is_parts(folder):
        refuse_other_work(folder, _read_about(folder), about)
    path = folder / f"rows_{rows[0]:09d}_{rows[-1]:09d}.npz"
    collect(system, key, len(rows), first_row=rows[0], path=path, quiet=quiet)
    ChunkStore(folder, about)  # written by who is finished first
    return path


def is_parts(folder) -> bool:
    """Is this a folder of `collect_part`?"""
    return (Path(folder) / "meta.json").exists()


def whole_of(folder) -> RolloutBatch:
    """The runs of all parts, in order of their rows. Raises InputError for rows that are missing or
    there twice, and for parts of another key, law or program.
    """
    folder = Path(folder)
    about = _read_about(folder)
    begin, end = about["rows"]
    found = sorted(_parts(folder, about), key=lambda part: part[1].rows[0])
    at, before = begin, None
    for path, batch in found:
        first, last = int(batch.rows[0]), int(batch.rows[-1])
        if first < at:
            raise InputError(
                f"{folder}: expected every row once; {before.name} and {path.name} overlap. Keep "
                "one of them."
            )
        _require_up_to(folder, at, first)
        at, before = last + 1, path
    _require_up_to(folder, at, end)
    return concatenate(batch for _, batch in found)


def _require_up_to(folder: Path, at: int, first: int) -> None:
    if at < first:
        raise InputError(
            f"{folder}: expected every row once; rows {at:,} to {first - 1:,} are missing, and "
            "which they are may depend on how their runs went. Run their parts again, with the "
            "same command."
        )


def _about(system, key, whole: range, program: str) -> dict:
    """What the parts of a folder have in common."""
    return identity_of(system) | {
        "law": law_of(system, k_law(system, None)).hash,
        "format": FORMAT,
        "program": program,
        "rows": [whole.start, whole.stop],
        "key": list(seed_of(key)),
        "stage": int(Stage.TRAIN),
    }


def _read_about(folder: Path) -> dict:
    try:
        about = json.loads((folder / "meta.json").read_text())
        begin, end = about["rows"]
        fine = about["format"] == FORMAT and 0 <= begin < end
    except (ValueError, KeyError, TypeError):
        fine = False
    if not fine:
        raise InputError(
            f"{folder}: expected a folder of parts ({FORMAT}); its meta.json says otherwise. "
            "Collect them into an empty folder."
        )
    return about


def _parts(folder: Path, about: dict) -> Iterator[tuple[Path, RolloutBatch]]:
    """Files with their runs, each compared with what all have in common."""
    begin, end = about["rows"]
    for path in sorted(folder.glob("rows_*.npz")):
        arrays = read_npz(path)
        if "meta" not in arrays:
            raise InputError(f"{path}: expected a part that `collect` wrote. Take it away.")
        batch = rollouts_from_npz(path, arrays)
        made_by = (json.loads(str(arrays["meta"])).get("made_by") or {}).get("system", {})
        have = made_by | {"key": list(batch.seed or ()), "stage": batch.stage}
        wanted = {name: value for name, value in about.items() if name not in _OF_THE_FOLDER}
        differs = sorted(name for name in have | wanted if have.get(name) != wanted.get(name))
        inside = begin <= batch.rows[0] and batch.rows[-1] < end
        if differs or not inside or not (batch.rows == batch.rows[0] + range(batch.n)).all():
            raise InputError(
                f"{path}: holds a part of other work; expected rows {begin:,} to {end - 1:,} in "
                f"order and the same {', '.join(differs) or 'key'}. Take it away, and run its rows "
                "again."
            )
        yield path, batch


_OF_THE_FOLDER = ("format", "program", "rows")
