"""The wheel alone, with none of the packages that parc_jax needs: an answer can be checked."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import toy_query
from needs import need

import parc_jax as pj

ROOT = Path(pj.__file__).parents[1]
ALONE = """
import sys
sys.path.insert(0, sys.argv[1])
from parc_jax.app.cli import main
main(sys.argv[2:])
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Run a command line of the installed wheel on a Python without site-packages."""
    here = tmp_path_factory.mktemp("wheel")
    for name in ("parc_jax", "sims"):
        shutil.copytree(ROOT / name, here / "source" / name, ignore=shutil.ignore_patterns("*.pyc"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, here / "source")
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", here / "site"]
    subprocess.run([*pip, here / "source"], check=True, cwd=here)
    command = [sys.executable, "-I", "-S", "-c", ALONE, here / "site"]
    return lambda *words: subprocess.run(
        [*command, *words], capture_output=True, text=True, cwd=here
    )


@pytest.fixture(scope="module")
def answer(tmp_path_factory):
    return str(toy_query.answer().save(tmp_path_factory.mktemp("answer") / "answer.json"))


@pytest.mark.slow
def test_a_wheel_without_packages_checks_an_answer(alone, answer, tmp_path):
    done = alone("check", answer)
    assert (done.returncode, done.stderr) == (0, "") and "ACCEPTED" in done.stdout
    wrong = tmp_path / "answer.json"
    edited = json.loads(Path(answer).read_text())
    edited["claim"]["subject"]["system"] = "another"
    wrong.write_text(json.dumps(edited))
    assert alone("check", str(wrong)).returncode == 1


@pytest.mark.slow
def test_a_wheel_without_packages_asks_the_proved_checker(alone, answer):
    need("node")
    done = alone("check", answer, "--second")
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    assert "the proved checker accepts" in done.stdout


@pytest.mark.slow
def test_other_commands_name_the_packages_that_are_missing(alone):
    done = alone("systems")
    assert done.returncode == 2 and "without --no-deps" in done.stderr
    assert "Traceback" not in done.stderr
