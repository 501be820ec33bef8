"""What the reader hands to the proved checker is what the file says: its contract, tried.

    python tests/checker/compare/two_terms.py --count 20000 [--seed 0]

kernel.py translates a file into terms of Coq from docs/certificates.md alone; `check --read` prints
what the reader made of it. Both are compared, term by term, on files with other numbers in other
words (orders of keys, blanks, escapes, spellings), of which nothing may be refused, and on files
with an odd value in one place: there an entry may be refused, but never be another one.
"""

import argparse
import itertools
import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

import answer_files as build
import kernel
import two
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
MOST_FILES = 500  # named in one command


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
    answer = other_numbers(two_readers.VALID[name](), rng)
    problem = answer["problem"]
    if rng.random() < 0.5:
        normals = [["1"] * problem["n_p"], [str(i) for i in range(problem["n_p"])]]
        problem["start"] = {"A": normals, "b": ["3", "1/2"]}
    for obstacle in problem["obstacles"]:
        first = rng.randrange(problem["steps"])
        obstacle["steps"] = [first, rng.randrange(first, problem["steps"])]
    return name, written(build.rehash(reworded(answer, rng)), rng)


def read(program, texts):
    """What the reader made of each text: {field: term}, None where it was refused."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for first in range(0, len(texts), MOST_FILES):
            paths = []
            for i, text in enumerate(texts[first : first + MOST_FILES]):
                paths.append(Path(folder) / f"{i}.json")
                paths[-1].write_text(text)
            command = [*map(str, program), "--read", *map(str, paths)]
            out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            found += map(json.loads, out.splitlines())
    return found


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


def campaign(program, count, seed):
    """(files, of them read, differences as (what was changed, names)) of so many, half of each
    kind.
    """
    rng = random.Random(seed)
    files = [(*other_words(rng), True) for _ in range(count // 2)]
    names = list(two_readers.VALID)
    for _ in range(count - len(files)):
        name = rng.choice(names)
        answer = build.rehash(two_readers.VALID[name]())
        place = rng.choice(list(two_readers.places(answer)))
        value = rng.choice((*two_readers.ODD, ..., NotImplemented))
        changed = two_readers.changed(answer, place, value)
        files.append(((name, place, value), json.dumps(changed), False))
    different, accepted = [], 0
    results = read(program, [text for _, text, _ in files])
    for (what, text, valid), made in zip(files, results, strict=True):
        if refused(made):
            different += [(what, "refused")] if valid else []
        accepted += made is not None
        if made is not None and (names := unlike(json.loads(text), made)):
            different.append((what, names))
    return len(files), accepted, different


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--program", default=str(two.PROGRAM))
    arguments = parser.parse_args()
    seen, accepted, different = campaign([arguments.program], arguments.count, arguments.seed)
    print(f"{seen} files, {accepted} read, {len(different)} differences")
    for change in different[:20]:
        print("  {}: {}".format(*change))
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
