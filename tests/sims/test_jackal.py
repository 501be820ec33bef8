"""The robot as a black box: repeatable by key, a running start with the speeds asked for, hidden
what is not measured, at rest at the end; its quick twin; and the robot that episodes drive.
"""

import threading

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

import parc_jax as pj
import sims
from sims.jackal import Driven, drift, learn, params
from sims.jackal.before import running
from sims.jackal.chained import Chain, chained
from sims.jackal.floor import Law, draw
from sims.jackal.robots import Robots

KEYS = drawn_keys(7, 12)
LO, HI = (-0.1, -2.0, 0.0, -1.5), (2.1, 2.0, 2.0, 1.5)
KS = np.array(LO) + (np.array(HI) - LO) * np.random.default_rng(2).random((12, 4))


@pytest.fixture(scope="module")
def jackal():
    return sims.load("jackal", threads=2)


@pytest.fixture(scope="module")
def poses(jackal):
    return jackal.poses(KEYS, KS)


def test_it_starts_with_the_speeds_that_are_measured(jackal):
    draws = draw(jackal.floor, KEYS)
    robots = running(jackal, draws, KS, np.zeros((12, 3)))
    off = robots.speeds[:, [0, 2]] - KS[:, :2]
    assert (np.abs(off) <= np.array(jackal.floor.sensed) + 1e-12).all()
    assert np.abs(off).max() > 0.5 * params.SENSED[0]
    np.testing.assert_array_equal(robots.set_point, KS[:, :2])


def test_what_is_hidden_at_the_start_differs_and_is_not_seen_in_k():
    """Without any disturbance runs of one k still differ: by what was driven before."""
    quiet = sims.load("jackal", law="none", threads=2)
    runs = quiet.poses(KEYS[:6], np.tile([1.0, 0.5, 0.5, -1.0], (6, 1)))
    apart = np.ptp(runs[:, -1], axis=0)
    assert 1e-4 < apart[:2].max() < 0.1


def test_it_rests_at_the_end(poses):
    last = np.abs(np.diff(poses, axis=1)[:, -1]) / params.TICK
    assert last.max() < 2e-3  # [m/s], [rad/s]
    fastest = jackal_from([2.1, 0.0, 2.0, 0.0])
    assert np.abs(np.diff(fastest, axis=1)[:, -1]).max() / params.TICK < 2e-3


def jackal_from(k) -> np.ndarray:
    return sims.load("jackal", law="none", threads=2).poses(KEYS[:3], np.tile(k, (3, 1)))


def test_the_frame_is_the_pose_at_the_start(jackal, poses):
    assert (poses[:, 0] == 0).all()
    p, q = jackal.rollout_batch(KEYS[:2], KS[:2])
    np.testing.assert_allclose(p[:, 0, 1], [[0.229, 0.208]] * 2)  # the front left corner
    np.testing.assert_array_equal(q[:, 0], poses[:2, -1, 2])
    first = poses[:, 1] / params.TICK
    np.testing.assert_allclose(first[:, [0, 2]], KS[:, :2], atol=0.3)


def test_the_same_run_elsewhere(jackal):
    gap = pj.learning.translation_gap(jackal, jax.random.PRNGKey(0), np.array([[37.0, -11.0]]))
    assert gap.p.max() < 1e-5


def test_another_heading_is_the_same_run_turned(jackal, poses):
    turned = jackal.poses(KEYS[:4], KS[:4], np.tile([0.0, 0.0, 2.2], (4, 1)))
    np.testing.assert_allclose(turned, poses[:4], rtol=0, atol=1e-5)


# the twin


@pytest.fixture(scope="module")
def twin():
    return sims.load("jackal", plant="twin")


@pytest.mark.slow
def test_the_twin_is_roughly_the_robot(twin):
    ks = np.array([[1.0, 0.0, 1.0, 0.0], [1.0, 0.5, 1.0, 0.5], [1.5, 0.0, 0.0, 0.0]])
    p, q = jax.jit(jax.vmap(twin.rollout))(KEYS[:3], jnp.asarray(ks))
    true = sims.load("jackal", threads=1).poses(KEYS[:3], ks)
    np.testing.assert_allclose(p[:, -1, 0], true[:, -1, :2], atol=0.06)
    np.testing.assert_allclose(q[:, 0], true[:, -1, 2], atol=0.15)


# the robot that episodes drive


@pytest.fixture(scope="module")
def system():
    return sims.load("jackal", threads=1)


def episode(system, seed: int, cycles: int = 4) -> Driven:
    robot = Driven(system, (-2.25, 3.0, np.pi / 2), jax.random.PRNGKey(seed))
    for cycle in range(cycles):
        robot.apply(1.5, 0.8 * (-1) ** cycle, 0.2)
    return robot


@pytest.fixture(scope="module")
def driven(system):
    return episode(system, 1)


def test_the_same_key_is_the_same_episode_in_any_thread(system, driven):
    found = {}
    threads = [
        threading.Thread(target=lambda i=i: found.update({i: episode(system, i)})) for i in (1, 2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    np.testing.assert_array_equal(found[1].path, driven.path)
    np.testing.assert_array_equal(found[1].odometry, driven.odometry)
    assert np.abs(found[2].path[-1] - driven.path[-1]).max() > 1e-3


def test_without_a_new_plan_it_stops_by_itself(system):
    robot = Driven(system, (0.0, 0.0, 0.0), jax.random.PRNGKey(3))
    k = robot.begin(2.0, 0.3)
    np.testing.assert_array_equal(k[2:], [2.0, 0.3])
    robot.drive(0.5)
    assert not robot.rests
    robot.drive(0.7)
    assert robot.rests
    # up and down a ramp of 3 m/s^2 for 0.3 s each
    assert robot.pose[0] == pytest.approx(0.27, abs=0.02)
    here = robot.pose
    robot.drive(1.0)
    np.testing.assert_allclose(robot.pose, here, atol=1e-3)


def test_its_manoeuvres_are_those_that_are_learnt(system):
    """From rest, with nothing hidden, an episode's first manoeuvre is the black box's run."""
    quiet = sims.load("jackal", law="none", threads=1)
    robot = Driven(quiet, (0.0, 0.0, 0.0), jax.random.PRNGKey(5))
    k = robot.begin(1.0, 0.8)
    robot.drive(quiet.time.t_f)
    assert np.abs(k[:2]).max() < 1e-4
    run = quiet.poses(drawn_keys(3, 9), np.tile(k, (9, 1)))
    nearest = np.abs(run - robot.path[None]).max(axis=(1, 2)).min()
    assert nearest < 0.01  # of nine, some were at rest before, too


def test_while_its_wheels_stand_odometry_does_too(system):
    robot = Driven(system, (0.0, 0.0, 0.0), jax.random.PRNGKey(8))
    robot.apply(1.0, 0.8, 1.2)
    told, true = robot.odometry, robot.pose
    robot.drive(1.2)
    np.testing.assert_array_equal(robot.odometry, told)
    most = drift.allowed([0.0, 0.0], [0.0, 0.0], drift.slipped(robot), stood=2)
    assert most.holds(robot.pose - true) and max(most) < 1e-4
    robot.drive(0.3)
    robot.apply(0.3, 0.0, 0.3)
    assert not np.array_equal(robot.odometry, told)


def test_a_cycle_adds_little_to_what_dead_reckoning_is_off_by(system, monkeypatch):
    """Less than half of what it adds where the slip that is usual is not taken off."""
    asked = drift.Options(cycles=15)
    calibrated, raw = [], []
    for slip, rows in ((params.SLIP_ALONG, calibrated), (0.0, raw)):
        monkeypatch.setattr(params, "SLIP_ALONG", slip)
        rows += [drift.cycles_of(system, key, asked) for key in np.asarray(KEYS[:3])]
    off, more = (np.hypot(*np.concatenate(rows)[:, :2].T) for rows in (calibrated, raw))
    assert np.median(off) < 0.5 * np.median(more)
    allowed = [drift.Allowed(*row[3:]).holds(row[:3]) for row in np.concatenate(calibrated)]
    assert np.mean(allowed) > 0.9


def test_who_creeps_is_allowed_less_drift_than_who_brakes():
    """The wheels of one that creeps hardly slip; what slipped in the cycle before still counts."""
    thinks = learn.robot()
    added = []
    for first, second in ((0.05, 0.05), (1.8, -0.8)):
        robot = Driven(thinks, (0.0, 0.0, 0.0), jax.random.PRNGKey(6))
        for command in (first, second):
            robot.apply(command, 0.3, 0.2)
        assert len(robot.slips) == len(robot.path)
        slips = drift.slipped(robot)
        assert slips[0] == robot.slips[:, 0].max() and slips[1] == robot.slips[:, 1].max()
        added.append(drift.allowed([0.0, 0.3], [0.0, 0.3], slips))
    creeps, brakes = added
    assert brakes.ahead > 2 * creeps.ahead and brakes.aside >= creeps.aside
    assert brakes.turned == creeps.turned


def test_encoders_do_not_see_slip():
    """Tyres that drive 5 % farther per turn than they should: the robot is faster, the encoders
    count what was asked for."""
    law = Law((0.5, 0.5), (1.0, 1.0), (1.05, 1.05), 0.0)
    robots = Robots(law, draw(law, KEYS[:1]), np.zeros((1, 3)), threads=1)
    robots.drive(np.tile([0.5, 0.0], (50, 1, 1)), params.RAMP)
    np.testing.assert_allclose(robots.speeds[0], [0.525, 0.0, 0.0], atol=5e-3)
    np.testing.assert_allclose(
        robots.encoders * params.WHEEL_RADIUS, np.full((1, 4), 0.5), rtol=0.01
    )


@pytest.mark.parametrize("backward", [0.0, 0.4])
def test_measured_speeds_stay_in_the_domain(backward):
    """Whatever is commanded within K, what is measured next is within K."""
    draws = np.random.default_rng(0)
    system = sims.load("jackal", backward=backward, threads=1)
    robot = Driven(system, (0.0, 0.0, 0.0), jax.random.PRNGKey(8))
    lo, hi = system.domain.lo, system.domain.hi
    seen = []
    for _ in range(40):
        corner = np.where(draws.uniform(size=2) < 0.5, lo[2:], hi[2:])
        inside = draws.uniform(lo[2:], hi[2:])
        seen.append(robot.apply(*np.where(draws.uniform(size=2) < 0.5, corner, inside), 0.2))
    seen = np.array(seen)
    assert (seen >= lo).all() and (seen <= hi).all()


def test_chains_end_in_manoeuvres_of_the_black_box(system):
    """Their k is in K, they start where they say, and rest at the end."""
    lasts = chained(system, drawn_keys(3, 2), Chain(cycles=3), threads=2)
    for last in lasts:
        assert (last.k >= np.array(LO)).all() and (last.k <= np.array(HI)).all()
        assert last.poses.shape == (61, 3) and not last.poses[0].any()
        first = last.poses[1] / params.TICK
        np.testing.assert_allclose(first[[0, 2]], last.k[:2], atol=0.3)
        assert np.abs(np.diff(last.poses[-2:], axis=0)).max() < 1e-4
        assert 0 <= last.off < 0.2 < last.way
