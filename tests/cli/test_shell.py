"""The shell end to end on toys: files, exit codes, and one clear sentence for every kind of bad
input.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import toy_query
from robot_text import ROBOT

from parc_jax.app.cli.process import SEARCHING
from parc_jax.problem.problem_file import load_problem, save_problem
from sims.rectangle import POINTS


def test_solve_check_plot(shell, files):
    asked = ("--target", 0.1, "--budget", 300, "--no-cache")
    code, said, complained = shell("solve", "model.npz", "scene.toml", *asked)
    assert code == 0 and "corridors: covering" in said and said.count("\n") <= 15
    assert "parc-jax explain answer.json" in said
    code, all_said, _ = shell("explain", "answer.json")
    assert code == 0 and "(C) For each" in all_said and "(E) " in all_said
    assert "ACCEPTED" in all_said and all_said.count("  sha256 ") == 4
    lines = [line for line in complained.splitlines() if " s: " not in line]  # of life
    assert lines == ["compiling ...", f"{SEARCHING} ..."]
    code, said, _ = shell("check", "answer.json")
    assert code == 0 and said.startswith("ACCEPTED") and said.count("\n") <= 15
    assert f"{all_said.count('  assumed  ')} assumed: " in said and "sha256" not in said
    assert said.endswith("parc-jax explain answer.json\n")
    code, said, _ = shell("plot", "answer.json", "--html", "page.html")
    assert code == 0 and said == "page.html\n" and (files / "page.html").stat().st_size > 10_000
    code, said, _ = shell("plot", "answer.json", "--html", "page.html", "--out", "drawn")
    assert code == 0 and "drawn/samples.png" in said  # a folder of figures asks for them
    code, said, _ = shell(
        "plot", "answer.json", "--out", "figures", "--figures", "samples", "regions"
    )
    assert code == 0 and said.splitlines() == ["figures/samples.png", "figures/regions.png"]
    assert {f.name for f in (files / "figures").iterdir()} == {
        "samples.png",
        "samples.pdf",
        "regions.png",
        "regions.pdf",
    }
    code, _, complained = shell("plot", "answer.json", "--figures", "errors")
    assert code == 2 and "errors" in complained


@pytest.mark.slow
def test_no_plan_is_exit_code_one_with_a_certificate(shell, files):
    save_problem(files / "wall.toml", toy_query.gap(wall=True))
    code, said, _ = shell(
        "solve", "model.npz", "wall.toml", "--out", "none.json", "--json", "--no-cache"
    )
    facts = json.loads(said)
    assert code == 1 and not facts["found"] and facts["proved_no_plan"] and facts["first"] is None
    code, said, _ = shell("check", "none.json")
    assert code == 0 and "no (p0, k) of the model is safe" in said
    (files / "old").mkdir()
    # of an answer with plans, drawn there before
    for name in ("samples.png", "samples.pdf"):
        (files / "old" / name).write_bytes(b"")
    code, _, complained = shell("plot", "none.json", "--out", "old")
    assert code == 0 and "samples.png and samples.pdf in old: of another answer." in complained
    code, said, complained = shell("plot", "none.json", "--figures", "samples")
    assert code == 2 and "this answer has regions only" in complained


def change(old, new):
    return lambda text: text.replace(old, new)


SCENES = {
    "too few goal coordinates": (
        change(
            "lo = [-0.25, -0.25, -1.0]\nhi = [0.25, 0.25, 1.0]",
            "lo = [-0.25, -0.25]\nhi = [0.25, 0.25]",
        ),
        "1 further goal coordinates",
    ),
    "labels of another robot": (
        lambda text: text + '\n[labels]\nk = ["speed [m/s]"]\n',
        "labels of k: expected 2",
    ),
}


@pytest.mark.parametrize("case", SCENES)
def test_bad_scenes(shell, files, case):
    edit, message = SCENES[case]
    text = (files / "scene.toml").read_text()
    assert edit(text) != text
    (files / "scene.toml").write_text(edit(text))
    refused(shell("solve", "model.npz", "scene.toml", "--no-cache"), message)
    assert {f.name for f in files.iterdir()} == {"model.npz", "scene.toml"}  # nothing half-written


def refused(outcome, message):
    """Exit code 2 and one sentence on stderr, nothing else."""
    code, said, complained = outcome
    assert code == 2 and said == "" and message in complained
    assert (
        complained.startswith("parc-jax: ")
        and complained.count("\n") == 1
        and "Traceback" not in complained
    )


@pytest.mark.slow
def test_a_module_of_another_name_than_its_system_validates_its_model(shell, files, monkeypatch):
    monkeypatch.syspath_prepend(files)
    (files / "folded_elsewhere.py").write_text(ROBOT.format(name="toy", dt=0.25))
    asked = ("solve", "model.npz", "scene.toml", "--no-cache", "--validate", "--risk", 0.3)
    refused(shell(*asked), "without .py; got 'toy'")
    code, said, _ = shell(*asked, "--target", 0.3, "--system", "folded_elsewhere")
    assert code == 0 and "Validated in this scene, by toy" in said


def test_bad_files(shell, files):
    whole = (files / "model.npz").read_bytes()
    refused(shell("solve", "none.npz", "scene.toml", "--no-cache"), "none.npz: no such file")
    refused(shell("solve", "model.npz", "none.toml", "--no-cache"), "none.toml: no such file")
    refused(
        shell("solve", "model.npz", "scene.toml", "--system", "asv", "--no-cache"),
        "the system of this model, 'toy', and 'asv'",
    )
    (files / "model.npz").write_bytes(whole[: len(whole) // 2])
    refused(shell("solve", "model.npz", "scene.toml", "--no-cache"), "truncated or damaged")
    np.savez(files / "model.npz", x=1)
    refused(shell("solve", "model.npz", "scene.toml", "--no-cache"), "TrajectoryModel.save")
    (files / "model.npz").write_bytes(whole)
    refused(
        shell("solve", "model.npz", "scene.toml", "--out", "scene.toml/answer.json", "--no-cache"),
        "scene.toml",
    )
    refused(shell("plot", "model.npz", "--out", "figures"), "model.npz")
    refused(shell("plot", "model.npz", "--html", "page.html"), "model.npz")
    assert {f.name for f in files.iterdir()} == {"model.npz", "scene.toml"}


def test_bad_options(shell, files):
    refused(
        shell("solve", "model.npz", "scene.toml", "--samples", 0, "--no-cache"),
        "samples: expected a whole number >= 1",
    )
    refused(shell("solve", "model.npz", "scene.toml", "--budget", 0, "--no-cache"), "a limit above")
    refused(
        shell("solve", "model.npz", "scene.toml", "--target", 2, "--no-cache"), "0 < target < 1"
    )
    refused(shell("learn", "nowhere", "--out", "m.npz", "--no-cache"), "drift_parking")
    refused(
        shell("learn", "drift_parking", "--out", "m.npz", "--plant", "clay", "--no-cache"), "'clay'"
    )
    refused(
        shell("learn", "drift_parking", "--out", "m.npz", "--eps", 2, "--no-cache"),
        "eps: expected a probability",
    )
    refused(shell("learn", "none.npz", "--out", "m.npz", "--no-cache"), "no such file")
    for arguments in (
        ["fly"],
        ["solve"],
        ["solve", "model.npz", "scene.toml", "--method", "magic"],
    ):
        assert shell(*arguments)[0] == 2
    assert {f.name for f in files.iterdir()} == {"model.npz", "scene.toml"}


def test_systems_prints_a_scene_that_solve_reads(shell, tmp_path):
    assert "drift_parking" in shell("systems")[1]
    code, said, _ = shell("systems", "drift_parking")
    (tmp_path / "parking.toml").write_text(said)
    assert code == 0 and load_problem(tmp_path / "parking.toml", POINTS).goal.n == 5 * 2 + 1
    code, said, _ = shell("systems", "drift_parking", "--body", "disc")
    (tmp_path / "parking.toml").write_text(said)
    assert code == 0 and load_problem(tmp_path / "parking.toml").goal.n == 3


MODULES = {
    "typo": (
        "import nosuchmodule\n",
        "line 1 (`import nosuchmodule`): ModuleNotFoundError: No module named 'nosuchmodule'",
    ),
    "syntax": ("def system(:\n", "it fails: SyntaxError"),
    "number": (
        "def system():\n    return 3\n",
        "expected something with name, domain, time, n_p, n_q; got int",
    ),
    "nothing": ("", "expected a function `system()`"),
    "argument": ("def system(x):\n    return x\n", "it fails: TypeError: system() missing 1"),
}


@pytest.mark.parametrize("name", MODULES)
def test_modules_of_your_own_that_are_none(shell, tmp_path, name):
    text, message = MODULES[name]
    (tmp_path / f"robot_{name}.py").write_text(text)
    refused(shell("learn", f"robot_{name}", "--out", "m.npz", "--no-cache"), message)
    for path in ("robot.py", f"./robot_{name}"):
        got = f"as folder.file without .py; got '{path}'"
        refused(shell("learn", path, "--out", "m.npz", "--no-cache"), got)


def test_a_fault_in_a_program_is_not_taken_for_no_plan(shell, monkeypatch):
    monkeypatch.setattr("parc_jax.app.cli.systems.installed", lambda: 1 / 0)
    code, said, complained = shell("systems")
    assert (
        code == 3
        and said == ""
        and "ZeroDivisionError" in complained
        and "lines above say where" in complained
    )


def test_the_console_script_refuses_without_a_traceback(tmp_path):
    script = Path(sys.executable).with_name("parc-jax")
    if not script.exists():
        pytest.skip("the package is not installed")
    done = subprocess.run(
        [script, "solve", "none.npz", "none.toml"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 2 and done.stdout == "" and not list(tmp_path.iterdir())
    assert done.stderr == "parc-jax: none.npz: no such file.\n"


def test_at_the_end_of_a_command_nothing_is_searched_for_garbage():
    at_the_end = "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 0))"
    code = f"{at_the_end}; from parc_jax.app import cli; cli.main(['--version'])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert found.returncode == 0 and found.stdout.splitlines()[-1] == "True"
