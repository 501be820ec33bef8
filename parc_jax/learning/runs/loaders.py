"""Rollouts from files: our own .npz, a folder of CSV logs, the table of a sweep, the published
*_rawdata.mat layout.
"""

import csv
import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from parc_jax.common.arrays import real
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.labels import Labels
from parc_jax.learning.runs.batch import RolloutBatch, require_finite_k, rollout_batch
from parc_jax.learning.runs.files import RAGGED, read_npz, rollouts_from_npz
from parc_jax.learning.runs.independent import check_uniform
from parc_jax.learning.runs.law import FITTED, LOG, TO_ALL, law_spec, words_of
from parc_jax.learning.runs.sweep import sweep_arrays
from parc_jax.learning.system import LARGEST, ONE_POINT, TimeGrid, check_points

K_LAWS = ("logged", "uniform")
_HEADERS = ("group", "groups", "recording", "recordings", "run", "log", "file", "bag", "name")


def load_rollouts(
    path,
    time: TimeGrid | None = None,
    domain: Box | None = None,
    *,
    columns: Mapping[str, str | Sequence[str]] | None = None,
    k_law: str = "logged",
    groups=None,
    points: Sequence[str] | None = None,
    rotation: Sequence[str] | None = None,
    labels: Labels | Mapping[str, Sequence[str]] | None = None,
    given: Sequence[str | int] = (),
) -> RolloutBatch:
    """A batch from a file or folder. Raises InputError that says what is missing.

    *.npz   written by `save_rollouts`: complete as it is. Others: arrays k (n, n_k), p (n, n_record
            + 1, n_p), of m reference points (n, n_record + 1, m, n_p), and, where there are other
            goal states, q (n, n_q); groups (n,) and points (m,) see below.
    *.mat   ks_data (n_k, n), ps_data (n_t, n_p, n), qs_data (n_q, n), as the published code saves
    it. folder  k.csv (n rows of n_k numbers), q.csv (n rows of n_q; may be absent), and one file
            per run in p/, whose names sort, as text and by their numbers alike, in the order of the
            rows, each with n_record + 1 rows of n_p numbers. groups.csv may name the recording of
            each row. A first line of names, such as speed [m/s], labels the columns of k, q, and of
            p where there is one point.
    *.csv   with `columns`: one row per record of every run, as a sweep in Simulink, Gazebo or a
            spreadsheet leaves it; or a mapping of names to columns, such as a DataFrame.
    columns: its names, {"k": (...), "p": (...), "q": (...), "run": "run", "t": "t"}, the last three
    optional: p point by point, `run` numbers or names the runs, `t` is a clock [s] from any start.
    A run is interpolated at the record times between samples at most a record apart; behind its
    last one it is NaN: it did not finish, and failures count. q is that of the sample nearest t_f.
    time: the record grid of the runs; needed for all but our own files. domain: K; None = the
    smallest box that holds all k, and once they are split that of the training runs: the claim is
    then about runs whose k lies in it. k_law: "logged", or
    "uniform" where the k are known to be independent uniform draws from `domain`, which must then
    be given, and which the k may refute (`check_uniform`); a claim speaks of shares of K only
    then. groups: (n,) which recording each row was cut from, numbers or names; rows of one
    recording are not independent, and count as one. points: names of the m reference points; a
    table with a column per coordinate (CSV, .mat) has them point by point: x, y of the first, x, y
    of the second. Positions are made relative to where the first point of each run starts.
    rotation: what is declared of the heading, as a system's `rotation`. labels: what coordinates
    are called, as {"k": ("speed [m/s]", ...)}; they go before those of the file. given: parameters
    that are measured at the start of a run and not chosen, by name or number. Runs with NaN stay.
    """
    about = {"rotation": rotation, "labels": labels, "given": given}
    if columns is not None:
        name = Path(path if isinstance(path, str | Path) else "table")
        check_k_law(name, k_law, domain)
        arrays = sweep_arrays(path, time, columns)
        return _assemble(name, arrays, time, domain, k_law, groups, points, about)
    path = Path(path)
    check_k_law(path, k_law, domain)
    if path.is_dir():
        return _assemble(path, _csv_folder(path), time, domain, k_law, groups, points, about)
    if path.suffix == ".mat":
        return _assemble(path, _mat_arrays(path), time, domain, k_law, groups, points, about)
    if path.suffix != ".npz":
        table = ' One table of all runs needs columns={"k": ...}.' if path.suffix == ".csv" else ""
        raise InputError(
            f"{path}: expected a .npz file, a .mat file or a folder of CSV files.{table}"
        )
    arrays = read_npz(path)
    if "meta" not in arrays:
        return _assemble(path, arrays, time, domain, k_law, groups, points, about)
    own = rollouts_from_npz(path, arrays)
    for given, wanted in (("time", time), ("domain", domain)):
        if wanted is not None and not _equal(wanted, getattr(own, given)):
            raise InputError(
                f"{path}: expected no {given}, or that of the file, {getattr(own, given)}; got "
                f"{wanted}. A file of save_rollouts has its own: leave {given} out."
            )
    return _own(path, own, k_law, groups, points, about)


def _equal(one: TimeGrid | Box, other: TimeGrid | Box) -> bool:
    if isinstance(one, Box) and isinstance(other, Box):
        return np.array_equal(one.lo, other.lo) and np.array_equal(one.hi, other.hi)
    return type(one) is type(other) and one == other


def _own(path: Path, own: RolloutBatch, k_law: str, groups, points, about: dict) -> RolloutBatch:
    """Runs of `save_rollouts`. Raises InputError for arguments that contradict the file."""
    others = points is not None and tuple(points) != own.points
    told = groups is not None or any(x is not None and len(x) > 0 for x in about.values())
    if k_law != "logged" or others or told:
        raise InputError(
            f"{path}: expected neither k_law nor groups, other points, rotation, labels or given; "
            "a file of save_rollouts knows its own."
        )
    return own


def _assemble(
    path: Path, arrays: dict, time, domain, k_law: str, groups, points, about: dict
) -> RolloutBatch:
    missing = {"k", "p"} - arrays.keys()
    if missing:
        raise InputError(
            f"{path}: expected arrays k and p; {', '.join(sorted(missing))} is missing."
        )
    k, p = (_numbers(path, name, arrays[name]) for name in ("k", "p"))
    if p.ndim not in (3, 4) or k.ndim != 2:
        raise InputError(
            f"{path}: expected k (n, n_k) and p (n, n_record + 1, n_p), of m reference points (n, "
            f"n_record + 1, m, n_p); got {k.shape} and {p.shape}."
        )
    if not len(k):
        raise InputError(f"{path}: expected at least one run; got 0 rows.")
    if time is None:
        raise InputError(
            f"{path}: expected time=time_grid(dt, t_f, dt_record): the file does not say when its "
            f"{p.shape[1]} samples "
            "per run were taken."
        )
    q = _numbers(path, "q", arrays["q"]) if "q" in arrays else np.zeros((len(k), 0))
    groups = arrays.get("groups") if groups is None else groups
    named = points_in(path, p, arrays["points"].tolist() if "points" in arrays else points)
    read = {part: words for part, words in arrays.get("labels", {}).items() if words is not None}
    if len(named) > 1:
        read.pop("p", None)  # a name per coordinate of every point
    about = about | {"labels": read | words_of(about["labels"])}
    return recorded(path, k, p, q, named, domain, k_law, time=time, groups=groups, **about)


def check_k_law(owner: str | Path, k_law: str, domain: Box | None) -> None:
    """Refuse other laws than K_LAWS, and "uniform" on nobody knows what. Raises InputError."""
    if k_law not in K_LAWS or (k_law == "uniform" and domain is None):
        raise InputError(
            f'{owner}: expected k_law "logged", or "uniform" with the domain that k was drawn '
            f"from; got {k_law!r} and domain = {domain}."
        )


def recorded(
    owner: str | Path,
    k: np.ndarray,
    p: np.ndarray,
    q: np.ndarray,
    points: tuple[str, ...],
    domain: Box | None,
    k_law: str,
    **about,
) -> RolloutBatch:
    """A batch of runs that were logged, in the file `owner`. p: coordinates of all points, in
    columns or point by point, from any start. domain, k_law: as of `load_rollouts`. about: as of
    `rollout_batch`. Raises InputError.
    """
    require_finite_k(k)
    fitted = {FITTED: TO_ALL} if domain is None else None
    domain = box(k.min(axis=0), k.max(axis=0)) if domain is None else domain
    law = law_spec(f"{LOG}{Path(owner).name}", domain, k_law, fitted)
    places = p.reshape(*p.shape[:2], len(points), -1)
    moved = (places - places[:, :1, :1]).reshape(*p.shape[:2], -1)
    batch = rollout_batch(k, moved, q, domain=domain, law=law, points=points, **about)
    if k_law == "uniform":
        check_uniform(str(owner), batch.k, domain, batch.groups, batch.subject.labels.k)
    return batch


def points_in(path: str | Path, p: np.ndarray, given) -> tuple[str, ...]:
    """Names of the reference points whose coordinates are in p (n, n_record + 1, n_p) or (n,
    n_record + 1, m, n_p). Raises InputError.
    """
    if given is None:
        if p.ndim == 3 or p.shape[2] == 1:
            return ONE_POINT
        raise InputError(
            f"{path}: expected points, the names of the {p.shape[2]} reference points in p."
        )
    points = check_points(str(path), given)
    if p.shape[2] != len(points) if p.ndim == 4 else p.shape[2] % len(points):
        raise InputError(
            f"{path}: expected p with coordinates of {len(points)} reference points "
            f"({', '.join(points)}); got {p.shape}."
        )
    return points


def _numbers(path: Path, name: str, values) -> np.ndarray:
    """An array of the file as floats. Raises InputError, for ragged runs and numbers too large to
    compute with too.
    """
    try:
        array = np.asarray(real(values), np.float64)
    except (TypeError, ValueError):
        if np.asarray(values).dtype.kind == "c":
            raise InputError(
                f"{path}: expected {name} to be an array of real numbers; they are complex."
            ) from None
        raise InputError(f"{path}: expected {name} to be one array of numbers. {RAGGED}") from None
    largest = np.abs(array[np.isfinite(array)]).max(initial=0.0)
    if largest > LARGEST:
        raise InputError(
            f"{path}: expected {name} with numbers up to {LARGEST:g}; the largest is {largest:g}. "
            "Tell them in a larger unit, or write NaN where a run failed."
        )
    return array


def _mat_arrays(path: Path) -> dict:
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


def _csv_folder(path: Path) -> dict:
    runs = sorted((path / "p").glob("*.csv"))
    _require_one_order(path, [run.stem for run in runs])
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
    """(n,) names of recordings, a line each, after a header where there is one. Raises InputError
    for any other number of lines: a name that slips by one row is that of another recording.
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


def _require_one_order(path: Path, names: list[str]) -> None:
    """Refuse names that sort as text otherwise than by their numbers: nobody knows which of both
    the rows of k.csv are in. Raises InputError.
    """

    def by_number(name: str) -> list:
        parts = re.split(r"([0-9]+)", name)  # text and digits in turn
        return [int(part) if i % 2 else part for i, part in enumerate(parts)]

    for before, after in itertools.pairwise(names):
        if by_number(before) > by_number(after):
            raise InputError(
                f"{path}: expected files in p/ that sort as text in the order of their numbers, "
                f"which is that of the rows of k.csv; as text {before}.csv comes before "
                f"{after}.csv. Write all numbers with equally many digits, such as run01.csv."
            )


def _csv(path: Path) -> tuple[np.ndarray, tuple[str, ...] | None]:
    """Numbers (rows, columns) of a CSV file, and the names in its first line where that is no
    numbers.
    """
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
