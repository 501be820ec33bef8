"""Edits of a JSON value, one at a time: every leaf changed, every list an element less or more,
every field gone.
"""

import copy
from fractions import Fraction

import answer_files as build


def edits(value, place=()):
    """Pairs of a place, a tuple of keys, and the whole value edited there."""
    if isinstance(value, dict):
        for key in value:
            yield (*place, key, "-"), {name: value[name] for name in value if name != key}
            for path, part in edits(value[key], (*place, key)):
                yield path, value | {key: part}
        return
    if isinstance(value, list):
        if value:
            yield (*place, "-"), value[:-1]
            yield (*place, "+"), [*value, copy.deepcopy(value[-1])]
        for i, entry in enumerate(value):
            for path, part in edits(entry, (*place, i)):
                yield path, [*value[:i], part, *value[i + 1 :]]
        return
    for other in others(value):
        if other != value:
            yield (*place, f"={other}"), other


def others(leaf):
    """Other values of its kind."""
    if isinstance(leaf, bool) or leaf is None:
        return [0, not leaf]
    if isinstance(leaf, int):
        return [leaf + 1, leaf - 1]
    try:
        x = build.one_value(leaf)
    except ValueError:
        return [f"{leaf}x", leaf[:-1]]
    return [build.text(x + Fraction(1, 64)), build.text(x * Fraction(63, 64)), build.text(-x)]
