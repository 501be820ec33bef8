"""What the reader hands to the proved checker is what the file says: its contract, tried.

kernel.py translates a file into terms of Coq from docs/certificates.md alone; `check --read` prints
what the reader made of it. Both are compared, term by term, on files with other numbers in other
words (orders of keys, blanks, escapes, spellings), of which nothing may be refused, and on files
with an odd value in one place: there an entry may be refused, but never be another one.
"""

import itertools
import json

import answer_files as build
import kernel
import two_readers

LISTS = ("samples", "sets", "corridors", "doubts")
WORDS = (
    "format",
    "claim",
    "hash",
    "meta",
    "kind",
    "pattern",
)  # what holds other texts than numbers
OPTION = "--read"


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
    name = rng.choice(list(two_readers.VALID))
    answer = other_numbers(two_readers.VALID[name]() | {"claim": None}, rng)  # which says some too
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


def batch(rng, left, valid=None):
    """So many files, half of each kind: (whether it must be read, what was changed)."""
    for _ in range(left // 2):
        name, text = other_words(rng)
        yield (True, name), text
    names = list(two_readers.VALID)
    for _ in range(left - left // 2):
        name = rng.choice(names)
        answer = build.rehash(two_readers.VALID[name]())
        place = rng.choice(list(two_readers.places(answer)))
        value = rng.choice((*two_readers.ODD, ..., NotImplemented))
        changed = two_readers.changed(answer, place, value)
        yield (False, (name, place, value)), json.dumps(changed)


def judge(what, text, made):
    """Whether it was read, and as what."""
    must_be_read, changed = what
    different = ["refused"] if must_be_read and refused(made) else []
    if made is not None:
        different += unlike(json.loads(text), made)
    yield made is not None, (changed, different) if different else None
