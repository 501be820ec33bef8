"""Rollouts from files: .npz of `collect` or of others, and folders of CSV logs."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from parc_jax.checker.rests_on import printable
from parc_jax.common.arrays import NO_NUMBER, real
from parc_jax.common.errors import InputError, check_kind, reading
from parc_jax.common.sets.box import Box, box
from parc_jax.common.spelling import listed, rounded_down
from parc_jax.learning.labels import Labels, axes_in_all, name_of, require_unit, unit_of, words_in
from parc_jax.learning.runs.batch import RolloutBatch, require_finite_k, rollout_batch
from parc_jax.learning.runs.files import RAGGED, meta_of, read_npz, rollouts_from_npz
from parc_jax.learning.runs.independent import check_uniform, step_of
from parc_jax.learning.runs.law import FITTED, LEFT, LOG, OURS, PLACES, TO_ALL, law_spec, words_of
from parc_jax.learning.runs.tables import check_parameters, folder_arrays
from parc_jax.learning.system import LARGEST, ONE_POINT, TURNS, TimeGrid, check_points


def load_rollouts(
    path,
    time: TimeGrid | None = None,
    domain: Box | None = None,
    *,
    k_law: str = "logged",
    groups=None,
    points: Sequence[str] | None = None,
    rotation: Sequence[str] | None = None,
    labels: Labels | Mapping[str, Sequence[str]] | None = None,
    given: Sequence[str | int] = (),
) -> RolloutBatch:
    """A batch from a file or folder. Raises InputError with the missing part.

    *.npz   written by `save_rollouts`: complete as it is. Others: arrays k (n, n_k), p (n, n_record
            + 1, n_p), of m reference points (n, n_record + 1, m, n_p), and, where there are other
            goal states, q (n, n_q), angles in rad; groups (n,) and points (m,) see below.
    folder  k.csv (n rows of n_k numbers), q.csv (n rows of n_q; may be absent), and one file
            per run in p/, whose names sort, as text and by their numbers, in the order of the
            rows, each with n_record + 1 rows of n_p numbers. groups.csv may name the recording of
            each row. A first line of names, such as speed [m/s], labels the columns of k, q, and of
            p where there is one point.
    time: the record grid of the runs; needed for all but those. domain: K; None = the
    smallest box that holds all k, and once they are split that of the training runs: the claim is
    then about runs whose k lies in it. k_law: "logged", or "uniform" where the k are known to be
    independent uniform draws from `domain`, which must then be given, and which the k may refute
    (`check_uniform`); a claim speaks of shares of K only then. groups: (n,) which recording each
    row was cut from, numbers or names; rows of one recording are not independent, and count as one.
    points: names of the m reference points; a table with a column per coordinate (CSV) has them
    point by point: x, y of the first, x, y of the second. Positions are made relative to
    where the first point of each run starts. rotation: declared behaviour of the heading, as of a
    system. labels: names of coordinates, as {"k": ("speed [m/s]", ...)}; where a file has its own,
    in their units. given: parameters that are measured at the start of a run and not chosen,
    by name or number. Runs with NaN stay.
    """
    about = {"rotation": rotation, "labels": labels, "given": given}
    with reading("load_rollouts", "the path of a file or folder"):
        path = Path(path)
    check_k_law(path, k_law, domain)
    check_kind("time", time, TimeGrid | None)
    if path.is_dir():
        arrays = folder_arrays(path)
    elif path.suffix == ".npz":
        arrays = read_npz(path)
    else:
        raise InputError(
            f"{path}: expected a .npz file or a folder of CSV files. Other tables become a .npz "
            "first (page Your own robot, door 3)."
        )
    if path.suffix == ".npz" and meta_of(arrays):
        batch = rollouts_from_npz(path, arrays)
        _check_own(path, batch, time, domain, k_law, groups, points, about)
        return batch
    return _assemble(path, arrays, time, domain, k_law, groups, points, about)


def _check_own(
    path: Path, batch: RolloutBatch, time, domain, k_law: str, groups, points, about: dict
) -> None:
    """Refuse arguments that contradict a file of `save_rollouts`. Raises InputError."""
    other = {name: x is not None and len(x) > 0 for name, x in about.items()}
    other |= {"k_law": k_law != "logged", "groups": groups is not None}
    other["points"] = points is not None and tuple(points) != batch.points
    other["time"] = time not in (None, batch.time)
    other["domain"] = domain is not None and domain.text != batch.domain.text
    if told := [name for name, differs in other.items() if differs]:
        raise InputError(
            f"{path}: expected no {listed(told)}: a file of save_rollouts knows its own, here "
            f"{batch.time} and K = {batch.domain.text}. Leave it out."
        )


def _assemble(
    path: Path, arrays: dict, time, domain, k_law: str, groups, points, about: dict
) -> RolloutBatch:
    of = {"k": None, "p": None, "q": None, "groups": groups, "points": points}
    for name in sorted(arrays.keys() - {"labels", "meta"}):  # what nobody reads is said for nothing
        if name not in of:
            raise InputError(
                f"{path}: expected {', '.join(of)}; got {name!r}. Is it misspelled, or an argument?"
            )
        if of[name] is not None and not np.array_equal(arrays[name], of[name]):
            raise InputError(f"{path}: expected no {name}=, or those of the file; got others.")
    if missing := ", ".join(sorted({"k", "p"} - arrays.keys())):
        raise InputError(f"{path}: expected arrays k and p; {missing} is missing.")
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
            f"{p.shape[1]} samples per run were taken."
        )
    q = _numbers(path, "q", arrays["q"]) if "q" in arrays else np.zeros((len(k), 0))
    groups = arrays.get("groups") if groups is None else groups
    named = points_in(path, p, arrays["points"].tolist() if "points" in arrays else points)
    if isinstance(known := arrays.get("labels", {}), np.ndarray):
        raise InputError(f"{path}: expected no array named labels; got one. Say labels= instead.")
    read = {part: words for part, words in known.items() if words is not None}
    if "p" not in read.keys() | words_of(about["labels"]).keys():
        _check_no_time(path, p.reshape(*p.shape[:2], -1))
    if "p" in read:
        _check_columns(path, read["p"], named)
        if len(named) > 1:  # a name per coordinate of every point
            del read["p"]
    about = about | {"time": time, "groups": groups, "own": read}
    return recorded(path, k, p, q, named, domain, k_law, **about)


def _check_columns(path: Path, columns: Sequence[str], points: tuple[str, ...]) -> None:
    """Refuse columns that tell no metres, or another axis or point, or none. Raises InputError."""
    words = {x: f" {' '.join(words_in(x))} " for x in (*columns, *points)}
    glued = {x: f" {words[x].replace(' ', '')} " for x in points}  # `rearleft_x` of rear left
    n_p = len(columns) // len(points)
    named = [*zip(columns, axes_in_all(columns, points), strict=True)]
    numbers = [[int(n) for n in re.findall(r"\d+", name_of(x)) if axes] for x, axes in named]
    for i, (column, axes) in enumerate(named):
        require_unit(column, "m", points)
        own, axis = points[i // n_p], "xyz"[i % n_p : i % n_p + 1]
        said = [x for x in points if words[x] in words[column] or glued[x] in words[column]]
        of_axis = axes == {axis} or (n_p == 1 and axes) or (not axes and unit_of(column) == "m")
        in_order = numbers[i] == numbers[i - i % n_p] >= numbers[max(i - n_p, 0)]  # x1, y1, x2
        if not of_axis or (own != max(said, key=len) if said else not in_order):
            raise InputError(
                f"{path}: expected columns point by point in the order of points, "
                f"{', '.join(points)}, of each x, y, z, by these names or as 'ahead [m]'; got "
                f"{column!r} for {axis or 'axis'} of {own}."
            )


def _check_no_time(path: Path, p: np.ndarray) -> None:
    """Refuse a column without a name that rises as one line in all runs. Raises InputError."""
    since = (p - p[:, :1])[np.isfinite(p).all(axis=(1, 2))]
    line = since[:1, -1:] * np.linspace(0.0, 1.0, p.shape[1])[:, None]  # but for jitter:
    alike = (np.abs(since - line) <= 0.01 * np.abs(since[:1, -1:])).all(axis=(0, 1))
    times = alike & (np.diff(since, axis=1) > 0.0).all(axis=(0, 1))
    if len(since) > 1 and times.any() and not alike.all():
        raise InputError(
            f"{path}: expected places in m; column {times.argmax()} of p rises alike in all runs, "
            "as a time does. Leave it out, or name the columns, as x and y."
        )


def check_k_law(owner: str | Path, k_law: str, domain: Box | None) -> None:
    """Refuse laws of k that no log has, and "uniform" without a domain. Raises InputError."""
    check_kind("domain", domain, Box | None)
    if k_law not in ("logged", "uniform") or (k_law == "uniform" and domain is None):
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
    cut: Mapping[str, str] | None = None,
    left_out: Mapping[str, int] | None = None,
    missed: str = "",
    own: Mapping[str, Sequence[str]] | None = None,
    poses: np.ndarray | None = None,
    **about,
) -> RolloutBatch:
    """A batch of runs that were logged, in the file `owner`. p: coordinates of all points, in
    columns or point by point, from any start. domain, k_law: as of `load_rollouts`. cut: how runs
    were made of what was logged, by name, for their law; left_out: how many were not, by the
    reason; missed: how many K left out, in words. own: labels of its columns, which others keep to.
    poses: (m, 2 or 3) places, and headings, as they were logged, where p and q were made of them.
    about: as of `rollout_batch`. Raises InputError.
    """
    require_finite_k(k)
    fitted = {FITTED: f"as declared, which {missed} miss"} if missed else {}
    fitted |= {FITTED: TO_ALL} if domain is None else {}
    fitted |= {f"{OURS}{name}": words for name, words in (cut or {}).items()}
    fitted |= {f"{OURS}{name}": f"{n:,}{LEFT}" for name, n in (left_out or {}).items() if n}
    step = step_of(p.reshape(*p.shape[:2], -1) if poses is None else poses[:, :2])
    fitted[PLACES] = f"as logged, errors too, steps from {rounded_down(f'{step:.6g}')} m"
    domain = box(k.min(axis=0), k.max(axis=0)) if domain is None else domain
    law = law_spec(f"{LOG}{printable(Path(owner).resolve().name)}", domain, k_law, fitted)
    places = p.reshape(*p.shape[:2], len(points), -1)
    moved = (places - places[:, :1, :1]).reshape(*p.shape[:2], -1)
    words = words_of(about.get("labels"))
    about["labels"] = {**(own or {})} | words
    batch = rollout_batch(k, moved, q, domain=domain, law=law, points=points, **about)
    check_parameters(owner, batch.k, batch.subject.labels.k)
    for part, columns in (own or {}).items():
        told = [*zip(columns, getattr(batch.subject.labels, part), strict=False)] * (part == "k")
        renamed = [x for x, y in told if name_of(x) != name_of(y)]
        check_parameters(owner, k[:0, : len(renamed)], renamed)
        batch.subject.check_renamed(owner, part, columns)
    _check_turns(owner, batch, poses[:, 2:] if poses is not None and "q" not in words else None)
    if k_law == "uniform":
        check_uniform(str(owner), batch.k, domain, batch.groups, batch.subject.labels.k)
    return batch


def _check_turns(owner: str | Path, runs: RolloutBatch, logged: np.ndarray | None) -> None:
    """Refuse headings that are seen not to be in rad, as in runs, and as logged where nobody says
    what they are in. Raises InputError.
    """
    runs = runs.finite
    for word, q, name in zip(runs.rotation or (), runs.q.T, runs.subject.labels.q, strict=False):
        asked = q if logged is None else logged
        largest = np.abs(asked[np.isfinite(asked)]).max(initial=0.0)
        told = logged is None and unit_of(name) == "rad"
        if word == TURNS and largest > 2 * np.pi and not told:
            raise InputError(
                f"{owner}: expected headings in rad, 0 at the start; got up to {largest:.3g}. Are "
                f"they in degrees? If a robot turns as far, label its q: '{name_of(name)} [rad]'."
            )


def points_in(path: str | Path, p: np.ndarray, given) -> tuple[str, ...]:
    """Names of reference points of p (n, n_record + 1, n_p) or (.., m, n_p). Raises InputError."""
    if given is None:
        if p.ndim == 3 or p.shape[2] == 1:
            return ONE_POINT
        raise InputError(f"{path}: expected points, names of the {p.shape[2]} reference points.")
    points = check_points(str(path), given)
    if p.shape[2] != len(points) if p.ndim == 4 else p.shape[2] % len(points):
        raise InputError(
            f"{path}: expected p with coordinates of {len(points)} reference points "
            f"({', '.join(points)}); got {p.shape}."
        )
    return points


def _numbers(path: Path, name: str, values) -> np.ndarray:
    """An array of the file as floats. Raises InputError, also for ragged runs and huge numbers."""
    try:
        array = np.asarray(real(values), np.float64)
    except NO_NUMBER:
        why = "They are complex, or times." if np.asarray(values).dtype.kind in "cmM" else RAGGED
        raise InputError(f"{path}: expected {name} as one array of real numbers. {why}") from None
    largest = np.abs(array[np.isfinite(array)]).max(initial=0.0)
    if largest > LARGEST:
        raise InputError(
            f"{path}: expected {name} with numbers up to {LARGEST:g}; the largest is {largest:g}. "
            "Tell them in a larger unit, or write NaN where a run failed."
        )
    return array
