"""Odd values in every place of an answer: both checkers must refuse, or accept, the same files.

    python tests/checker/compare/two_readers.py --count 20000 [--seed 0]
    [--program "node parc_jax/checker/proved/js/run.js parc_jax/checker/proved/proved.js"]

What the readers make of a file is not proved. Here every place of answers of each kind holds
another type, a number in another spelling or none, too much or too little; hashes are made right.
"""

import argparse
import copy
import itertools
import json
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

import answer_files as build
import known
import known_points
import two

ODD = (None, True, False, 0, 1, -1, 2, 10**9, 10**20, [], {}, "", "0", "-0", "1/2", "-1/3", "1e-3")
ODD += ("0x1p-1", "-0x1.8p+1", "1/0", "+1", "01", " 1", "1.", ".5", "1e0", "nan", "0X1P0", "\u0661")
ODD += ([[]], [{}], [""], ["0"], [None], {"a": 1}, {"A": [], "b": []}, "ab", [0, "1"], [[0, "1"]])
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


def campaign(program, count, seed):
    """(files, accepted, differences as (valid answer, place, value)) of so many changes at random,
    no two alike.
    """
    answers = {name: build.rehash(make()) for name, make in VALID.items()}
    every = [
        (name, path, value)
        for name, answer in answers.items()
        for path, value in itertools.product(places(answer), (*ODD, ..., NotImplemented))
    ]
    chosen = random.Random(seed).sample(every, min(count, len(every)))
    files = [json.dumps(changed(answers[name], *change)) for name, *change in chosen]
    python = [two.whole_verdict(text) is None for text in files]
    proved = [result["code"] == 0 for result in two.Proved(program).verdicts(files)]
    pairs = zip(chosen, python, proved, strict=True)
    return len(files), sum(python), [change for change, one, other in pairs if one != other]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--program", default=str(two.PROGRAM))
    arguments = parser.parse_args()
    seen, accepted, different = campaign(arguments.program.split(), arguments.count, arguments.seed)
    print(f"{seen} files, {accepted} accepted by the Python checker, {len(different)} differences")
    for change in different[:20]:
        print("  {}: {} = {!r}".format(*change))
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
