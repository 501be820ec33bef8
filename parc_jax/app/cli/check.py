"""`parc-jax check`: the independent checker, and the one that is itself proved."""

import contextlib
import io
import json
from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.offer import Offer
from parc_jax.app.cli.shell import Shell


def check(
    answer: Path,
    /,
    *,
    second: bool = False,
    processes: int = 1,
    shell: Annotated[Shell, Offer("app.cli.shell.Shell", only=("json",))],
) -> int:
    """Verify the certificates of an answer in exact arithmetic; needs no JAX. Example: parc-jax
    check answer.json

    Args:
        answer: The answer file.
        second: Ask the proved checker too: the program that PARC_JAX_PROVED_CHECKER names, else
            the one of the page in node. Exit code 0 if both accept, 1 if either rejects, 3 if the
            second did not look at all of it, as at episodes, which it does not read.
        processes: Share the entries among so many processes.
    """
    from parc_jax import checker

    arguments = [str(answer), f"--processes={processes}", *(["--json"] if shell.json else [])]
    return _both(answer, arguments, shell.json) if second else checker.main(arguments)


def _both(answer: Path, arguments: list[str], as_json: bool) -> int:
    """Both verdicts, and the exit code of the two."""
    from parc_jax import checker
    from parc_jax.app.cli.second import ACCEPTED, IN_PART, REJECTED, ask, find_second

    other = find_second(answer)
    heard = io.StringIO()
    with contextlib.redirect_stdout(heard):
        first = checker.main(arguments)
    if first not in (ACCEPTED, REJECTED):
        return first  # there is no answer to check, and that has been said
    said = ask(other, answer)
    agreed = first == said.code == ACCEPTED
    refused = REJECTED in (first, said.code)
    if as_json:
        report = {
            "accepted": agreed,
            "first": json.loads(heard.getvalue()),
            "second": {"program": other.name, "code": said.code, "lines": said.lines},
        }
        print(json.dumps(report, indent=1))
    else:
        print(f"Python checker:\n{heard.getvalue()}\nProved checker ({other.name}):")
        print("\n".join([*said.lines, "", _sentence(first, said.code)]))
    return ACCEPTED if agreed else REJECTED if refused else IN_PART


def _sentence(first: int, second: int | None) -> str:
    """Both verdicts in one line."""
    words = {0: "accepts", 1: "rejects", 3: "accepts what it looked at, not all", None: "gave none"}
    return f"Verdicts: the Python checker {words[first]}; the proved checker {words[second]}."
