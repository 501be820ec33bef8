"""Windows of other recordings: poses that come when they come, two runs under a command, failures
kept.
"""

import numpy as np
import pytest

from sims.foreign.husky import learn, trials
from sims.foreign.husky.windows import grid, read_windows

SIZE = (1.5, 1.4)
SPEED, TURNING = 0.5, 0.7  # [m/s, rad/s]


def held_poses(fresh: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (n_t, 2) and headings (n_t,) of a robot on a circle, each held until the next pose; in
    a frame in which it does not start at the origin, and turned so far that its heading wraps.
    """
    at = np.maximum.accumulate(np.where(fresh, t, -1.0))
    yaw = 3.0 + TURNING * at
    way = SPEED * (np.exp(1j * yaw) - np.exp(3.0j)) / (1j * TURNING) + (2 - 1j)
    return np.stack([way.real, way.imag], axis=1), np.angle(np.exp(1j * yaw))


@pytest.fixture
def file(tmp_path):
    """Six windows of two commands: one right after the change, one of two commands, one whose poses
    end early, one that is suspect.
    """
    t = np.arange(40) * 0.05
    fresh = np.zeros((6, 40), bool)
    fresh[:, 2::3] = True
    fresh[4, 20:] = False
    places, headings = zip(*(held_poses(row, t) for row in fresh), strict=True)
    path = tmp_path / "windows.npz"
    np.savez(
        path,
        t=t,
        p=np.stack(places),
        yaw=np.stack(headings),
        fresh=fresh,
        cmd_wheel=np.repeat([[1.0, 2.0], [2.0, 1.5]], 3, axis=0),
        cmd_const=np.array([True, True, True, True, True, False]),
        command_id=np.repeat([4, 7], 3),
        window=np.array([0, 1, 2, 1, 2, 2]),
        suspect=np.array([False, False, True, False, False, False]),
    )
    return path


def test_runs_start_at_their_first_pose_and_follow_the_circle(file):
    cut = read_windows(file, SIZE)
    assert cut.runs.groups.tolist() == [4, 4, 7, 7]
    assert cut.runs.law.k_law == "logged"
    t = np.arange(grid().n_record + 1) * 0.1
    np.testing.assert_allclose(cut.yaw[:3], np.tile(TURNING * t, (3, 1)), atol=1e-9)
    ahead = SPEED * np.sin(TURNING * t) / TURNING
    sagitta = SPEED * TURNING * 0.15**2 / 8  # [m] of the straight line between two poses
    np.testing.assert_allclose(cut.p[:3, :, 0], np.tile(ahead, (3, 1)), atol=1.01 * sagitta)


def test_a_window_whose_poses_end_early_is_a_failed_run(file):
    assert read_windows(file, SIZE).runs.failed.tolist() == [False, False, False, True]
    assert not read_windows(file, SIZE, seconds=0.6).runs.failed.any()


def recording(path, slip: float):
    """A file of 60 commands, two windows each, of a robot that follows its twist, and slides
    sideways by a random part of `slip` [m/s].
    """
    rng = np.random.default_rng(5)
    t = np.arange(40) * 0.05
    k = np.repeat(rng.uniform(-3.0, 3.0, (60, 2)), 2, axis=0)
    speed, turning = k @ [0.1, 0.1], k @ [-0.2, 0.2]
    sideways = slip * rng.uniform(-1.0, 1.0, 120)
    way = (speed + 1j * sideways)[:, None] * (np.exp(1j * turning[:, None] * t) - 1)
    way = way / (1j * turning[:, None])
    np.savez(
        path,
        t=t,
        p=np.stack([way.real, way.imag], axis=-1),
        yaw=turning[:, None] * t,
        fresh=np.ones((120, 40), bool),
        cmd_wheel=k,
        cmd_const=np.ones(120, bool),
        command_id=np.repeat(np.arange(60), 2),
        window=np.tile([1, 2], 60),
        suspect=np.zeros(120, bool),
    )
    return path


@pytest.mark.night
def test_a_robot_on_ice_gets_no_plan_and_one_with_grip_gets_some(tmp_path, monkeypatch):
    for name, less in (("MODEL_RUNS", 2000), ("SEEDS", 1), ("STEPS", 800)):
        monkeypatch.setattr(learn, name, less)
    grip = trials.trial(recording(tmp_path / "grip.npz", 0.01), (0.84, 0.66))
    assert grip["commands_behind_the_claim"] == 15 and grip["eps"] == pytest.approx(0.181, abs=1e-3)
    assert grip["share_of_k_at_least"] > 0.1  # one corridor is enough
    assert grip["confidence_of_that_share"] == 0.999
    assert grip["left_the_tube"] <= 6  # of 15: more happens with probability 1 % at that eps
    assert grip["replays"] > 50 > grip["replays_failed"]
    ice = trials.trial(recording(tmp_path / "ice.npz", 2.0), (0.84, 0.66))
    assert ice["half_width_at_the_end"] > 1.0 and ice["share_of_k_at_least"] == 0.0
    assert ice["status"] in ("no-plan", "not-found") and "replays" not in ice
