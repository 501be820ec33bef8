"""A plugin for pytest: what the tests hand to the Python checker also goes to the proved one.

    PYTHONPATH=tests/checker/compare pytest -p both tests/checker tests/certificate …

Every answer given to `checker.check_answer` is written down and judged twice; at the end the counts
and the first differences are printed, and a difference fails the run.
"""

import json

import pytest
import two

from parc_jax import checker
from parc_jax.app.files import answer_file

SEEN, ACCEPTED, DIFFERENT = set(), [], []


def refuse(text):
    raise ValueError(text)


def judged(answer):
    """Whether the Python checker accepts it."""
    return two.rejected(two.check_answer, answer) is None


def compare(answer):
    try:
        text = json.dumps(answer)
        json.loads(text, parse_float=refuse, parse_constant=refuse)
    except (TypeError, ValueError):  # not an answer that a file could hold
        return
    if text in SEEN or not isinstance(answer, dict):
        return
    SEEN.add(text)
    verdict = two.proved_verdicts([two.PROGRAM], [text])[0]
    python = judged(answer)
    ACCEPTED.append(python)
    if python != (verdict["code"] == 0):
        DIFFERENT.append((python, verdict["lines"][0], text))


def pytest_configure(config):
    two.check_answer = checker.check_answer

    def both(answer):
        compare(answer)
        return two.check_answer(answer)

    checker.check_answer = both
    answer_file.check_answer = both


def pytest_terminal_summary(terminalreporter):
    terminalreporter.write_line(
        f"both checkers: {len(ACCEPTED)} answers, {sum(ACCEPTED)} accepted, "
        f"{len(DIFFERENT)} differences"
    )
    for different in DIFFERENT[:5]:
        terminalreporter.write_line(f"  Python accepts: {different[0]}; {different[1]}")


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    if DIFFERENT:
        session.exitstatus = 1
