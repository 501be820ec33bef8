"""`learn` from bags: a folder of them becomes a model, and what cannot be meant leaves nothing."""

import numpy as np
import pytest
from needs import need

import parc_jax as pj

need("rosbags")
from bag_files import drive, write  # noqa: E402

ASKED = ("--pose", "/odom", "--command", "/cmd_vel", "--k", "linear.x", "angular.z")
TIMES = ("--dt", 0.25, "--t-f", 0.75, "--dt-record", 0.05)
K = ("--domain", 0.2, 1.0, -0.5, 0.5)


@pytest.fixture
def learn(shell):
    return lambda *options: shell("learn", *options, "--out", "m.npz", "--no-cache")


def cut_off(path):
    inside = next(path.glob("*.mcap"))
    inside.write_bytes(inside.read_bytes()[:-1000])


CASES = [
    (None, (*TIMES, *ASKED[2:]), "expected --pose to cut runs out of bags; none was given"),
    (None, ASKED, "expected --dt and --t-f to cut runs out of bags"),
    (None, (*TIMES, "--pose", "/pose", *ASKED[2:]), "expected a topic /pose; it has /cmd_vel"),
    (None, (*TIMES, *ASKED, "--frames", "map", "base_link"), "it has odom -> base_link"),
    (None, (*TIMES, *ASKED, "--rollouts", 100), "--rollouts: expected with a system"),
    (None, (*TIMES, *ASKED, "--points", "a", "b"), "--points: expected with tables of runs"),
    (cut_off, (*TIMES, *ASKED), "expected a complete bag; it is truncated or damaged"),
]


@pytest.mark.parametrize(("harm", "options", "why"), CASES)
def test_bad_bags_are_refused_in_one_sentence(learn, tmp_path, harm, options, why):
    commands = [[0.5, 0.1], [0.8, -0.2]]
    path = write(tmp_path / "run", "mcap", drive(commands), commands)
    if harm:
        harm(path)
    code, said, complained = learn("run", *options)
    assert code == 2 and said == "" and why in complained
    assert complained.startswith("parc-jax: ") and complained.count("\n") == 1
    assert [f.name for f in tmp_path.iterdir()] == ["run"]


def test_options_of_bags_are_refused_for_other_logs(learn, tmp_path):
    np.savez("log.npz", k=np.zeros((2, 1)), p=np.zeros((2, 5, 2)))
    code, _, complained = learn("log.npz", "--pose", "/odom")
    assert code == 2 and "--pose: expected with bags only, which log.npz is not" in complained


@pytest.mark.slow
def test_a_folder_of_bags_becomes_a_model(learn, tmp_path):
    rng = np.random.default_rng(0)
    (tmp_path / "days").mkdir()
    for i in range(24):
        commands = rng.uniform([0.2, -0.5], [1.0, 0.5], (4, 2))
        write(tmp_path / "days" / f"{i:02}.bag", "ros1", drive(commands, rng), commands)
    small = ("--hidden", 8, "--seeds", 1, "--steps", 300, "--bins", 1, 1, "--eps", 0.3)
    code, said, complained = learn("days", *TIMES, *ASKED, *K, *small, "--delta", 0.1, "--quiet")
    assert code == 0, complained
    model = pj.load(tmp_path / "m.npz")
    assert model.rotation == ("turns",) and model.labels.q == ("heading [rad]",)
    assert "56 for training" in said and "over the 10 calibration recordings (of 40 runs)" in said
