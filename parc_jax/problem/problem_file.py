"""Scenes as small TOML files. A decimal is the float64 nearest to it, in the proof too; one
that a float64 does not print again is refused.
"""

import json
import tomllib
from collections.abc import Sequence
from dataclasses import fields, replace
from decimal import Decimal
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError, naming, reading
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.labels import PARTS, Labels
from parc_jax.learning.runs.files import write_atomic
from parc_jax.learning.system import check_points
from parc_jax.problem.body import Body, Disc, Part, Polygon, body_of, numbered, parts_of
from parc_jax.problem.problem import Problem, Span, goal_of_points, reach_avoid, require_points
from parc_jax.problem.scene_values import (
    grown_set_of,
    numbers_of,
    set_of,
    table_of,
    uncertainty_of,
    written_set,
    written_uncertainty,
)
from parc_jax.problem.world.outlines import Edge, edge_of

# the fields of a problem, but that an interval of time stands with its obstacle
ENTRIES = (*(f.name for f in fields(Problem) if f.name != "spans"), "places")
# words for the hull of so many reference points
POINTS_OF_KIND = {"disc": 1, "ball": 1, "capsule": 2, "rectangle": 4, "box": 8}


def load_problem(path, points: Sequence[str] | None = None) -> Problem:
    """The problem in a .toml file. Raises InputError that names the entry.

    [goal]       over (p, q) at the end: lo, hi; or rows A, b of A x <= b. With points = ["nose",
        ...] over p: where these reference points end; and [goal.q] alike over q. With [goal.q] and
        without points, all of them end there.
    [[obstacles]] over p: lo, hi; or A, b; or vertices = [[x, y], ...], whose hull it is; optionally
        steps = [first, last], the intervals in which it exists; dt, at, said, mover: as of `Span`.
        edge = "... 0.1", the region of a `FreeSpace` in which the robot begins, as hexadecimal WKB,
        and its width [m], if any.
    [body]       radius [m], or vertices = [[x, y], ...], about the first reference point; a polygon
        does not turn with the robot. With points = ["nose", ...] it is the hull of these reference
        points, grown by the radius or the vertices, if any. In place of points also disc or ball
        (one point), capsule (two), rectangle (four), box (eight). [[body]] for each of several
        parts.
    [start]      over p0, optional: lo, hi; or A, b.
    points       the robot's reference points in the order that the goal was made for, optional, in
        front of the tables. A robot with others, or in another order, is refused.
    places       optional, of a body of points: where each is on the robot, by name [x, y] [m], as a
        footprint tells; a model that begins with them elsewhere is refused.
    [labels]     optional: p, q, k, a list of names with units each. A model with others is refused.
    [uncertainty] optional; see docs/uncertainty.md.

    points: names of the robot's reference points, as `model.points`, for a goal that names some in
    a file that does not have them all; and to be compared with those that it has.
    """
    with reading(path, "a scene in TOML"):  # decimals exactly
        data = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"), parse_float=Decimal)
    with naming(path):
        return _problem(data, points)


def save_problem(
    path, problem: Problem, named: Labels | None = None, points: Sequence[str] | None = None
) -> Path:
    """Write a file that `load_problem` reads back with equal numbers; complete or not at all.

    named: labels for the file, beside those that the problem has.
    points: names of the robot's reference points, for a problem without them.
    Raises InputError for a problem with other points.
    """
    return write_atomic(Path(path), problem_text(problem, named, points).encode())


def problem_text(
    problem: Problem, named: Labels | None = None, points: Sequence[str] | None = None
) -> str:
    """The problem as TOML. Arguments as of `save_problem`."""
    return "".join(_toml(_parts(problem, named, points)))


def _problem(data, points: Sequence[str] | None) -> Problem:
    table_of("scene", data, ENTRIES, needed=("goal", "body"))
    labels = table_of("labels", data.get("labels", {}), PARTS)
    for part, words in labels.items():
        if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
            raise InputError(
                f"labels {part}: expected a list of names with units, such as 'speed [m/s]'; got "
                f"{words!r:.60}."
            )
    made_for = check_points("scene", data["points"]) if "points" in data else ()
    if made_for and points is not None and tuple(points) != made_for:
        raise InputError(
            f"points: expected those of the robot, {', '.join(points)}, in this order; the scene "
            f"was made for {', '.join(made_for)}. Write its goal anew for this robot."
        )
    points = made_for or points
    obstacles = data.get("obstacles", [])
    if not isinstance(obstacles, list):
        raise InputError("obstacles: expected a list of tables, each [[obstacles]] in TOML.")
    further = ("steps", "dt", "at", "said", "mover", "uncertainty", "edge")
    sets = [grown_set_of(f"obstacle {i}", part, further) for i, part in enumerate(obstacles)]
    sets = [edge_of(one, part.get("edge")) for one, part in zip(sets, obstacles, strict=True)]
    body = _body(data["body"])
    if points is not None:
        numbered(body, points)  # names what is unknown
    if "places" in data:
        body = _placed(body, data["places"], points)
    start = None if data.get("start") is None else set_of("start", data["start"])
    goal = _goal(data["goal"], points)
    uncertainty = uncertainty_of(data, obstacles)
    spans = [_span(f"obstacle {i}", part) for i, part in enumerate(obstacles)]
    problem = reach_avoid(goal, sets, body, start, spans, uncertainty)
    told = tuple((part, tuple(words)) for part, words in labels.items())
    return replace(problem, points=made_for or problem.points, labels=told)


def _span(name: str, part: dict) -> Span | None:
    if "steps" not in part:
        if told := sorted({"dt", "at", "said", "mover"} & part.keys()):
            raise InputError(f"{name}: expected steps = [first, last] beside {told[0]}.")
        return None
    dt, at = (
        float(numbers_of(f"{name} {word}", part[word], 0)) if word in part else None
        for word in ("dt", "at")
    )
    pair, texts = part["steps"], {x: part[x] for x in ("said", "mover") if x in part}
    with naming(name):
        return Span(pair if isinstance(pair, list) else (pair,), dt, at, **texts)


def _goal(part, points: Sequence[str] | None) -> HPolytope:
    if not isinstance(part, dict) or not part.keys() & {"points", "q"}:
        return set_of("goal", part)
    where = set_of("goal", part, ("points", "q"))
    if points is None:
        raise InputError(
            "goal: expected to know the robot's reference points, since it names some; load the "
            "scene with points=model.points."
        )
    further = set_of("goal q", part["q"]) if "q" in part else None
    return goal_of_points(
        points, dict.fromkeys(_names("goal", part.get("points", list(points))), where), further
    )


def _body(data) -> Disc | Polygon | Body:
    if isinstance(data, list):
        return body_of([_part(f"part {i} of the body", table) for i, table in enumerate(data)])
    table_of("body", data, ("radius", "vertices", "points", *POINTS_OF_KIND))
    if data.keys() <= {"radius", "vertices"}:
        return _shape("body", data)
    return body_of([_part("body", data)])


def _placed(body: Disc | Polygon | Body, table, points: Sequence[str] | None) -> Body:
    fits = isinstance(body, Body) and isinstance(table, dict)
    fits = fits and not table.keys() - {*(points or table)}
    found = {x: numbers_of(f"places {x}", at, 1) for x, at in (table if fits else {}).items()}
    if not fits or any(len(at) != 2 for at in found.values()):
        raise InputError(
            "places: expected a body of reference points, and x and y of some of them by name, as "
            f"{{ {(points or ('nose',))[0]} = [0.2, 0.1] }}; got {table!s:.60}."
        )
    return Body(body.parts, tuple((name, *at.tolist()) for name, at in found.items()))


def _part(name: str, table) -> Part:
    table_of(name, table, ("points", "radius", "vertices", *POINTS_OF_KIND))
    kinds = sorted(table.keys() - {"radius", "vertices"})
    if len(kinds) != 1:
        raise InputError(
            f"{name}: expected its reference points, once: as points, or as one of "
            f"{', '.join(POINTS_OF_KIND)}; got {', '.join(kinds) or 'none'}."
        )
    kind = kinds[0]
    names = _names(name, table[kind])
    if len(names) != POINTS_OF_KIND.get(kind, len(names)):
        raise InputError(
            f"{name}: expected {POINTS_OF_KIND[kind]} reference points for a {kind}; got "
            f"{len(names)}."
        )
    grown = {key: table[key] for key in ("radius", "vertices") if key in table}
    return Part(names, _shape(name, grown) if grown else Disc(0.0))


def _shape(name: str, table: dict) -> Disc | Polygon:
    if len(table) != 1:
        raise InputError(
            f"{name}: expected either `radius` or `vertices`; got {', '.join(table) or 'neither'}."
        )
    if "radius" in table:
        return Disc(float(numbers_of(f"{name} radius", table["radius"], 0)))
    return Polygon(numbers_of(f"{name} vertices", table["vertices"], 2))


def _names(name: str, value) -> tuple[str | int, ...]:
    """Names of reference points, or their numbers; one alone needs no list."""
    names = value if isinstance(value, list) else [value]
    fine = all(isinstance(n, str | int) and not isinstance(n, bool) for n in names)
    if not fine or not names:
        raise InputError(f"{name}: expected names of reference points; got {value!r:.60}.")
    return tuple(names)


def _parts(problem: Problem, named: Labels | None, points: Sequence[str] | None) -> dict:
    require_points(problem, problem.points if points is None else points)
    points = problem.points or points
    uncertainty, errors = written_uncertainty(problem.uncertainty, len(problem.obstacles))
    obstacles = []
    for part, span, error in zip(problem.obstacles, problem.all_spans, errors, strict=True):
        own = {} if span is None else _written_span(span)
        own |= {} if error is None else {"uncertainty": error}
        own |= {"edge": part.written} if isinstance(part, Edge) else {}
        obstacles.append(written_set(part) | own)
    by_point = None if points is None else _goal_by_point(problem, points)
    goal = written_set(problem.goal) if by_point is None else by_point
    # a robot of one point needs no names, unless the problem was made for them
    parts: dict = {"points": list(points)} if points and (problem.points or len(points) > 1) else {}
    places = getattr(problem.body, "places", ())
    if len(found := {name: list(at) for name, *at in places}) < len({*places}):
        raise InputError(f"places: expected each point at one place; got {list(places)!s:.60}.")
    parts |= {"places": found} if found else {}
    parts |= {"goal": goal, "body": _written_body(problem.body)}
    labels = ({} if named is None else named._asdict()) | dict(problem.labels)
    labels = {part: list(words) for part, words in labels.items() if words}
    parts |= {"labels": labels} if labels else {}
    parts |= {} if problem.start is None else {"start": written_set(problem.start)}
    parts |= {"uncertainty": uncertainty} if uncertainty else {}
    return parts | {"obstacles": obstacles}


def _written_span(span: Span) -> dict:
    """The entries of a span. Raises InputError for one that rests on a manoeuvre under way."""
    if span.of is not None:
        raise InputError(
            "obstacles: expected those of which a file can tell; a robot in the way may leave its "
            "manoeuvre, and no file would see it. Leave them out, or add them to what was read."
        )
    told, unsaid = vars(span), vars(Span(span))
    return {"steps": list(map(int, span))} | {x: told[x] for x in told if told[x] != unsaid[x]}


def _goal_by_point(problem: Problem, points: Sequence[str]) -> dict | None:
    """The goal by names of points that share one set, each row about one or q; else None."""
    goal = problem.goal
    n_p = problem.obstacles[0].n if problem.obstacles else None
    if n_p is None or len(points) == 1 or goal.n < len(points) * n_p:
        return None
    columns = [slice(i * n_p, (i + 1) * n_p) for i in range(len(points))]
    columns.append(slice(len(points) * n_p, goal.n))
    used = np.array([(goal.A[:, block] != 0).any(axis=1) for block in columns])
    if (used.sum(axis=0) != 1).any():
        return None
    pairs = zip(columns, used, strict=True)
    *regions, further = (HPolytope(goal.A[rows][:, some], goal.b[rows]) for some, rows in pairs)
    named = zip(points, regions, strict=True)
    asked = {name: written_set(part) for name, part in named if len(part.b)}
    if not asked or any(part != next(iter(asked.values())) for part in asked.values()):
        return None
    written = {"points": list(asked), **next(iter(asked.values()))}
    return written | ({"q": written_set(further)} if len(further.b) else {})


def _written_body(body: Disc | Polygon | Body) -> dict | list[dict]:
    if isinstance(body, Body):
        parts = [{"points": list(part.points), **_written_shape(part)} for part in body.parts]
        return parts[0] if len(parts) == 1 else parts
    return _written_shape(parts_of(body)[0])


def _written_shape(part: Part) -> dict:
    if isinstance(part.shape, Disc):
        return {"radius": float(part.shape.radius)}
    return {"vertices": np.asarray(part.shape.vertices).tolist()}


def _toml(parts: dict):
    for name in ("points", "places"):
        yield f"{name} = {_inline(parts[name])}\n\n" if name in parts else ""
    goal = dict(parts["goal"])
    further = goal.pop("q", None)
    tables = [("[goal]", goal)]
    tables += [] if further is None else [("[goal.q]", further)]
    for name in ("body", "start", "labels", "uncertainty", "obstacles"):
        part = parts.get(name, [])
        several = isinstance(part, list)
        tables += [(f"[[{name}]]", one) for one in part] if several else [(f"[{name}]", part)]
    for head, part in tables:
        yield f"{head}\n"
        for key, value in part.items():
            yield f"{key} = {_inline(value)}\n"
        yield "\n"


def _inline(value) -> str:
    """A value as one line of TOML."""
    if isinstance(value, dict):
        pairs = [f"{_inline(key)} = {_inline(part)}" for key, part in value.items()]
        return "{ " + ", ".join(pairs) + " }"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # as JSON has it
