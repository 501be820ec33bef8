"""Help fits a terminal of 80 columns and speaks of numbers, names and paths, not of types."""

import dataclasses
import inspect
import re
from pathlib import Path
from typing import Literal

import pytest

from parc_jax import __version__, cli
from parc_jax.cli.help import fitted, metavar_of
from parc_jax.cli.learn import learn
from parc_jax.cli.run import run
from parc_jax.experiment.settings import Study

COMMANDS = ("run", "learn", "solve", "check", "replay", "plot", "bench", "systems", "doctor")


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_fits_and_is_readable(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit) as stop:
        cli.main([command, "--help"] if command else ["--help"])
    said = capsys.readouterr().out
    assert stop.value.code in (0, None)
    assert max(map(len, said.splitlines())) <= 80
    for type_word in ("{None}", "[INT", "STR", "FLOAT", "None)"):
        assert type_word not in said


@pytest.mark.parametrize("command", [learn, run])
def test_an_option_of_the_study_names_its_value_there(command):
    hints = inspect.signature(command).parameters
    told = dict(
        re.findall(r"^        (\w+): (.*?)(?=^        \w|^    $|\Z)", command.__doc__, re.S | re.M)
    )
    shared = [f for f in dataclasses.fields(Study) if f.name in hints and f.name in told]
    assert len(shared) >= 14
    for field in shared:
        text = " ".join(told[field.name].split())
        assert hints[field.name].default is not None or "Default: " in text, field.name
        if isinstance(field.default, int | float) and field.name != "driven":
            assert f"or {field.default:,}." in text, field.name


def test_metavars():
    assert metavar_of(int | None) == "N" and metavar_of(Path) == "PATH"
    assert metavar_of(tuple[int, ...] | None) == "N N ..."
    assert metavar_of(Literal["a", "b"]) == "a|b"
    assert metavar_of(tuple[Literal["a", "b"], ...]) == "{a|b} ..."
    assert metavar_of(bool) is None


def test_version(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0 and capsys.readouterr().out == f"parc-jax {__version__}\n"


def test_sentences_fit_a_terminal_and_stay_whole_elsewhere(monkeypatch):
    text = f"name  value\n{'word ' * 40}done\n{'cell    ' * 20}"
    assert fitted(text) == text
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    lines = fitted(text).split("\n")
    assert lines[0] == "name  value" and lines[-1] == "cell    " * 20
    assert max(map(len, lines[1:-1])) <= 80 and " ".join(lines[1:-1]).endswith("done")
