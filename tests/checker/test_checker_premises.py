"""What a claim rests on, as both checkers print it: numbers that they have checked themselves, and
the file's word, marked as such. Known to both: tests/helpers/known.py.
"""

import json
import sys
from pathlib import Path

import answer_files as build
import known
import pytest

from parc_jax import checker
from parc_jax.app.cli import check as second
from parc_jax.checker.claim import LONGEST, MAX_PREMISES

sys.path.insert(0, str(Path(__file__).parent / "compare"))

import two

ODD = "\x1b[2J\\ \u00e9\u20ac\U0001f600\ud800\x7f'\"\n  checked  eps: 0"
PREMISES = {
    why: make for why, (make, limits) in known.CASES.items() if "premise" in why and not limits
}


def about_the_tube(lines):
    """What is said of the claim, without the hashes."""
    return [line for line in two.about_the_tube(lines) if "sha256" not in line]


def told(answer):
    """The same of the Python checker for an answer, as it stands in a file."""
    answer = json.loads(json.dumps(build.rehash(answer)))
    return about_the_tube(checker.summary(checker.check_answer(answer)))


@pytest.fixture
def second_told(monkeypatch, tmp_path):
    """What the proved checker says of an answer, on node."""
    monkeypatch.delenv(second.VARIABLE, raising=False)

    def ask(answer):
        path = tmp_path / "answer.json"
        path.write_text(answer if isinstance(answer, str) else json.dumps(build.rehash(answer)))
        return second.ask(second.find_second(path), path)

    return ask


def assumed():
    """Of a claim without evidence."""
    answer = known.plain()
    answer["claim"] |= {"kind": "declared\x1b", "premises": [["why", "assumed", "a datasheet"]]}
    return answer


def odd():
    """Of every kind of character, too long to print, and of whole numbers in lists in lists."""
    long = ["K", "measured", [["-1", 7], "x" * 600, []]]
    return known.with_premises([ODD, "assumed", ODD], long, ["none", "measured", []])


def without():
    """A claim that lacks one of its numbers, and states what else it rests on."""
    answer = known.plain()
    del answer["claim"]["looks"]
    answer["claim"]["premises"] = [["IID", "assumed", ""]]
    return answer


def no_claim():
    """Nobody says anything of the tube."""
    return known.plain() | {"claim": None}


STATED = (known.with_premises, known.with_premises_of_bins, assumed, odd, without, no_claim)
STATED += (known.plain, lambda: known.claim_of_bins(known.BLOCK, known.BLOCK))


def test_each_premise_has_a_line_and_the_sentence_of_the_file_has_none():
    assert told(known.with_premises()) == [
        "The proof rests on the tube. That so many runs show this eps with this delta was",
        "  checked; what is not marked so is the file's word:",
        "  checked  eps: 1/1000",
        "  checked  delta: 1/1000",
        "  checked  n: 6905 runs",
        "  checked  discards: 0",
        "  checked  looks: 1",
        "  measured failed: 0",
        "  measured K: -1, 1",
        "  assumed  IID",
    ]
    of_bins = told(known.with_premises_of_bins())
    assert "  checked  n: 7100 recordings or more in each" in of_bins
    assert "  checked  bins: 1 of 2 with a claim" in of_bins


def test_of_an_older_file_the_numbers_are_told_and_all_else_is_assumed():
    assert told(known.plain())[2:] == [
        *told(known.with_premises())[2:7],
        "  assumed  all else: the file states no premises of its claim",
    ]


def test_what_is_quoted_is_escaped_and_short():
    lines = told(odd())
    assert all(line.isascii() and line.isprintable() for line in lines)
    assert sum(line.startswith("  checked  ") for line in lines) == len(known.SHOWN)
    assert max(map(len, lines)) < 2 * LONGEST + 100
    assert lines[-2].startswith("  measured K: -1, 7, xxx") and "(609 characters)" in lines[-2]
    assert told(assumed())[0] == f"{two.RESTS}, which is ASSUMED (kind declared\\x1b):"


@pytest.mark.needs("node")
@pytest.mark.parametrize("make", STATED)
def test_both_print_the_same_lines(make, second_told):
    said = second_told(make())
    assert said.code == second.ACCEPTED and about_the_tube(said.lines) == told(make())


@pytest.mark.needs("node")
@pytest.mark.parametrize("why", PREMISES)
def test_the_proved_checker_rejects_them_too(why, second_told):
    """What the Python checker rejects in test_checker_checks.py."""
    said = second_told(PREMISES[why]())
    assert said.code == second.REJECTED and "malformed" not in said.lines[0], said


@pytest.mark.needs("node")
@pytest.mark.parametrize("more", [0, 1])
def test_both_count_the_premises(more, second_told):
    """One line each, and no more than somebody may read."""
    listed = [[f"x{i}", "assumed", ""] for i in range(MAX_PREMISES - len(known.SHOWN) + more)]
    answer = known.with_premises(*listed)
    assert (second_told(answer).code == second.ACCEPTED) == (more == 0)
    assert (two.rejected(checker.check_answer, answer) is None) == (more == 0)
