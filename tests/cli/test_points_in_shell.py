"""Several reference points in the shell: what does not fit is one sentence and exit code 2."""

import numpy as np
import pytest
from turning_bar import straight_bar

from parc_jax.app import cli

SCENE = """
[goal]
points = ["tail"]
lo = [-0.1, -0.1]
hi = [0.1, 0.1]

[goal.q]
lo = [-1.0]
hi = [1.0]

[body]
capsule = ["tail", "nose"]
radius = 0.05

[[obstacles]]
lo = [-0.5, 0.3]
hi = [-0.3, 0.6]
"""


@pytest.fixture
def shell(capsys, monkeypatch, tmp_path):
    """Run a command line beside model.npz and scene.toml: (exit code, complaint)."""
    monkeypatch.chdir(tmp_path)
    straight_bar().save("model.npz")
    (tmp_path / "scene.toml").write_text(SCENE)

    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main([str(a) for a in arguments])
        return (stop.value.code or 0), capsys.readouterr().err

    return run


def refused(outcome, message):
    code, complained = outcome
    assert code == 2 and message in complained and complained.count("\n") == 1
    assert complained.startswith("parc-jax: ")


WRONG = {
    "number beyond the points": ('capsule = ["tail", "nose"]', "points = [0, 2]", "got 2"),
    "an obstacle in space": (
        "lo = [-0.5, 0.3]\nhi = [-0.3, 0.6]",
        "lo = [-0.5, 0.3, 0.0]\nhi = [-0.3, 0.6, 1.0]",
        "2-D workspace",
    ),
    "a goal over further points": (
        SCENE[: SCENE.index("[body]")],
        "[goal]\nlo = [-0.1, -0.1]\nhi = [0.1, 0.1]\n",
        "each of its 2 points",
    ),
    "a goal over no state": ("[goal.q]\nlo = [-1.0]\nhi = [1.0]", "", "further goal coordinates"),
}


@pytest.mark.parametrize("case", WRONG)
def test_scenes_that_do_not_fit_the_points(shell, tmp_path, case):
    old, new, message = WRONG[case]
    assert old in SCENE
    (tmp_path / "scene.toml").write_text(SCENE.replace(old, new))
    refused(shell("solve", "model.npz", "scene.toml", "--no-cache"), message)


def test_logs_whose_points_do_not_fit(shell, tmp_path):
    p = np.zeros((30, 9, 2, 2))
    np.savez(tmp_path / "log.npz", k=np.random.default_rng(0).random((30, 2)), p=p)
    times = ("--dt", 0.25, "--t-f", 1, "--dt-record", 0.125, "--out", "m.npz", "--no-cache")
    refused(shell("learn", "log.npz", *times), "names of the 2 reference points")
    refused(shell("learn", "log.npz", *times, "--points", "a", "b", "c"), "3 reference points")
    refused(shell("learn", "log.npz", *times, "--points", "a", "a"), "distinct names")


def test_bodies_that_a_system_has_not(shell):
    refused(shell("systems", "drift_parking", "--body", "triangle"), "rectangle, disc, decagon")
    learn = ("learn", "drift_parking", "--out", "m.npz", "--no-cache")
    refused(shell(*learn, "--plant", "ode", "--body", "triangle"), "rectangle, disc, decagon")
