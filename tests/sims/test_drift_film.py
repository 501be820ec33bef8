"""The film of drift parking: the stage is the scene, the run ends in the goal, and no OpenGL is one
sentence.
"""

import os
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest
from matplotlib.image import imread

import parc_jax as pj
from sims.drift_parking.film import run, view
from sims.drift_parking.scenario import problem


@pytest.mark.night
def test_the_run_is_the_simulator_s_and_the_camera_sees_it():
    plan = np.array([5.6, -2.9, 9.25, 0.676])
    poses = run(plan)
    goal = problem().goal
    assert (goal.A @ poses[-1, :3] <= goal.b).all() and (poses[0, :2] == plan[:2]).all()
    assert np.abs(np.diff(poses[-10:, :2], axis=0)).max() < 0.01  # at rest
    assert poses[:, 0].min() < view(problem(), poses, (960, 480)).lookat[0] < 40


@pytest.fixture(scope="module")
def answer_file(tmp_path_factory):
    model = pj.load(Path(__file__).parents[1] / "data" / "drift_4x8.npz")
    answer = pj.Planner(model).solve(
        problem(), jax.random.PRNGKey(0), pj.Settings(samples=3, samples_only=True)
    )
    path = tmp_path_factory.mktemp("answer") / "answer.json"
    answer.save(path)
    return path


@pytest.mark.night
@pytest.mark.parametrize("backend", ["egl", "glfw", "nonsense"])
def test_a_film_or_one_sentence(backend, answer_file, tmp_path):
    """In its own process, since mujoco picks an OpenGL when it is imported."""
    command = [
        sys.executable,
        "-c",
        "from parc_jax.app.cli import main; main()",
        "plot",
        str(answer_file),
    ]
    command += ["--video", "frames", "--sample", "1"]
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"} | {
        "MUJOCO_GL": backend
    }
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    if done.returncode:
        assert (
            done.returncode == 2
            and "no OpenGL here" in done.stderr
            and "Traceback" not in done.stderr
        )
        assert done.stderr.splitlines()[-1].startswith("parc-jax: film:") and not list(
            tmp_path.iterdir()
        )
        return
    images = [imread(path)[:, :, :3] for path in sorted((tmp_path / "frames").glob("*.png"))]
    if backend == "nonsense":  # a plain film from above, of another size
        assert len(images) > 100
        return
    assert len(images) > 100 and images[0].shape == (480, 960, 3)
    red = [
        np.argwhere((im[:, :, 0] > 0.5) & (im[:, :, 1] < 0.3)).mean(axis=0)
        for im in (images[0], images[-1])
    ]
    assert (
        red[1][1] > red[0][1] + 200 and red[1][0] > red[0][0] + 50
    )  # the red car went right and down
