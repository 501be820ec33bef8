"""Both checkers on the same answers: the Python one by its functions, the proved one as a program.

The Python checker's verdicts are taken entry by entry from `Context`, and for what is not in an
entry (hashes, sizes, unknown fields, the tube) from `check_answer`.
"""

import json
import subprocess
import tempfile
from pathlib import Path

from parc_jax import checker

PROGRAM = Path(checker.__file__).parent / "proved" / "check"
KINDS = ("samples", "sets", "corridors", "doubt")


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


class Proved:
    """The proved checker as a program: `program` is [path of check] or ["node", path of run.js]."""

    def __init__(self, program):
        self.program = [str(part) for part in program]

    def verdicts(self, texts):
        """For each text of an answer {"code", "lines", "entries": {kind: "101…"}}."""
        each = ["--each"] if self.program[0] != "node" else []
        with tempfile.TemporaryDirectory() as folder:
            paths = []
            for i, text in enumerate(texts):
                paths.append(Path(folder) / f"{i}.json")
                paths[-1].write_bytes(text if isinstance(text, bytes) else text.encode())
            command = [*self.program, *each, *map(str, paths)]
            out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        return [json.loads(line) for line in out.splitlines()]


def differences(python, proved):
    """[(kind, number, Python's reason or None)] where the verdicts on one answer differ."""
    if isinstance(python, str):
        refused = proved["code"] == 1 and not proved["entries"]
        return [] if refused else [("context", 0, python)]
    if not proved["entries"]:
        return [("context", 0, None)]
    found = []
    for kind in KINDS:
        pairs = zip(python[kind], proved["entries"][kind], strict=True)
        found += [
            (kind, i, why)
            for i, (why, digit) in enumerate(pairs)
            if (why is None) != (digit == "1")
        ]
    return found
