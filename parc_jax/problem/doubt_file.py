"""The table [doubt] of a scene file, and what each of the obstacles says of its own."""

import dataclasses

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.problem.doubt import FREE, Doubt
from parc_jax.problem.scene_values import grown_set_of, numbers_of, spelled_set, table_of

ENTRIES = tuple(field.name for field in dataclasses.fields(Doubt))


def doubt_of(data: dict, obstacles: list) -> Doubt | None:
    """The doubt that a scene file spells, None where it has none. Raises InputError.

    [doubt]      the fields of `Doubt`: numbers and lists, parameters by name in tables, obstacles a
        set: lo and hi, A and b, or vertices.
    [[obstacles]] doubt = {lo = ..., hi = ...}: of this one alone.
    """
    own = [part.get("doubt") for part in obstacles]
    if data.get("doubt") is None and not any(own):
        return None
    entries = table_of("doubt", data.get("doubt") or {}, ENTRIES)
    seen = None
    if "obstacles" in entries:
        seen = grown_set_of("doubt obstacles", entries["obstacles"])
    sets = [
        seen if o is None else grown_set_of(f"doubt of obstacle {i}", o) for i, o in enumerate(own)
    ]
    words = {
        name: _numbers(f"doubt {name}", entries[name])
        for name in ("start", "goal", "k", "given", "unknown")
        if name in entries
    }
    eps = entries.get("sensing_eps", 0)
    return Doubt(
        **words,
        heading=float(numbers_of("doubt heading", entries.get("heading", 0), 0)),
        obstacles=sets if any(s is not None for s in sets) else (),
        sensing_eps=str(eps) if not isinstance(eps, list | dict) else eps,
    )


def spelled_doubt(doubt: Doubt) -> tuple[dict, list]:
    """The table of a doubt, and what each obstacle says, None for nothing; one entry stands for
    all.
    """
    spelled: dict = {}
    if any(doubt.start):
        spelled["start"] = list(doubt.start)
    if doubt.heading:
        spelled["heading"] = doubt.heading
    if any(doubt.goal):
        spelled["goal"] = list(doubt.goal)
    for name in ("k", "given", "unknown"):
        pairs = getattr(doubt, name)
        if pairs:
            spelled[name] = {str(p): _listed(value) for p, value in pairs}
    if doubt.sensing_eps:
        spelled["sensing_eps"] = float(doubt.sensing_eps)
    return spelled, [None if s is None else spelled_set(s) for s in doubt.obstacles]


def _numbers(name: str, value):
    """A number, a list of numbers, or a table of such by name."""
    if isinstance(value, dict):
        pairs = value.items()
        return tuple((key, _numbers(f"{name} of {key}", part)) for key, part in pairs)
    if value == FREE:
        return FREE
    array = numbers_of(name, value, 1 if isinstance(value, list) else 0)
    return float(array) if np.ndim(array) == 0 else tuple(array.tolist())


def _listed(value):
    if isinstance(value, tuple):
        return value[0] if value[0] == value[1] else list(value)
    return value


def own_doubt(sets: list, n: int) -> list:
    """What is spelled of each of n obstacles."""
    if sets and len(sets) not in (1, n):
        raise InputError(f"doubt: expected a set for each of {n} obstacles; got {len(sets)}.")
    return sets * n if len(sets) == 1 else sets or [None] * n
