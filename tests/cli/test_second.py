"""`parc-jax check --second`: both verdicts, the program that was asked, and the exit code of the
two.
"""

import json
import os
from fractions import Fraction as F

import known
import pytest
from episode_files import Robot, sealed
from toy_file import save, toy_file

from parc_jax.app.cli import check as second
from parc_jax.app.cli import main

SAYS = {  # stands for the built program: what it prints, and the code that it ends with
    "accepts": ('{"code": 0, "lines": ["ACCEPTED. So it is."], "entries": {}}', 0),
    "rejects": ('{"code": 1, "lines": ["REJECTED: no"], "entries": {}}', 0),
    "a part": ('{"code": 3, "lines": ["PROVED IN PART."], "entries": {}}', 0),
    "a new code": ('{"code": 4, "lines": []}', 0),
    "nothing": ("", 0),
    "a list": ("[]", 0),
    "accepts and breaks": ('{"code": 0, "lines": []}', 2),
}
needs_node = pytest.mark.needs("node")


@pytest.fixture
def shell(shell, monkeypatch, tmp_path):
    """`parc-jax check --second` on an answer."""
    monkeypatch.delenv(second.VARIABLE, raising=False)

    def run(answer, *more):
        path = save(tmp_path / "answer.json", answer)
        return shell("check", path, "--second", *more)

    return run


@pytest.fixture
def stand_in(monkeypatch, tmp_path):
    """Puts a program in the place of the built one."""

    def put(says):
        text, code = SAYS[says]
        program = tmp_path / "program"
        program.write_text(
            f'#!/bin/sh\n[ "$1" = --each ] && [ -f "$2" ] || exit 9\necho \'{text}\'\nexit {code}\n'
        )
        program.chmod(0o755)
        monkeypatch.setenv(second.VARIABLE, str(program))

    return put


def moved():
    """An answer whose first sample misses the goal."""
    answer = toy_file()
    answer["samples"][0]["k"][0] = "0.5"
    return answer


def with_no_plan():
    return next(
        answer for make in known.VALID.values() if (answer := make())["no_plan"] is not None
    )


@pytest.mark.smoke
@needs_node
def test_both_accept_on_node(shell):
    code, said, complained = shell(toy_file())
    assert code == 0 and complained == ""
    assert said.count("ACCEPTED. Proved") == 2 and "(node, with proved.js)" in said
    last = "Verdicts: the Python checker accepts; the proved checker accepts."
    assert said.splitlines()[-1] == last


@pytest.mark.smoke
@needs_node
def test_both_reject_on_node(shell):
    code, said, _ = shell(moved())
    assert code == 1 and said.count("REJECTED: ") == 2
    assert said.splitlines()[-1].endswith("checker rejects; the proved checker rejects.")


@pytest.mark.smoke
@needs_node
def test_both_accept_a_proof_that_there_is_no_plan(shell):
    code, said, _ = shell(with_no_plan())
    assert code == 0 and said.count("ACCEPTED. Proved") == 2
    assert "no (p0, k) of the model is safe" in said and "no (p0, k) of the domain is safe" in said


@pytest.mark.night
@needs_node
def test_thousands_of_entries_fit_the_stack_of_node(shell):
    answer = toy_file()
    answer["samples"] = answer["samples"][:1] * 8000
    code, said, _ = shell(answer)
    assert code == 0 and said.count("  8000 samples (p0, k): the goal is reached") == 2


@needs_node
def test_as_json(shell):
    code, said, _ = shell(moved(), "--json")
    report = json.loads(said)
    assert code == 1 and report["accepted"] is False and report["first"]["accepted"] is False
    assert report["second"]["code"] == 1 and report["second"]["program"].startswith("node")
    code, said, _ = shell(toy_file(), "--json")
    assert code == 0 and json.loads(said)["accepted"] is True


@pytest.mark.parametrize(
    ("answer", "says", "code"),
    [
        (toy_file, "accepts", 0),
        (toy_file, "rejects", 1),
        (toy_file, "a part", 3),
        (moved, "accepts", 1),
        (moved, "a part", 1),
        (moved, "nothing", 1),
    ],
)
def test_the_exit_code_of_two_verdicts(shell, stand_in, answer, says, code):
    stand_in(says)
    seen, said, _ = shell(answer())
    assert seen == code and f"(the program {second.os.environ[second.VARIABLE]})" in said


@pytest.mark.parametrize("says", ["a new code", "nothing", "a list", "accepts and breaks"])
def test_what_is_no_verdict_never_accepts(shell, stand_in, says):
    stand_in(says)
    code, said, _ = shell(toy_file())
    assert code == 3 and "NO VERDICT" in said and said.rstrip().endswith("checker gave none.")


@needs_node
def test_a_fault_in_node_is_no_rejection(monkeypatch, tmp_path):
    monkeypatch.setattr(second, "PROVED_JS", tmp_path / "absent.js")
    monkeypatch.delenv(second.VARIABLE, raising=False)
    answer = save(tmp_path / "answer.json", toy_file())
    said = second.ask(second.find_second(), answer)
    assert said.code is None and "ended with 1" in said.lines[0]


def test_without_node_one_sentence_says_what_to_install(shell, monkeypatch):
    monkeypatch.setattr(second.shutil, "which", lambda name: None)
    code, said, complained = shell(toy_file())
    assert code == 2 and said == "" and complained.count("\n") == 1
    assert "there is neither. Install node (Debian: apt-get install nodejs)" in complained


def test_options_that_the_help_offers_are_taken_back_too(shell, stand_in):
    stand_in("accepts")
    code, said, complained = shell(toy_file(), "--no-second", "--json", "--no-json")
    assert code == 0 and complained == "" and said.startswith("ACCEPTED") and "Verdicts" not in said
    code, said, complained = shell(toy_file(), "--seconds")
    assert code == 2 and said == "" and complained.startswith("usage: parc-jax check")
    assert "[--no-second]" in " ".join(complained.split())


def test_a_pipe_which_is_read_once_is_refused_in_one_sentence(stand_in, tmp_path, capsys):
    stand_in("accepts")
    ours, theirs = os.pipe()
    os.write(theirs, save(tmp_path / "answer.json", toy_file()).read_bytes())
    os.close(theirs)
    with pytest.raises(SystemExit) as done:
        main(["check", f"/dev/fd/{ours}", "--second"])
    os.close(ours)
    assert done.value.code == 2 and "is a pipe, which is read once" in capsys.readouterr().err


def test_a_named_program_that_is_none(shell, monkeypatch, tmp_path):
    monkeypatch.setenv(second.VARIABLE, str(tmp_path / "absent"))
    code, said, complained = shell(toy_file())
    assert code == 2 and said == "" and "PARC_JAX_PROVED_CHECKER: expected" in complained


def test_what_is_no_answer_is_code_two(shell, stand_in):
    stand_in("accepts")
    code, said, complained = shell({"format": "another"})
    assert code == 2 and said == "" and "expected an answer file" in complained


@needs_node
def test_of_an_episode_both_have_a_verdict(shell, monkeypatch):
    """The proved one too, of one that is driven in the world, and of one that turns."""
    monkeypatch.delenv(second.VARIABLE, raising=False)
    robot = Robot(6)
    for heading in (None, F(1, 3)):
        file = robot.episode(robot.driven(2, heading))
        code, said, _ = shell(file)
        last = "the proved checker accepts what it looked at, not all."
        assert code == 3 and said.splitlines()[-1].endswith(last)
        assert "2 manoeuvres of one body" in said and "NOT PROVED here: that each began" in said
        code, said, _ = shell(file, "--json")
        report = json.loads(said)
        assert code == report["second"]["code"] == 3 and report["accepted"] is False
    file["manoeuvres"][1]["problem"]["obstacles"][0]["b"][2] = "0"  # reaches to where it stands
    code, said, _ = shell(sealed(file))
    assert code == 1 and "REJECTED: 1 entries are not proved, the first is manoeuvres[1]" in said
