"""The table of a sweep, as a simulator logs it: one row per record of every run."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.system import TimeGrid

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
    asked = [run, t, *k, *p, *q]
    missing = [word for word in asked if word not in cells]
    if missing or not k or not p:
        raise InputError(
            f"{name}: expected a row per record of every run, with columns {', '.join(asked)}; got "
            f"{', '.join(cells):.200} ({', '.join(missing)} missing). If that is a table of k "
            f"and success: {NOT_ENOUGH}."
        )
    clock, ks, ps, qs = (_numbers(name, cells, words) for words in ([t], k, p, q))
    rows = _rows_by_run(cells[run])
    if max(map(len, rows), default=0) < 2:
        raise InputError(
            f"{name}: expected a row per record of every run; got {len(rows):,} runs of one row. "
            f"If that is the outcome of each: {NOT_ENOUGH}."
        )
    at = time.dt_record * np.arange(time.n_record + 1)
    cut = [_cut(f"{name}, run {cells[run][i[0]]}", i, clock[:, 0], ks, ps, qs, at) for i in rows]
    k_of, p_of, q_of = (np.stack(part) for part in zip(*cut, strict=True))
    return {"k": k_of, "p": p_of, "q": q_of, "labels": {"k": k, "p": p, "q": q}}


def _rows_by_run(names: np.ndarray) -> list[np.ndarray]:
    """Rows of every run, runs in the order in which they begin."""
    _, first, number = np.unique(names.astype(str), return_index=True, return_inverse=True)
    ends = np.cumsum(np.bincount(number))[:-1]
    parts = np.split(np.argsort(number, kind="stable"), ends)
    return [parts[i] for i in np.argsort(first)]


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
