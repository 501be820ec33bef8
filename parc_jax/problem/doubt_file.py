"""The table [uncertainty] of a scene file, and what each of the obstacles says of its own."""

import dataclasses

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.problem.scene_values import grown_set_of, numbers_of, spelled_set, table_of
from parc_jax.problem.uncertainty import FREE, Uncertainty

ENTRIES = tuple(field.name for field in dataclasses.fields(Uncertainty))


def uncertainty_of(data: dict, obstacles: list) -> Uncertainty | None:
    """The uncertainty that a scene file spells, None where it has none. Raises InputError.

    [uncertainty]      the fields of `Uncertainty`: numbers and lists, parameters by name in tables,
    obstacles a
        set: lo and hi, A and b, or vertices.
    [[obstacles]] uncertainty = {lo = ..., hi = ...}: of this one alone.
    """
    own = [part.get("uncertainty") for part in obstacles]
    if data.get("uncertainty") is None and not any(own):
        return None
    entries = table_of("uncertainty", data.get("uncertainty") or {}, ENTRIES)
    seen = None
    if "obstacles" in entries:
        seen = grown_set_of("uncertainty obstacles", entries["obstacles"])
    sets = [
        seen if o is None else grown_set_of(f"uncertainty of obstacle {i}", o)
        for i, o in enumerate(own)
    ]
    words = {
        name: _numbers(f"uncertainty {name}", entries[name])
        for name in ("start", "goal", "k", "given", "unknown")
        if name in entries
    }
    eps = entries.get("sensing_eps", 0)
    return Uncertainty(
        **words,
        heading=float(numbers_of("uncertainty heading", entries.get("heading", 0), 0)),
        obstacles=sets if any(s is not None for s in sets) else (),
        sensing_eps=str(eps) if not isinstance(eps, list | dict) else eps,
    )


def spelled_uncertainty(uncertainty: Uncertainty) -> tuple[dict, list]:
    """The table of an uncertainty, and what each obstacle says, None for nothing; one entry stands
    for all.
    """
    spelled: dict = {}
    if any(uncertainty.start):
        spelled["start"] = list(uncertainty.start)
    if uncertainty.heading:
        spelled["heading"] = uncertainty.heading
    if any(uncertainty.goal):
        spelled["goal"] = list(uncertainty.goal)
    for name in ("k", "given", "unknown"):
        pairs = getattr(uncertainty, name)
        if pairs:
            spelled[name] = {str(p): _listed(value) for p, value in pairs}
    if uncertainty.sensing_eps:
        spelled["sensing_eps"] = float(uncertainty.sensing_eps)
    return spelled, [None if s is None else spelled_set(s) for s in uncertainty.obstacles]


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


def own_uncertainty(sets: list, n: int) -> list:
    """What is spelled of each of n obstacles."""
    if sets and len(sets) not in (1, n):
        raise InputError(f"uncertainty: expected a set for each of {n} obstacles; got {len(sets)}.")
    return sets * n if len(sets) == 1 else sets or [None] * n
