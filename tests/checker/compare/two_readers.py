"""Odd values in every place of an answer: both checkers must refuse, or accept, the same files.

What the readers make of a file is not proved. Here every place of answers of each kind holds
another type, a number in another spelling or none, too much or too little; hashes are made right.
"""

import copy
import functools
import itertools
import json

import answer_files as build
import known
import known_points
import two

ODD = (None, True, False, 0, 1, -1, 2, 10**9, 10**20, [], {}, "", "0", "-0", "1/2", "-1/3", "1e-3")
ODD += ("0x1p-1", "-0x1.8p+1", "1/0", "+1", "01", " 1", "1.", ".5", "1e0", "nan", "0X1P0", "\u0661")
ODD += ([[]], [{}], [""], ["0"], [None], {"a": 1}, {"A": [], "b": []}, "ab", [0, "1"], [[0, "1"]])
TWICE = " twice"  # behind a key until it is one more of the same
judge = two.by_file
VALID = known.VALID | known_points.VALID


def places(part, path=()):
    """Every place of a JSON value but its root."""
    keys = part if isinstance(part, dict) else range(len(part)) if isinstance(part, list) else ()
    for key in keys:
        yield (*path, key)
        yield from places(part[key], (*path, key))


def changed(answer, path, value):
    """A copy with another value in a place; with a list there twice as long where the value is
    ..., and with nothing there where it is NotImplemented.
    """
    answer = copy.deepcopy(answer)
    part = answer
    for key in path[:-1]:
        part = part[key]
    if value is NotImplemented:
        del part[path[-1]]
    elif value is ...:
        part[path[-1]] = part[path[-1]] * 2 if isinstance(part[path[-1]], list | str) else []
    else:
        part[path[-1]] = copy.deepcopy(value)
    whole = all(part in answer for part in ("problem", "network", "tube"))
    if whole and "hash" not in path and isinstance(answer.get("claim"), dict):
        build.rehash(answer)
        for part in ("network", "tube"):
            answer["claim"][f"{part}_hash"] = answer["hash"][part]
    return answer


def objects(part):
    """Every place of an object that has a key."""
    for path in ((), *places(part)):
        if isinstance(inner := at(part, path), dict) and inner:
            yield path


def at(answer, path):
    """What stands in a place."""
    return functools.reduce(lambda part, key: part[key], path, answer)


def with_a_key_twice(answer, path, key=None):
    """The text of an answer in which the object in a place has a key, the first of them by default,
    a second time with the same value.
    """
    answer = copy.deepcopy(answer)
    part = at(answer, path)
    key = next(iter(part)) if key is None else key
    part[key + TWICE] = part[key]
    return json.dumps(answer).replace(TWICE, "")


@functools.cache
def every_change():
    """The valid answers, and every change of theirs: (answer, place, value)."""
    answers = {name: build.rehash(make()) for name, make in VALID.items()}
    return answers, [
        (name, path, value)
        for name, answer in answers.items()
        for path, value in itertools.product(places(answer), (*ODD, ..., NotImplemented))
    ]


def batch(rng, left, valid=None):
    """So many of the changes, no two alike, and a key twice in every tenth file instead."""
    answers, every = every_change()
    for name, *change in rng.sample(every, min(left, len(every))):
        text = json.dumps(changed(answers[name], *change))
        if rng.random() < 0.1:
            change = rng.choice(list(objects(answers[name])))
            text = with_a_key_twice(answers[name], change)
        yield (name, *change), text
