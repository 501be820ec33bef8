"""Dynobench's models and scenes: what it stores is replayed by its own models, runs repeat and move
with their start, and a scene is driven.
"""

import subprocess
import sys

import jax
import numpy as np
import pytest

import parc_jax as pj
import sims
from parc_jax.app import cli
from sims.foreign.dynobench import process
from sims.foreign.dynobench.drive import places, start_of
from sims.foreign.dynobench.robots import ROBOTS, TICK
from sims.foreign.dynobench.scenes import SCENES, reference, scene, solutions

NEEDED = pytest.mark.needs("dynobench")
ALL = [(robot, name) for robot in ROBOTS for name in SCENES]


def off(robot, x, y):
    """Differences of states (n, n_x), angles within half a turn."""
    angle = slice(2, 4 if robot == "car1_v0" else 3)
    difference = x - y
    difference[:, angle] = (difference[:, angle] + np.pi) % (2 * np.pi) - np.pi
    return np.abs(difference)


@pytest.mark.night
@NEEDED
@pytest.mark.parametrize(("robot", "name"), ALL)
def test_what_is_stored_is_what_the_models_do_and_touches_nothing(robot, name):
    feasible = [one for one in solutions(robot, name) if one.feasible]
    assert len(feasible) >= 2 and feasible[0].cost == reference(robot, name).cost
    asked = scene(robot, name)
    for one in feasible:
        assert one.cost == pytest.approx(TICK * len(one.controls))
        pairs = zip(one.states, one.controls, strict=False)
        after = [process.ask("steps", robot, x, u[None])[1] for x, u in pairs]
        assert off(robot, np.stack(after), one.states[1:]).max() < 2e-5  # six digits are stored
        assert process.ask("distances", robot, name, one.states).min() > 0.015
        assert off(robot, one.states[[0, -1]], np.stack([asked.start, asked.goal])).max() < 0.01


@pytest.mark.night
@NEEDED
@pytest.mark.parametrize(("robot", "name"), ALL)
def test_outlines_are_dynobenchs_own(robot, name, rng):
    """Where all corners are clear of all boxes by a gap, dynobench measures no more than that."""
    asked, made = scene(robot, name), ROBOTS[robot]
    at_rest = np.zeros(len(made.state))
    poses = rng.uniform([*asked.lo, -np.pi], [*asked.hi, np.pi], (60, 3))
    x = np.array([start_of(made, at_rest, pose[:2], pose[2]) for pose in poses])
    told = process.ask("distances", robot, name, x)
    corners = places(made, x)[:, 1:]
    inside = np.zeros(len(x), bool)
    nearest = np.full(len(x), np.inf)
    for one in asked.obstacles:
        gap = np.maximum(np.maximum(one.lo - corners, corners - one.hi), 0)
        distance = np.linalg.norm(gap, axis=-1).min(axis=1)
        inside |= distance == 0
        nearest = np.minimum(nearest, distance)
    assert inside.any() and (told[inside] <= 0).all()
    assert (told <= nearest + 1e-6).all()


@pytest.mark.night
@NEEDED
@pytest.mark.parametrize("robot", ROBOTS)
def test_runs_repeat_in_processes_and_move_with_their_start(robot):
    alone, many = (sims.load("dynobench", robot=robot, workers=w) for w in (0, 2))
    runs = [
        pj.learning.collect(each, jax.random.PRNGKey(0), n=12, quiet=True) for each in (alone, many)
    ]
    many.close()
    np.testing.assert_array_equal(runs[0].p, runs[1].p)
    moved = np.array([[3.0, -40.0]])
    assert pj.learning.translation_gap(alone, jax.random.PRNGKey(0), moved).p.max() < 1e-9
    assert not runs[0].failed.any()


def test_without_its_python_one_sentence_says_how_to_make_it(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv(process.VARIABLE, str(tmp_path / "none"))
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", "dynobench", "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert stop.value.code == 2 and said.count("\n") == 1
    assert "expected a Python that has it" in said and ".venv-dynobench" in said
    assert not (tmp_path / "out").exists()


def test_the_adapter_loads_no_dynobench():
    code = "import sys, sims.foreign.dynobench; sys.exit('dynobench' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.night
@NEEDED
def test_a_unicycle_is_driven_into_its_parking_space(tmp_path, capsys):
    """With a small model: what it commits to is safe, and what is not is left undriven."""
    from sims.foreign.dynobench.episode import drive_scene, loop_of
    from sims.foreign.dynobench.single import free_poses, starts

    unicycle, key = sims.load("dynobench", workers=0), jax.random.PRNGKey(0)
    runs = pj.learning.collect(unicycle, key, n=3_000, quiet=True)
    net = pj.learning.train(runs, hidden=(24, 24), key=key, seeds=1, steps=3_000)
    more = {"fresh": 1_000, "discard": "most", "bins": (1, 1, 1), "shape": "fitted"}
    claim = pj.learning.bound_error(net, unicycle, key, eps=0.02, train=runs, quiet=True, **more)
    loop = loop_of("unicycle1_v0", pj.learning.trajectory_model(net, claim))
    asked = scene("unicycle1_v0", "parallelpark_0")
    driven = drive_scene(asked, loop)
    assert driven.commitments and driven.inside
    assert driven.clearance > 0 or driven.left
    np.testing.assert_array_equal(driven.path[0], asked.start)
    assert TICK * (len(driven.path) - 1) == pytest.approx(driven.seconds)
    pj.drive.save_episode(tmp_path / "drive.json", driven.commitments[:1])
    with pytest.raises(SystemExit) as stop:
        cli.main(["check", str(tmp_path / "drive.json")])
    assert not stop.value.code and capsys.readouterr().out.startswith("ACCEPTED")
    poses = free_poses(asked, 20, np.random.default_rng(0))
    assert ((asked.lo < poses[:, :2]) & (poses[:, :2] < asked.hi)).all()
    assert starts(asked, loop, 20).n == 20
