"""Help speaks of numbers, names and paths, not of types."""

import dataclasses
import inspect
import re
from typing import get_args

import pytest

from parc_jax import __version__
from parc_jax.app import cli
from parc_jax.app.cli.learn import learn
from parc_jax.app.cli.options import Offer
from parc_jax.app.cli.run import run
from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound
from parc_jax.safe_set.settings import Settings


def offers(command) -> dict[str, Offer]:
    """The offers of a command by parameter."""
    found = inspect.signature(command).parameters.values()
    return {p.name: x for p in found for x in get_args(p.annotation)[1:] if isinstance(x, Offer)}


COMMANDS = tuple(name for name in cli.COMMANDS if name != "export")


def test_help_is_readable_and_has_an_example(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    wrong = []
    for command in ("", *COMMANDS):
        with pytest.raises(SystemExit) as stop:
            cli.main([command, "--help"] if command else ["--help"])
        said, types = capsys.readouterr().out, re.compile(r"{None|\[INT|STR|FLOAT|None\)")
        words = " ".join(said.split())
        shown = f"parc-jax {command}" in words and "Example" in words
        shown = shown if command else all(name in words for name in COMMANDS)
        wrong += [command] if stop.value.code or types.search(said) or not shown else []
    assert not wrong, wrong


@pytest.mark.parametrize("command", [learn, run])
def test_an_option_of_the_study_names_its_value_there(command):
    options = offers(command)["study"].options()
    assert len(options) >= 15
    kinds = (Study, ModelBound, Settings)
    defaults = {field.name: field.default for kind in kinds for field in dataclasses.fields(kind)}
    for option in options.values():
        assert option.default is None and " Default: the study's, or " in option.text
        value = defaults[option.field]
        if isinstance(value, int | float) and not isinstance(value, bool):
            assert option.text.endswith(f"or {value:,}."), option.field


def test_version(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0 and capsys.readouterr().out == f"parc-jax {__version__}\n"
