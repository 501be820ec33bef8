"""The shell in this process, in an empty folder, and the files that its commands take.

Where this folder is named in the command, pytest reads this file before shapes are checked: nothing
of the project is imported outside of a fixture.
"""

from pathlib import Path

import pytest


@pytest.fixture
def shell(capsys, monkeypatch, tmp_path):
    """Run a command line: (exit code, what it printed, what it complained)."""
    from parc_jax.app import cli

    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main([str(a) for a in arguments])
        return (stop.value.code or 0), *capsys.readouterr()

    return run


@pytest.fixture
def files(tmp_path):
    """model.npz and scene.toml of the toy query."""
    import toy_query

    from parc_jax.problem.problem_file import save_problem

    toy_query.planner().model.save(tmp_path / "model.npz")
    save_problem(tmp_path / "scene.toml", toy_query.gap())
    return tmp_path


@pytest.fixture
def cart(monkeypatch):
    """toy_cart is a module that the shell finds by its name."""
    import toy_cart

    monkeypatch.syspath_prepend(str(Path(toy_cart.__file__).parent))
