"""Scenes as small TOML or JSON files. A decimal is the float64 nearest to it, in the proof too,
which spells that float exactly; one that a float64 does not print again is refused.
"""

import json
import tomllib
from dataclasses import replace
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from parc_jax.body import Disc, Polygon
from parc_jax.errors import InputError
from parc_jax.labels import PARTS, Labels, labels
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid, reach_avoid
from parc_jax.rollout.files import write_atomic
from parc_jax.sets.box import box
from parc_jax.sets.hpolytope import HPolytope, from_box, hpolytope

KINDS = "`lo` and `hi`, or rows `A` and `b`"


def load_problem(path) -> ReachAvoid:
    """The problem in a .toml or .json file. Raises InputError that names the entry.

    [goal]       over (p, q) at the end: lo, hi; or rows A, b of A x <= b.
    [[obstacles]] over p: the same, and optionally steps = [first, last], the intervals in which it
        exists.
    [body]       radius [m], or vertices = [[x, y], ...]; a polygon does not turn with the robot.
    [start]      over p0, optional: the same as the goal.
    [labels]     for people, optional: p, q, k, a list of names with units each; see `labelled`.
    """
    return problem_of_text(_text(path), str(path), is_json=Path(path).suffix == ".json")


def labelled(model: TrajectoryModel, path) -> TrajectoryModel:
    """The model with the labels of a scene file, where it has any, in place of its own. Raises
    InputError.
    """
    given = _data(_text(path), str(path), Path(path).suffix == ".json").get("labels", {})
    own = model.labels._asdict()
    named = labels(model.n_p, model.n_q, model.n_k, **own | given)
    return replace(model, labels=named)


def problem_of_text(text: str, name: str, is_json: bool = False) -> ReachAvoid:
    """The problem in the text of a file called `name`. Raises InputError."""
    data = _data(text, name, is_json)
    try:
        return _problem(data)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _text(path) -> str:
    path = Path(path)
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a text file in TOML or JSON; {error}.") from None


def _data(text: str, name: str, is_json: bool):
    """What a file called `name` spells, with decimals as they stand."""
    try:
        return (
            json.loads(text, parse_float=Decimal)
            if is_json
            else tomllib.loads(text, parse_float=Decimal)
        )
    except ValueError as error:
        raise InputError(
            f"{name}: expected a scene in {'JSON' if is_json else 'TOML'}; {error}."
        ) from None
    except InvalidOperation:
        raise InputError(f"{name}: a number in it cannot be read.") from None


def save_problem(path, problem: ReachAvoid, named: Labels | None = None) -> Path:
    """Write a .toml or .json file that `load_problem` reads back with equal numbers; complete or
    not at all. named: labels to go with it.
    """
    path = Path(path)
    parts = _parts(problem, named)
    text = json.dumps(parts, indent=1) if path.suffix == ".json" else "".join(_toml(parts))
    return write_atomic(path, text.encode())


def problem_text(problem: ReachAvoid, named: Labels | None = None) -> str:
    """The problem as TOML. named: labels to go with it."""
    return "".join(_toml(_parts(problem, named)))


def _problem(data) -> ReachAvoid:
    known = ("goal", "obstacles", "body", "start", "labels")
    _table("scene", data, known, needed=("goal", "body"))
    for part, words in _table("labels", data.get("labels", {}), PARTS).items():
        if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
            raise InputError(
                f"labels {part}: expected a list of names with units, such as 'speed [m/s]'; got "
                f"{words!r:.60}."
            )
    obstacles = data.get("obstacles", [])
    if not isinstance(obstacles, list):
        raise InputError("obstacles: expected a list of tables, each [[obstacles]] in TOML.")
    sets = [_set(f"obstacle {i}", part, ("steps",)) for i, part in enumerate(obstacles)]
    spans = [part.get("steps") for part in obstacles]
    body = _table("body", data["body"], ("radius", "vertices"))
    if len(body) != 1:
        raise InputError(
            f"body: expected either `radius` or `vertices`; got {', '.join(body) or 'neither'}."
        )
    shape = (
        Disc(float(_numbers("body radius", body["radius"], 0)))
        if "radius" in body
        else Polygon(_numbers("body vertices", body["vertices"], 2))
    )
    start = None if data.get("start") is None else _set("start", data["start"])
    return reach_avoid(
        _set("goal", data["goal"]), sets, shape, start, [tuple(s) if s else None for s in spans]
    )


def _set(name: str, part, further: tuple[str, ...] = ()) -> HPolytope:
    _table(name, part, ("lo", "hi", "A", "b", *further))
    given = {key for key in ("lo", "hi", "A", "b") if key in part}
    if given == {"A", "b"}:
        return hpolytope(_numbers(f"{name} A", part["A"], 2), _numbers(f"{name} b", part["b"], 1))
    if given != {"lo", "hi"}:
        raise InputError(
            f"{name}: expected {KINDS}; got {', '.join(sorted(given)) or 'none of them'}."
        )
    lo = _numbers(f"{name} lo", part["lo"], 1)
    hi = _numbers(f"{name} hi", part["hi"], 1)
    try:
        return from_box(box(lo, hi))
    except InputError as error:
        raise InputError(f"{name}: {str(error).removeprefix('box: ')}") from None


def _table(name: str, part, known: tuple[str, ...], needed: tuple[str, ...] = ()) -> dict:
    if not isinstance(part, dict):
        raise InputError(f"{name}: expected a table with {', '.join(known)}; got {part!r:.60}.")
    foreign = sorted(set(part) - set(known))
    if foreign:
        raise InputError(
            f"{name}: expected {', '.join(known)}; got {foreign[0]!r}. Is it misspelled?"
        )
    for key in needed:
        if key not in part:
            raise InputError(f"{name}: expected an entry {key!r}; there is none.")
    return part


def _numbers(name: str, value, ndim: int) -> np.ndarray:
    """Floats whose shortest decimals are the file's numbers, of the given depth of nesting."""

    def one(v):
        if isinstance(v, list):
            return [one(x) for x in v]
        if isinstance(v, bool) or not isinstance(v, int | Decimal) or not Decimal(v).is_finite():
            raise InputError(f"{name}: expected finite numbers; got {v!s:.40}.")
        if not np.isfinite(float(v)) or Decimal(repr(float(v))) != v:
            raise InputError(
                f"{name}: expected a decimal that a float64 keeps (up to 15 digits); got {v}. "
                "Round it."
            )
        return float(v)

    try:
        array = np.array(one(value), np.float64)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        array = np.zeros((0,) * (ndim + 1))
    if array.ndim != ndim:
        wanted = ("one number", "a list of numbers", "a list of rows of as many numbers each")[ndim]
        raise InputError(f"{name}: expected {wanted}; got {value!s:.60}.")
    return array


def _parts(problem: ReachAvoid, named: Labels | None) -> dict:
    obstacles = []
    for part, span in zip(problem.obstacles, problem.all_spans, strict=True):
        obstacles.append(
            _spelled(part) | ({} if span is None else {"steps": [int(i) for i in span]})
        )
    body = problem.body
    shape = (
        {"radius": float(body.radius)}
        if isinstance(body, Disc)
        else {"vertices": np.asarray(body.vertices).tolist()}
    )
    parts = {"goal": _spelled(problem.goal), "body": shape}
    if named is not None:
        parts["labels"] = {part: list(words) for part, words in named._asdict().items() if words}
    parts |= {} if problem.start is None else {"start": _spelled(problem.start)}
    return parts | {"obstacles": obstacles}


def _spelled(part: HPolytope) -> dict:
    """lo and hi where the rows are exactly those of a box, else the rows."""
    n, eye = part.n, np.eye(part.n)
    if part.A.shape == (2 * n, n) and (part.A == np.concatenate([eye, -eye])).all():
        return {"lo": (0.0 - part.b[n:]).tolist(), "hi": part.b[:n].tolist()}
    return {"A": part.A.tolist(), "b": part.b.tolist()}


def _toml(parts: dict):
    tables = [
        (f"[{name}]", parts[name]) for name in ("goal", "body", "start", "labels") if name in parts
    ]
    tables += [("[[obstacles]]", part) for part in parts["obstacles"]]
    for head, part in tables:
        yield f"{head}\n"
        for key, value in part.items():
            yield f"{key} = {json.dumps(value, ensure_ascii=False)}\n"
        yield "\n"
