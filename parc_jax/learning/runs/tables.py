"""Folders of CSV logs as arrays by name."""

import csv
import itertools
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError, reading
from parc_jax.common.spelling import some_of
from parc_jax.learning.labels import unit_of, words_in
from parc_jax.learning.runs.files import RAGGED

TABLES = ("k.csv", "q.csv", "groups.csv")  # beside the folder p
# names of what is not read and may tell of runs: tables that are neither hidden nor a note
_TABLE = r"\.(csv|tsv|txt|dat|np[yz]|mat|parquet|xlsx?|ods|json|h5|hdf5|feather|pkl)\b"
UNREAD = rf"(?i)(?!.*(/|^)(\.|readme))(p/.*{_TABLE}|([kqp]|groups?){_TABLE}|.*\.[ct]sv\b)"
_HEADERS = ("group", "groups", "recording", "recordings", "run", "log", "file", "bag", "name")
_ROWS = {*_HEADERS, *"index idx id row number no unnamed header seq timestamp stamp epoch".split()}
_TIMES = {*"t time date datetime unix sec nsec nanosec ms ns 0".split()}  # but `T [N]`, `t_0 [s]`


def folder_arrays(path: Path) -> dict:
    """Arrays k, p, q, groups of a folder of CSV files, and labels. Raises InputError."""
    tables = {one.name.lower(): one for one in path.glob("[!.]*") if one.name.lower() in TABLES}
    runs = sorted(x for x in (path / "p").glob("[!.]*") if x.suffix.lower() == ".csv")
    others = {*path.rglob("*"), *(path / "p").rglob("*")}.difference(tables.values(), runs)
    names = sorted(x.relative_to(path).as_posix() for x in others if not x.is_dir())
    if left := [name for name in names if re.match(UNREAD, name)]:
        raise InputError(
            f"{path}: expected {', '.join(TABLES)}, and runs as p/*.csv; got {some_of(left)}. Is "
            "it misspelled? A failed run stays beside the others; put other tables elsewhere."
        )
    for before, after in itertools.pairwise(run.stem for run in runs):
        # where both orders differ nobody knows which of them the rows of k.csv are in
        if _by_number(before) > _by_number(after):
            raise InputError(
                f"{path}: expected files in p/ that sort as text in the order of their numbers, "
                f"which is that of the rows of k.csv; as text {before}.csv comes before "
                f"{after}.csv. Write all numbers with equally many digits, such as run01.csv."
            )
    if "k.csv" not in tables or not runs:
        raise InputError(f"{path}: expected k.csv and one file per run in {path / 'p'}; not there.")
    k, k_names = _csv(tables["k.csv"])
    tracks, p_names = zip(*map(_csv, runs), strict=True)
    if len(k) != len(tracks):
        raise InputError(
            f"{path}: expected as many rows in k.csv as files in p/; got {len(k)}, {len(tracks)}."
        )
    for row, (run, track, named) in enumerate(zip(runs, tracks, p_names, strict=True)):
        if track.shape != tracks[0].shape:
            raise InputError(
                f"{run}: expected {tracks[0].shape} as row 0; row {row} has {track.shape}. {RAGGED}"
            )
        if named != p_names[0]:  # columns are read by their place
            first, own = (", ".join(names or ("without names",)) for names in (p_names[0], named))
            raise InputError(f"{run}: expected columns {first}, like {runs[0].name}; got {own}.")
    names = {"k": k_names, "p": p_names[0]}
    arrays = {"k": k, "p": np.stack(tracks), "labels": names}
    if "q.csv" in tables:
        arrays["q"], names["q"] = _csv(tables["q.csv"])
    if "groups.csv" in tables:
        arrays["groups"] = _groups(tables["groups.csv"], len(k))
    return arrays


def check_parameters(owner: str | Path, k: np.ndarray, names: Sequence[str]) -> None:
    """Refuse a run's row, recording or time, by name or as it counts. Raises InputError."""
    steps = np.diff(k, axis=0)
    even = (steps == steps[:1]).all(axis=0) & (len(k) >= 10)
    counts = even & (steps != 0.0).all(axis=0) & (k == np.round(k)).all(axis=0) & ~even.all()
    for name, count, column in zip(names, counts, k.T, strict=True):
        words, unit = {*words_in(name)}, unit_of(name)
        told = words <= _ROWS | _TIMES and (not unit or words & _ROWS)
        stamp = unit in ("", "s") and (np.abs(column) > 1e8).any()
        if told or stamp or (count and (not unit or column[:2].tolist() in ([0, 1], [1, 2]))):
            raise InputError(
                f"{owner}: expected parameters as k, with units; got {name!r}, which tells a run's "
                "row, recording or time. Leave it out (groups.csv), or name its unit, as 'T [s]'."
            )


def _groups(path: Path, n: int) -> np.ndarray:
    """(n,) names of recordings, a line each, below an optional header. Raises InputError for any
    other number of lines: a name that slips by one row is that of another recording.
    """
    names = [line.strip() for line in _text(path).rstrip().splitlines()]
    if names and names[0].lstrip("# ").lower() in _HEADERS:
        names = names[1:]
    # a number of the row, or a time, before the name makes each row a recording of its own
    if more := [line for line in names if sum(map(bool, next(csv.reader([line])))) > 1]:
        raise InputError(f"{path}: expected one column, a name a line; got {more[0]!r:.60}.")
    if len(names) != n or not all(names):
        empty = f", line {names.index('') + 1} of them empty" if "" in names else ""
        raise InputError(
            f"{path}: expected a name for each of {n} rows of k.csv, a line each, and before them "
            f"at most a header, one of {', '.join(_HEADERS)}; got {len(names)}{empty}."
        )
    return np.array(names, dtype=str)


def _text(path: Path) -> str:
    """Of a file, without the mark at its beginning that some programs write. Raises InputError."""
    with reading(path, "a table as text in UTF-8"):
        return path.read_text(encoding="utf-8-sig")


def _by_number(name: str) -> list:
    parts = re.split(r"([0-9]+)", name)  # text and digits in turn
    return [int(part) if i % 2 else part for i, part in enumerate(parts)]


def _csv(path: Path) -> tuple[np.ndarray, tuple[str, ...] | None]:
    """Numbers (rows, columns) of a CSV file, and names from a first line without numbers."""
    lines = [line for line in _text(path).splitlines() if line.strip()]
    names = None
    try:
        [float(cell) for cell in lines[0].split(",")]
    except ValueError:
        first = csv.reader([lines.pop(0).lstrip("# ")], skipinitialspace=True)
        names = tuple(cell.strip() for cell in next(first))
    except IndexError:
        raise InputError(f"{path}: expected rows of numbers; the file is empty.") from None
    with reading(path, "rows of as many numbers each, separated by commas"):
        rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    if names is not None and rows.ndim == 2 and len(names) != rows.shape[1]:
        raise InputError(
            f"{path}: expected a first line with {rows.shape[1]} columns; got {len(names)} names."
        )
    return rows, names
