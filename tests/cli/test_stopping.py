"""Ctrl-C at any moment: one line at most, exit code 130."""

import signal

import pytest

from parc_jax import checker
from parc_jax.app import cli


@pytest.fixture
def shell(capsys):
    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main([str(a) for a in arguments])
        return stop.value.code, *capsys.readouterr()

    return run


@pytest.fixture(autouse=True)
def listening():
    """A process that was started in the background has Ctrl-C ignored, as whoever started it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def ctrl_c(*_, **__):
    signal.raise_signal(signal.SIGINT)


def test_check_is_stopped_quietly(shell, monkeypatch, tmp_path):
    (tmp_path / "answer.json").write_text("{}")
    monkeypatch.setattr("parc_jax.checker.answer.check_answer", ctrl_c)
    assert shell("check", tmp_path / "answer.json") == (130, "", "stopped.\n")
    assert checker.main([str(tmp_path / "answer.json")]) == 130


def test_commands_are_stopped_quietly(shell, monkeypatch):
    monkeypatch.setattr("parc_jax.app.cli.systems.installed", ctrl_c)
    assert shell("systems") == (130, "", "parc-jax: stopped.\n")


def test_what_a_library_swallows_is_not_carried_on_to_success(shell, monkeypatch):
    def swallowing():
        try:
            ctrl_c()
        except BaseException:
            return ()

    monkeypatch.setattr("parc_jax.app.cli.systems.installed", swallowing)
    assert shell("systems")[0] == 130


def test_the_handler_of_the_caller_comes_back(shell):
    before = signal.getsignal(signal.SIGINT)
    shell("--version")
    assert signal.getsignal(signal.SIGINT) is before
