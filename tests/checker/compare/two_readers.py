"""What the readers make of a file, which is not proved: both checkers must refuse, or accept, the
same files, and the proved one must read what the file says.

Every place of answers of each kind holds another type, a number in another spelling or none, too
much or too little; hashes are made right. Bytes outside of the hashed parts are changed. And
kernel.py translates a file into terms of Coq from docs/certificates.md alone; `check --read` prints
what the reader made of it: both are compared, term by term, on files with other numbers in other
words (orders of keys, blanks, escapes, spellings), of which nothing may be refused, and on files
with an odd value in one place: there an entry may be refused, but never be another one.
"""

import copy
import functools
import itertools
import json

import answer_files as build
import kernel
import known
import known_points

ODD = (None, True, False, 0, 1, -1, 2, 10**9, 10**20, [], {}, "", "0", "-0", "1/2", "-1/3", "1e-3")
ODD += ("0x1p-1", "-0x1.8p+1", "1/0", "+1", "01", " 1", "1.", ".5", "1e0", "nan", "0X1P0", "\u0661")
ODD += ([[]], [{}], [""], ["0"], [None], {"a": 1}, {"A": [], "b": []}, "ab", [0, "1"], [[0, "1"]])
TWICE = " twice"  # behind a key until it is one more of the same
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


def odd_values(rng, left, valid=None):
    """So many of the changes, no two alike, and a key twice in every tenth file instead."""
    answers, every = every_change()
    for name, *change in rng.sample(every, min(left, len(every))):
        text = json.dumps(changed(answers[name], *change))
        if rng.random() < 0.1:
            change = rng.choice(list(objects(answers[name])))
            text = with_a_key_twice(answers[name], change)
        yield (name, *change), text


# ---- Bytes ----

ODD_BYTES = [bytes([b]) for b in b'{}[]",:0123456789-+.eEpx/\\u ntf\x00\n\xff\xc3']
SLOTS = ("samples", "sets", "corridors", "no_plan", "claim", "format", "hash")


def changed_bytes(rng, left, valid):
    """Files of one answer with up to two bytes changed, doubled or left out."""
    answer = {**valid, "meta": {"note": "ignored"}, "no_plan": None}
    for kind in build.KINDS:
        answer[kind] = answer[kind][:2]
    hashed = json.dumps({part: answer[part] for part in ("problem", "network", "tube")})[1:-1]
    rest = json.dumps({key: value for key, value in answer.items() if key in (*SLOTS, "meta")})
    for number in range(left):
        text = bytearray(rest[:-1].encode())
        for _ in range(rng.choice([0, 1, 1, 2])):
            at = rng.randrange(len(text))
            text[at : at + rng.randint(0, 1)] = rng.choice(ODD_BYTES) * rng.randint(0, 2)
        yield number, bytes(text) + b", " + hashed.encode() + b"}"


# ---- Terms ----

LISTS = ("samples", "sets", "corridors", "doubts")
WORDS = (
    "format",
    "claim",
    "hash",
    "meta",
    "kind",
    "pattern",
)  # what holds other texts than numbers


def spelled(text, rng):
    """The same number in another spelling, of those that docs/certificates.md allows."""
    value = kernel.fraction(text)
    top, bottom = value.numerator, value.denominator
    times = rng.randint(1, 9)
    ways = [text, f"{top * times}/{bottom * times}"]
    if bottom == 1:
        ways += [f"{top}.000", f"{top}e0", f"{top}00e-2", f"{top}0.0e-1"]
    if bottom & (bottom - 1) == 0:
        sign = "-" if top < 0 else ""
        power = bottom.bit_length() - 1
        ways += [f"{sign}0x{abs(top):x}p-{power}", f"{sign}0x{abs(top):x}.00p{-power:+}"]
        ways += [f"{sign}0x{abs(top) << 4:x}p{-power - 4}", f"{sign}0x0{abs(top):x}.p-{power}"]
    short = [way for way in ways if len(way) < 40]  # before and after the point are 40 digits each
    return rng.choice(short or [text])


def reworded(part, rng):
    """A value of JSON with numbers in other spellings and keys in another order."""
    if isinstance(part, dict):
        keys = rng.sample(list(part), len(part))
        return {key: part[key] if key in WORDS else reworded(part[key], rng) for key in keys}
    if isinstance(part, list):
        return [reworded(value, rng) for value in part]
    if isinstance(part, str):
        return spelled(part, rng)
    return part


def written(part, rng):
    """A text of JSON with blanks and escapes where they may be."""
    blank = rng.choice(("", "", "", " ", "\n", "\t", "\r\n "))
    if isinstance(part, dict):
        pairs = (f"{written(k, rng)}{blank}:{written(v, rng)}" for k, v in part.items())
        return f"{{{blank}{','.join(pairs)}{blank}}}"
    if isinstance(part, list):
        return f"[{blank}{','.join(written(value, rng) for value in part)}{blank}]"
    if isinstance(part, str):
        escaped = rng.random() < 0.1 and all(" " <= c <= "~" for c in part)
        text = "".join(f"\\u{ord(c):04x}" for c in part) if escaped else json.dumps(part)[1:-1]
        return f'{blank}"{text}"{blank}'
    return f"{blank}{json.dumps(part)}"


def other_numbers(part, rng):
    """A value of JSON with some of its numbers changed; what they prove is not asked."""
    if isinstance(part, dict):
        kept = (*WORDS, "dt", "room")  # the reader wants them positive
        return {key: x if key in kept else other_numbers(x, rng) for key, x in part.items()}
    if isinstance(part, list):
        return [other_numbers(value, rng) for value in part]
    if isinstance(part, str) and rng.random() < 0.1:
        return f"{rng.randint(-99, 99)}/{rng.randint(1, 9)}"
    return part


def other_words(rng):
    """(name, text) of an answer that can be read."""
    name = rng.choice(list(VALID))
    answer = other_numbers(VALID[name]() | {"claim": None}, rng)  # which says some too
    problem = answer["problem"]
    if rng.random() < 0.5:
        normals = [["1"] * problem["n_p"], [str(i) for i in range(problem["n_p"])]]
        problem["start"] = {"A": normals, "b": ["3", "1/2"]}
    for obstacle in problem["obstacles"]:
        first = rng.randrange(problem["steps"])
        obstacle["steps"] = [first, rng.randrange(first, problem["steps"])]
    return name, written(build.rehash(reworded(answer, rng)), rng)


def unlike(answer, made):
    """Names of what the reader made otherwise; an entry may be refused."""
    expected = kernel.tried(kernel.terms, answer)
    if expected is None:
        return ["the question"]
    found = [name for name in expected if name not in LISTS and made[name] != expected[name]]
    if "absent" in found and made["absent"] == "Unread":
        found.remove("absent")
    for kind in LISTS:
        pairs = itertools.zip_longest(expected[kind], made[kind])
        found += [kind for one, other in pairs if other not in (one, "None")]
    return found


def refused(made):
    """Whether the reader refused a file or an entry of it."""
    return made is None or made["absent"] == "Unread" or any("None" in made[k] for k in LISTS)


def reworded_files(rng, left, valid=None):
    """So many files, half of each kind: (whether it must be read, what was changed)."""
    for _ in range(left // 2):
        name, text = other_words(rng)
        yield (True, name), text
    names = list(VALID)
    for _ in range(left - left // 2):
        name = rng.choice(names)
        answer = build.rehash(VALID[name]())
        place = rng.choice(list(places(answer)))
        value = rng.choice((*ODD, ..., NotImplemented))
        odd = changed(answer, place, value)
        yield (False, (name, place, value)), json.dumps(odd)


def by_terms(what, text, made):
    """Whether it was read, and as what."""
    must_be_read, changed = what
    different = ["refused"] if must_be_read and refused(made) else []
    if made is not None:
        different += unlike(json.loads(text), made)
    yield made is not None, (changed, different) if different else None
