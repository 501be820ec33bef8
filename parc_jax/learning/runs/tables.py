"""Readers of recorded runs, as arrays by name: MATLAB files, folders of CSV logs, and the table of
a sweep, as a simulator logs it, with one row per record of every run.
"""

import csv
import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.runs.files import RAGGED
from parc_jax.learning.system import TimeGrid

_HEADERS = ("group", "groups", "recording", "recordings", "run", "log", "file", "bag", "name")
NOT_ENOUGH = (
    "how often a k succeeded says nothing of where the robot was, so it proves nothing in another "
    "scene, nor between these k. Log of every run, failed ones too, its number, its k, and its "
    "place at least every dt_record, a row each"
)


def sweep_arrays(table, time: TimeGrid | None, columns: Mapping[str, str | Sequence[str]]) -> dict:
    """Arrays k, p, q of the runs of a table, and the labels of their columns.

    table: a .csv file with a first line of names, or a mapping of names to columns.
    columns: as of `load_rollouts`.
    Raises InputError, also for a table of k and success rates, which is not enough.
    """
    name = table if isinstance(table, str | Path) else "table"
    k, p, q = ([*columns.get(part, ())] for part in ("k", "p", "q"))
    run, t = columns.get("run", "run"), columns.get("t", "t")
    if time is None:
        raise InputError(f"{name}: expected time=time_grid(dt, t_f, dt_record); got none.")
    cells = _columns(name, table)
    names = [run, t, *k, *p, *q]
    missing = [word for word in names if word not in cells]
    if missing or not k or not p:
        raise InputError(
            f"{name}: expected a row per record of every run, with columns {', '.join(names)}; got "
            f"{', '.join(cells):.200} ({', '.join(missing)} missing). If that is a table of k "
            f"and success: {NOT_ENOUGH}."
        )
    clock, ks, ps, qs = (_numbers(name, cells, words) for words in ([t], k, p, q))
    _, first, number = np.unique(cells[run].astype(str), return_index=True, return_inverse=True)
    order = np.argsort(number, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(number))[:-1])
    rows = [parts[i] for i in np.argsort(first)]  # of every run, in the order of their begins
    if max(map(len, rows), default=0) < 2:
        raise InputError(
            f"{name}: expected a row per record of every run; got {len(rows):,} runs of one row. "
            f"If that is the outcome of each: {NOT_ENOUGH}."
        )
    at = time.dt_record * np.arange(time.n_record + 1)
    cut = [_cut(f"{name}, run {cells[run][i[0]]}", i, clock[:, 0], ks, ps, qs, at) for i in rows]
    k_of, p_of, q_of = (np.stack(part) for part in zip(*cut, strict=True))
    cut = {"records": f"straight between samples, {time.dt_record:g} s apart at most"}
    return {"k": k_of, "p": p_of, "q": q_of, "labels": {"k": k, "p": p, "q": q}, "cut": cut}


def _cut(owner: str, rows: np.ndarray, clock, ks, ps, qs, at: np.ndarray):
    """k (n_k,), p (n_record + 1, n_c) and q (n_q,) of one run. Raises InputError."""
    k, since = ks[rows[0]], clock[rows] - clock[rows[0]]
    if not (ks[rows] == k).all():
        raise InputError(
            f"{owner}: expected one k for the whole run; it changes. What is changed on the way is "
            "part of the manoeuvre, and k what decides it."
        )
    steps = np.diff(since)
    if not (steps > 0).all():
        raise InputError(
            f"{owner}: expected a clock that goes on from row to row; it stands, goes back or is "
            f"NaN after {since[np.argmin(steps > 0)]:g} s. Number its runs, or sort them."
        )
    longest = at[1] - at[0]
    before = since[:-1] < at[-1]
    if (steps[before] > longest * (1 + 1e-6)).any():
        raise InputError(
            f"{owner}: expected a sample at least every dt_record = {longest:g} s; there are "
            f"{steps[before].max():g} s between two. Log more often, or choose a longer dt_record."
        )
    ended = since[-1] < at[-1] - 1e-6 * longest
    until = np.minimum(at, since[-1]) if not ended else at
    p = np.column_stack([np.interp(until, since, axis, right=np.nan) for axis in ps[rows].T])
    q = qs[rows[np.argmin(np.abs(since - at[-1]))]]
    return k, p, np.where(ended, np.nan, q)


def _columns(name, table) -> dict[str, np.ndarray]:
    """Columns by their names. Raises InputError."""
    if not isinstance(table, str | Path):
        if not isinstance(table, Mapping) and not hasattr(table, "keys"):
            raise InputError(
                f"table: expected a .csv file, or names with columns; got {type(table).__name__}."
            )
        return {str(word): np.asarray(table[word]) for word in table.keys()}
    try:
        with open(table, newline="") as lines:
            rows = [row for row in csv.reader(lines, skipinitialspace=True) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{name}: expected a .csv file; {error}.") from None
    uneven = [number for number, row in enumerate(rows) if len(row) != len(rows[0])]
    if len(rows) < 2 or uneven:
        raise InputError(
            f"{name}: expected a line of names and rows of as many cells; "
            + (f"row {uneven[0]} has {len(rows[uneven[0]])}." if uneven else "it has no rows.")
        )
    names = [word.strip() for word in rows[0]]
    return dict(zip(names, np.array(rows[1:]).T, strict=True))


def _numbers(name, columns: dict, words: Sequence[str]) -> np.ndarray:
    """Columns (n, len(words)) as floats. Raises InputError."""
    try:
        n = len(next(iter(columns.values())))
        return np.array([columns[word].astype(float) for word in words]).reshape(-1, n).T
    except ValueError as error:
        raise InputError(
            f"{name}: expected numbers in {', '.join(words)}, NaN where there is none; {error}."
        ) from None


def mat_arrays(path: Path) -> dict:
    """Arrays k, p and q of a file of the published code. Raises InputError."""
    from scipy.io import loadmat

    try:
        raw = loadmat(path)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except NotImplementedError:
        raise InputError(
            f"{path}: a version 7.3 file; expected version 7 or older. Save it again with -v7."
        ) from None
    except (ValueError, TypeError, OSError, EOFError) as error:
        raise InputError(
            f"{path}: expected a complete .mat file; it is truncated or damaged ({error})."
        ) from None
    if "ks_data" not in raw or "ps_data" not in raw:
        names = ", ".join(sorted(name for name in raw if not name.startswith("__")))
        raise InputError(
            f"{path}: expected ks_data (n_k, n), ps_data (n_t, n_p, n), qs_data (n_q, n); got "
            f"{names}."
        )
    positions = raw["ps_data"]
    if positions.ndim == 2:  # a single run loses its last axis
        positions = positions[..., None]
    arrays = {"k": raw["ks_data"].T, "p": positions.transpose(2, 0, 1)}
    return arrays | ({"q": raw["qs_data"].T} if raw.get("qs_data", np.zeros(0)).size else {})


def folder_arrays(path: Path) -> dict:
    """Arrays k, p, q, groups of a folder of CSV files, and labels. Raises InputError."""
    runs = sorted((path / "p").glob("*.csv"))
    for before, after in itertools.pairwise(run.stem for run in runs):
        # where both orders differ nobody knows which of them the rows of k.csv are in
        if _by_number(before) > _by_number(after):
            raise InputError(
                f"{path}: expected files in p/ that sort as text in the order of their numbers, "
                f"which is that of the rows of k.csv; as text {before}.csv comes before "
                f"{after}.csv. Write all numbers with equally many digits, such as run01.csv."
            )
    if not (path / "k.csv").exists() or not runs:
        raise InputError(f"{path}: expected k.csv and one file per run in {path / 'p'}; not there.")
    k, k_names = _csv(path / "k.csv")
    tracks, p_names = zip(*map(_csv, runs), strict=True)
    if len(k) != len(tracks):
        raise InputError(
            f"{path}: expected as many rows in k.csv as files in p/; got {len(k)} and "
            f"{len(tracks)}."
        )
    for row, (run, track) in enumerate(zip(runs, tracks, strict=True)):
        if track.shape != tracks[0].shape:
            raise InputError(
                f"{run}: expected {tracks[0].shape} (rows, columns) like the run of row 0; row "
                f"{row} has {track.shape}. {RAGGED}"
            )
    names = {"k": k_names, "p": p_names[0]}
    arrays = {"k": k, "p": np.stack(tracks), "labels": names}
    if (path / "q.csv").exists():
        arrays["q"], names["q"] = _csv(path / "q.csv")
    if (path / "groups.csv").exists():
        arrays["groups"] = _groups(path / "groups.csv", len(k))
    return arrays


def _groups(path: Path, n: int) -> np.ndarray:
    """(n,) names of recordings, a line each, below an optional header. Raises InputError for any
    other number of lines: a name that slips by one row is that of another recording.
    """
    names = [line.strip() for line in path.read_text().rstrip().splitlines()]
    if names and names[0].lstrip("# ").lower() in _HEADERS:
        names = names[1:]
    if len(names) != n or not all(names):
        empty = f", line {names.index('') + 1} of them empty" if "" in names else ""
        raise InputError(
            f"{path}: expected a name for each of {n} rows of k.csv, a line each, and before them "
            f"at most a header, one of {', '.join(_HEADERS)}; got {len(names)}{empty}."
        )
    return np.array(names, dtype=str)


def _by_number(name: str) -> list:
    parts = re.split(r"([0-9]+)", name)  # text and digits in turn
    return [int(part) if i % 2 else part for i, part in enumerate(parts)]


def _csv(path: Path) -> tuple[np.ndarray, tuple[str, ...] | None]:
    """Numbers (rows, columns) of a CSV file, and names from a first line without numbers."""
    lines = [line for line in path.read_text().splitlines() if line.strip()]
    names = None
    try:
        [float(cell) for cell in lines[0].split(",")]
    except ValueError:
        first = csv.reader([lines.pop(0).lstrip("# ")], skipinitialspace=True)
        names = tuple(cell.strip() for cell in next(first))
    except IndexError:
        raise InputError(f"{path}: expected rows of numbers; the file is empty.") from None
    try:
        rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    except ValueError as error:
        raise InputError(
            f"{path}: expected rows of as many numbers each, separated by commas; {error}."
        ) from None
    if names is not None and rows.ndim == 2 and len(names) != rows.shape[1]:
        raise InputError(
            f"{path}: expected a first line of numbers, or of a name for each of {rows.shape[1]} "
            f"columns; got {len(names)} names."
        )
    return rows, names
