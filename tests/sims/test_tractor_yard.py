"""The tractor for episodes: it turns as its geometry says, comes to rest, and goes on from any
state as if nobody had asked.
"""

import json
from types import SimpleNamespace

import jax
import numpy as np
import pytest

import parc_jax as pj
from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from sims.tractor import params as c
from sims.tractor.driver import Driven, drive
from sims.tractor.episodes import Options, drive_yards
from sims.tractor.gates import WIDE, any_yard, distance
from sims.tractor.yard import Ground, State, Yard, places, turned, yard

KEYS = np.arange(8, dtype=np.uint32).reshape(4, 2)


@pytest.fixture(scope="module")
def runs():
    """Random manoeuvres from rest, and their states."""
    system = yard(threads=1)
    lo, hi = system.domain.lo, system.domain.hi
    ks = np.random.default_rng(0).uniform(lo, hi, (4, 5))
    ks[:, :3] = 0.0
    return system, ks, *system.rollout_from_state(KEYS, system.start_state(KEYS), ks)


def at(states: State, record: int) -> State:
    return State(*(part[:, record] for part in states))


def test_it_turns_as_its_geometry_says(monkeypatch):
    """Slowly and without disturbances: the circle of the rear axle, and the angle at which the
    trailer's axle points at the same centre.
    """
    calm = Ground((1.0, 1.0), (1.0, 1.0), 0.0, 0.0, (0.0, 0.0, 0.0))
    system = Yard(calm, yard().domain, pj.learning.time_grid(0.2, 40.0, c.STEP), threads=1)
    monkeypatch.setattr(c, "HELD", 40.0)
    ks = np.array([[0.0, 0.0, 0.0, 0.5, 0.3]])
    _, states = system.rollout_from_state(KEYS[:1], system.start_state(KEYS[:1]), ks)
    last = at(states, -1)
    radius = c.WHEELBASE / np.tan(0.3)
    speed = system.measured(last)[0, 0]
    assert speed / last.qvel[0, 2] == pytest.approx(radius, rel=0.02)
    hitch = -np.arctan(c.HITCH / radius) - np.arcsin(c.DRAWBAR / np.hypot(radius, c.HITCH))
    assert last.qpos[0, 4] == pytest.approx(hitch, abs=0.03)


def test_it_rests_at_the_end_and_stays(runs):
    system, ks, _, states = runs
    last = at(states, -1)
    assert np.abs(last.qvel[:, [0, 1, 2, 4]]).max() < 1e-3
    stay = np.column_stack([system.measured(last), 0 * ks[:, :1], ks[:, 4:]])
    again, _ = system.rollout_from_state(KEYS, last, stay)
    assert np.abs(again.p - again.p[:, :1]).max() < 1e-3


def test_a_run_is_told_from_its_pose_wherever_that_is(runs):
    system, ks, told, _ = runs
    start = system.start_state(KEYS)
    start.qpos[:, :3] = [30.0, -20.0, 2.2]
    moved, _ = system.rollout_from_state(KEYS, start, ks)
    assert np.abs(moved.p - told.p).max() < 1e-9
    assert np.abs(told.p[:, 0, 0]).max() == 0 and moved.q == pytest.approx(told.q, abs=1e-9)


def test_chains_of_manoeuvres_are_runs_of_it():
    chain = pj.learning.chained(yard(threads=1), before=2, hand_over=(0.4, c.YARD_T_F))
    runs = pj.learning.collect(chain, jax.random.PRNGKey(0), n=4, quiet=True)
    assert np.abs(runs.k[:, 0]).max() > 0.1  # they start while it drives
    # the angle of the trailer is measured, up to what is declared, so its first corners are known
    rear = turned(np.array([-4.0, 0.9]), runs.k[:, 2]) - np.array([c.HITCH, 0.0])
    assert np.abs(runs.p[:, 0].reshape(4, 9, 2)[:, 6] - rear).max() < 4.2 * 0.005 + 1e-9


def test_a_driven_one_goes_on_with_its_manoeuvre_and_stops():
    robot = Driven(yard(threads=1), [3.0, 1.0, 0.5], np.array([1, 2], np.uint32))
    assert robot.pose == pytest.approx([3.0, 1.0, 0.5]) and np.abs(robot.measured).max() < 0.05
    robot.begin(np.array([*robot.measured, 1.5, 0.1]))
    robot.drive(0.4)
    early = robot.measured[0]
    robot.drive(0.4)
    assert 0.3 < early < robot.measured[0] < 1.4
    robot.drive(5.0)
    assert abs(robot.measured[0]) < 0.03 and robot.time == pytest.approx(5.8)
    assert len(robot.path) == 117


def test_yards_have_gates_and_a_body_in_a_wall_touches_it():
    world = any_yard(np.array([3, 4], np.uint32))
    gate = world.walls[2:4]
    assert gate[0, 1] - gate[1, 3] == pytest.approx(WIDE) and len(world.walls) == 10
    through = np.zeros(5)
    through[:2] = [12.0, world.gates[0]]
    room = (WIDE - 1.6) / 2  # of the tractor; its trailer is still before the gate
    assert distance(places(through)[None], world.walls) == pytest.approx(room)
    through[1] += 1.0
    assert distance(places(through)[None], world.walls) == 0.0


@pytest.mark.night
def test_it_learns_and_drives_a_yard_and_its_file_is_accepted(tmp_path):
    options = Options(episodes=2, out=tmp_path, rollouts=1500, eps=2e-2, jobs=0, quiet=True)
    done, said = drive_yards(options)
    assert done.touched == 0 and done.failed == 0 and "reached the end of the yard" in said
    files = sorted((tmp_path / "episodes").glob("*.json"))
    assert len(files) == 3  # one of the first yard by another seed
    for file in files:
        assert checker.check_episode(json.loads(file.read_text()), allowance_of).moving == 0
    again, _ = drive_yards(options)
    assert again.driven == done.driven


def test_what_came_of_yards_is_told_also_where_all_of_them_failed(tmp_path, monkeypatch):
    driven = [SimpleNamespace(failed="no simulator", told={})]
    done = SimpleNamespace(driven=driven, n=1, failed=1, details=lambda: "(C)")
    found = {"learn": None, "content_of": "", "pj.load": SimpleNamespace(claim="none")}
    for name, what in (found | {"pj.drive.drive_episodes": done}).items():
        monkeypatch.setattr(f"sims.tractor.episodes.{name}", lambda *_, what=what, **__: what)
    _, said = drive_yards(Options(episodes=1, out=tmp_path))
    assert "0 of 1 reached" in said and "1 had no outcome; 0 manoeuvres." in said


def test_who_finds_nothing_waits_and_gives_up():
    """A loop that commits to nothing: the robot rests until patience ends."""
    nothing = SimpleNamespace(
        restart=lambda: None, step=lambda *a, **b: SimpleNamespace(new=False, reason="no")
    )
    world = any_yard(np.array([1, 1], np.uint32))
    robot = Driven(yard(threads=1), world.start, np.array([1, 2], np.uint32))
    assert len(drive(world, robot, nothing)) == 20
    assert robot.pose == pytest.approx(world.start)
