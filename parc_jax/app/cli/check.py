"""`parc-jax check`: the independent checker, the proved one; `parc-jax explain`: all sentences."""

import contextlib
import io
import json
import os
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path
from typing import Annotated, NamedTuple

from parc_jax import checker
from parc_jax.app.cli.options import Offer, Shell
from parc_jax.checker.answer import command_line, tell
from parc_jax.checker.proved import PROVED_JS
from parc_jax.common.errors import InputError

VARIABLE = "PARC_JAX_PROVED_CHECKER"
# Its verdict is read from its output: node itself ends with 1 where a program has a fault.
ON_NODE = """
require(process.argv[1]);
const bytes = require("fs").readFileSync(process.argv[2]);
console.log(JSON.stringify(parcCheck(bytes)));
"""
ACCEPTED, REJECTED, IN_PART = 0, 1, 3
# begins a line of the second about a part at which only the first looks, as of each episode
NOT_HERE = "NOT PROVED here:"
VERDICTS = {
    ACCEPTED: "accepts",
    REJECTED: "rejects",
    IN_PART: "accepts what it looked at, not all",
    None: "gave none",
}
# lines of a report that say a premise or a hash, of which a terminal gets the number
PREMISE = re.compile(r"  (checked|measured|assumed|sha256)\s+([^:]*)")


def check(
    answer: Path,
    /,
    *,
    second: bool = False,
    processes: int = 1,
    shell: Annotated[Shell, Offer("app.cli.options.Shell", only=("json",))],
) -> int:
    """Verify the certificates of an answer in exact arithmetic; needs no JAX. Example: parc-jax
    check answer.json

    Args:
        answer: The answer file.
        second: Ask the proved checker too: the program that PARC_JAX_PROVED_CHECKER names, else
            the one of the page in node. Exit code 0 if both accept, 1 if either rejects, 3 if the
            second did not look at all of it, which of an episode it never does.
        processes: Share the entries among so many processes.
    """
    options = [("--second", second), ("--json", shell.json)]
    given = [name for name, asked in options if asked]
    return brief([f"--processes={processes}", *given, "--", str(answer)])


def brief(arguments: list[str]) -> int:
    """The checker's command line and what the shell adds, its report in short; the exit code."""
    parser = command_line()
    parser.prog = "parc-jax check"
    parser.add_argument("--second", action="store_true", help="ask the proved checker too")
    for name in ("json", "second"):  # help offers both ways of each
        parser.add_argument(f"--no-{name}", dest=name, action="store_false", default=False)
    try:
        asked = parser.parse_args(arguments)
    except SystemExit as told:
        return told.code
    arguments = [f"--processes={asked.processes}", *["--json"] * asked.json, "--", asked.answer]
    if asked.second:
        return both(Path(asked.answer), arguments)
    code, said = reported(arguments)
    if code == ACCEPTED and not asked.json:
        said = "\n".join(shortened(said.splitlines(), asked.answer))
    if said:
        tell(said.removesuffix("\n"))
    return code


def reported(arguments: list[str]) -> tuple[int, str]:
    """The exit code of the checker's command line, and what it prints."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        code = checker.main(arguments)
    return code, printed.getvalue()


def shortened(lines: list[str], answer: Path | str) -> list[str]:
    """A report with its premises and hashes counted, and the place where they stand."""
    found = [PREMISE.match(line) for line in lines]
    kinds = Counter(match[1] for match in found if match)
    pairs = zip(lines, found, strict=True)  # what was seen against the tube is told in full
    told = ("TUBE_LEFT", "bins")  # so are bins without a claim
    out = [line for line, match in pairs if match is None or match[2].rstrip() in told]
    if kinds:
        assumed = ", ".join(match[2] for match in found if match and match[1] == "assumed")
        out += [
            f"  {kinds['checked']} premises checked, {kinds['measured']} measured, "
            f"{kinds['assumed']} assumed{': ' if assumed else ''}{assumed}",
            f"All of it, and hashes: parc-jax explain {answer}",
        ]
    return out


def both(answer: Path, arguments: list[str]) -> int:
    """Both verdicts, and the exit code of the two."""
    other = find_second()  # refused before the first one takes its time
    if answer.is_fifo():
        raise InputError(
            f"check --second: expected a file, which each checker reads; {answer} is a pipe, which "
            "is read once. Save it first."
        )
    first, printed = reported(arguments)
    if first not in (ACCEPTED, REJECTED):
        return first  # the first checker has reported that this is no answer
    verdict = ask(other, answer)
    agreed = first == verdict.code == ACCEPTED
    refused = REJECTED in (first, verdict.code)
    if "--json" in arguments:
        second = {"program": other.name, "code": verdict.code, "lines": verdict.lines}
        report = {"accepted": agreed, "first": json.loads(printed), "second": second}
        print(json.dumps(report, indent=1))
    else:
        lines = printed.splitlines()
        own = [line for line in verdict.lines if line not in lines]
        one, two = VERDICTS[first], VERDICTS[verdict.code]
        said = f"Verdicts: the Python checker {one}; the proved checker {two}."
        title = f"Proved checker ({other.name}), where it says it otherwise:"
        print("\n".join(["Python checker:", *shortened(lines, answer), title, *own, said]))
    return ACCEPTED if agreed else REJECTED if refused else IN_PART


class Second(NamedTuple):
    """A program of the second checker: its name for people, and the words before the file."""

    name: str
    command: tuple[str, ...]


class Verdict(NamedTuple):
    """ACCEPTED, REJECTED or IN_PART, None for no verdict; and the printed lines."""

    code: int | None
    lines: list[str]


def find_second() -> Second:
    """The program that the environment names, else that of the page in node. Raises InputError."""
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
            "neither. Install node (Debian: apt-get install nodejs), or name the program in "
            f"{VARIABLE}."
        )
    return Second(f"node, with {PROVED_JS.name}", (node, "-e", ON_NODE, str(PROVED_JS)))


def is_episode(file: Path) -> bool:
    """Whether it is that of an episode, of any version; False for one that cannot be read."""
    try:
        return checker.is_episode(checker.load(file))
    except (OSError, checker.Rejected):
        return False  # a checker reports it


def ask(second: Second, answer: Path) -> Verdict:
    """Run the second checker on a file."""
    command = [*second.command, str(answer.resolve())]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    with contextlib.suppress(ValueError, KeyError, TypeError):
        verdict = json.loads(done.stdout)
        code, lines = verdict["code"], [str(line) for line in verdict["lines"]]
        # node ends with 1 for a fault in a program too: only a printed code is a verdict
        if done.returncode == 0 and code in (ACCEPTED, REJECTED, IN_PART):
            in_part = code == ACCEPTED and any(line.startswith(NOT_HERE) for line in lines)
            return Verdict(IN_PART if in_part else code, lines)
    why = (done.stderr.strip() or done.stdout.strip() or "nothing was printed")[-300:]
    return Verdict(None, [f"NO VERDICT: the program ended with {done.returncode}: {why!a}"])


def explain(place: Path, /) -> int:
    """All sentences of an answer: what is proved, what is shown, what is assumed, and the whole
    report of the checker. Example: parc-jax explain runs/drift_parking

    Args:
        place: An answer or episode file, which is checked anew, or the folder of a study, with the
            times of its stages.
    """
    from parc_jax.app.study.report import explained

    file = place / "answer.json" if place.is_dir() else place
    if not is_episode(file):
        print(explained(place), end="\n\n")
    return checker.main([str(file)])
