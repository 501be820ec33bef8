"""Both checkers on the same files: what each says, and where they differ.

The Python checker's verdicts are taken entry by entry from `Context`, and for what is not in an
entry (hashes, sizes, unknown fields, the tube) from `check_answer`.
"""

import itertools
import json
import subprocess
import tempfile
from pathlib import Path

from parc_jax import checker

PROGRAM = Path(checker.__file__).parent / "proved" / "check"
KINDS = ("samples", "sets", "corridors", "doubt")
RESTS = "The proof rests on the tube"
MOST_FILES = 500  # named in one command


def rejected(function, *arguments):
    try:
        function(*arguments)
    except checker.Rejected as why:
        return str(why) or "rejected"
    return None


def python_verdicts(answer):
    """{kind: [None or the reason of the refusal]}, or the reason why the whole is refused."""
    try:
        context = checker.Context(answer["problem"], answer["network"], answer["tube"])
    except checker.Rejected as why:
        return str(why) or "rejected"
    checks = {
        "samples": context.check_sample,
        "sets": context.check_set,
        "corridors": context.check_sample,
        "doubt": lambda entry: checker.check_doubt(context, entry),
    }
    return {
        kind: [rejected(checks[kind], entry) for entry in answer.get(kind, [])] for kind in KINDS
    }


def whole_verdict(text):
    """None or the reason of the refusal of a file with this text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "answer.json"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return rejected(lambda: checker.check_answer(checker.load(path)))


def proved_verdicts(program, texts, option="--each"):
    """What the proved checker says of each text: {"code", "lines", "entries": {kind: "101…"}}, or
    with --read what it reads.

    `program` is [path of check] or ["node", path of run.js, path of proved.js].
    """
    options = [] if program[0] == "node" else [option]
    texts, said = list(texts), []
    for first in range(0, len(texts), MOST_FILES):
        with tempfile.TemporaryDirectory() as folder:
            paths = []
            for i, text in enumerate(texts[first : first + MOST_FILES]):
                paths.append(Path(folder) / f"{i}.json")
                paths[-1].write_bytes(text if isinstance(text, bytes) else text.encode())
            command = [*map(str, program), *options, *map(str, paths)]
            out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            said += map(json.loads, out.splitlines())
    return said


def about_the_tube(lines):
    """What a checker says of the claim that an accepted answer rests on."""
    return list(itertools.dropwhile(lambda line: not line.startswith(RESTS), lines))


def by_entry(what, text, said):
    """Judges a file by its entries: whether Python accepts each, and None or how they differ."""
    python = python_verdicts(json.loads(text))
    if isinstance(python, str) or not said["entries"]:
        same = isinstance(python, str) and said["code"] == 1 and not said["entries"]
        yield False, None if same else (what, "the question", python)
        return
    for kind in KINDS:
        pairs = zip(python[kind], said["entries"][kind], strict=True)
        for i, (why, digit) in enumerate(pairs):
            same = (why is None) == (digit == "1")
            yield why is None, None if same else (what, f"{kind}[{i}]", why)


def by_file(what, text, said):
    """Judges a file as a whole."""
    python = whole_verdict(text)
    same = (python is None) == (said["code"] == 0)
    yield python is None, None if same else (what, python, said["lines"][0])
