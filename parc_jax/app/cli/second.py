"""The second checker, which is itself proved: which program of it is here, and what it says."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

from parc_jax import checker
from parc_jax.checker.proved import PROVED_JS
from parc_jax.common.errors import InputError

VARIABLE = "PARC_JAX_PROVED_CHECKER"
# Its verdict is read from what it prints: node itself ends with 1 where a program has a fault.
ON_NODE = """
require(process.argv[1]);
const bytes = require("fs").readFileSync(process.argv[2]);
console.log(JSON.stringify(parcCheck(bytes)));
"""
ACCEPTED, REJECTED, IN_PART = 0, 1, 3
NO_EPISODES = "NO VERDICT: the proved checker reads answers; it does not read episodes."


class Second(NamedTuple):
    """A program of the second checker: its name for people, and what to put before the file."""

    name: str
    command: tuple[str, ...]


class Said(NamedTuple):
    """Its verdict: ACCEPTED, REJECTED or IN_PART, None where it gave none; and its words."""

    code: int | None
    lines: list[str]


def reads(answer: Path) -> bool:
    """Does the second checker read such files? Of what is no file of either kind the first one says
    what it is.
    """
    try:
        return not checker.is_episode(checker.load(answer))
    except (OSError, checker.Rejected):
        return True


def find_second(answer: Path) -> Second:
    """The built program that the environment names, else node with the one of the page; none of
    them for an episode. Raises InputError.
    """
    if not reads(answer):
        return Second("it reads no episodes", ())
    named = os.environ.get(VARIABLE)
    if named:
        program = shutil.which(named)
        if program is None:
            raise InputError(
                f"{VARIABLE}: expected the program that `make` builds in parc_jax/checker/proved; "
                f"{named} is none. Name it, or unset the variable to use node."
            )
        return Second(f"the program {named}", (program, "--each"))
    node = shutil.which("node")
    if node is None:
        raise InputError(
            "check --second: expected node, or the built program of the proved checker; there is "
            f"neither. Install node (Debian: apt-get install nodejs), or name the program in "
            f"{VARIABLE}."
        )
    return Second(f"node, with {PROVED_JS.name}", (node, "-e", ON_NODE, str(PROVED_JS)))


def ask(second: Second, answer: Path) -> Said:
    """What the second checker says of a file."""
    if not second.command:
        return Said(None, [NO_EPISODES])
    done = subprocess.run(
        [*second.command, str(answer.resolve())], capture_output=True, text=True, errors="replace"
    )
    try:
        verdict = json.loads(done.stdout)
        code, lines = verdict["code"], verdict["lines"]
        known = done.returncode == 0 and code in (ACCEPTED, REJECTED, IN_PART)
    except (ValueError, KeyError, TypeError):
        known = False
    if not known:
        why = (done.stderr.strip() or done.stdout.strip() or "nothing was printed")[-300:]
        return Said(None, [f"NO VERDICT: the program ended with {done.returncode}: {why!a}"])
    return Said(code, [str(line) for line in lines])
