"""Two processes on loopback: the node drives a small world through topics, and the checker proves
all of it.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sliding
from needs import need
from toy_models import told

from parc_jax import checker

pytestmark = pytest.mark.night
HELPERS = Path(sliding.__file__).parent
ROOT = HELPERS.parents[1]
GIVEN = "given:=[twist.twist.linear.x, twist.twist.linear.y]"
ASKED = ("radius:=0.2", "leave:=0.4", "deadline:=300.0", "arrived:=0.4", GIVEN)


@pytest.fixture
def graph():
    """An environment of its own: no other graph, nothing leaves the machine."""
    need("rclpy", "nav_msgs", "sensor_msgs", "shapely")
    path = os.pathsep.join([str(ROOT), str(HELPERS), os.environ.get("PYTHONPATH", "")])
    return os.environ | {
        "PYTHONPATH": path,
        "ROS_DOMAIN_ID": str(os.getpid() % 100),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "JAX_PLATFORMS": "cpu",
    }


def node(graph, folder, *asked):
    parameters = [word for one in asked for word in ("-p", one)]
    command = [sys.executable, "-m", "sims.ros.node", "--ros-args", *parameters]
    return subprocess.Popen(command, env=graph, cwd=folder, stderr=subprocess.PIPE, text=True)


def stopped(pilot) -> str:
    """What it said, once Ctrl-C has ended it. Pressed again after a minute: rclpy may miss one that
    comes between two callbacks.
    """
    for _ in range(5):
        pilot.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            return pilot.communicate(timeout=60)[1]
    pilot.kill()
    raise AssertionError(f"the node does not end: {pilot.communicate()[1]}")


def test_the_node_drives_a_small_world_and_the_checker_proves_it(graph, tmp_path):
    told(sliding.model(), given=(0, 1)).save(tmp_path / "model.npz")
    pilot = node(graph, tmp_path, "model:=model.npz", "episode:=drive.json", *ASKED)
    try:
        world = [sys.executable, str(HELPERS / "ros_world.py"), "seen.json"]
        done = subprocess.run(world, env=graph, cwd=tmp_path, capture_output=True, text=True)
    finally:
        complained = stopped(pilot)
    assert done.returncode == 0, (done.stderr, complained)
    assert pilot.returncode == 0, complained
    seen = json.loads((tmp_path / "seen.json").read_text())
    assert seen["arrived"] and seen["names"] == ["k0", "k1", "k2", "k3"]
    assert any(said.startswith("Restarted") for said in seen["statements"])
    assert "proved in exact arithmetic" in seen["proved"]
    assert "nothing; k0 = 0, k1 = 0, since it is asked at rest" in seen["proved"]
    assert np.abs(np.array(seen["plan"])[-1] - [0.4, 0.1]).max() <= 0.1
    assert all(len(path) == 13 for path in seen["paths"])
    assert any("nothing is touched" in s and "(E) " in s for s in seen["statements"])
    for x0, y0, x1, y1 in ((1.0, -0.4, 1.2, 0.3), (2.2, 0.3, 2.4, 0.9)):
        x, y = np.array(seen["track"]).T
        off = np.maximum([x0 - x, y0 - y], [x - x1, y - y1])
        assert np.linalg.norm(np.maximum(off, 0.0), axis=0).min() > 0.2
    assert checker.main([str(tmp_path / "drive.json")]) == 0


def test_the_node_drives_past_who_may_move_and_says_so(graph, tmp_path):
    told(sliding.model(), given=(0, 1)).save(tmp_path / "model.npz")
    # by 3 mm/s: it may go on for all of the deadline, 300 s, before a manoeuvre begins
    movers = ("mover_radius:=0.1", "mover_speed:=0.0003", "episode:=drive.json")
    pilot = node(graph, tmp_path, "model:=model.npz", *movers, *ASKED)
    try:
        world = [sys.executable, str(HELPERS / "ros_world.py"), "seen.json", "1.7", "0.9"]
        done = subprocess.run(world, env=graph, cwd=tmp_path, capture_output=True, text=True)
    finally:
        complained = stopped(pilot)
    assert done.returncode == 0 and pilot.returncode == 0, (done.stderr, complained)
    seen = json.loads((tmp_path / "seen.json").read_text())
    assert seen["arrived"] and not seen["plan"]
    assert "expected a place where nobody moves" in seen["proved"]
    words = "who moves may run into it there"
    assert any(words in said for said in seen["statements"])
    assert checker.main([str(tmp_path / "drive.json")]) == 0


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (("model:=none.npz", *ASKED), "none.npz"),
        (("model:=model.npz", "radius:=0.2"), "given: expected 2 numbers"),
        (("model:=model.npz", *ASKED, "pose_kind:=Pose"), "pose_kind: expected one of Odometry"),
        (("model:=model.npz", *ASKED, "mover_radios:=0.5"), "got mover_radios"),
        (("model:=model.npz", *ASKED, "sensor:=[0.0]"), "sensor: expected shape (3,)"),
        (("model:=model.npz", *ASKED, "sensor:=0.0"), "sensor: expected a list"),
        (("model:=model.npz", *ASKED, "room:=wide"), "room: expected a number"),
        (("model:=model.npz", *ASKED, "tolerance:=-1.0"), "tolerance: expected above 0 m"),
        (("model:=model.npz", *ASKED, "tolerance:=.nan"), "tolerance: expected above 0 m"),
        (("model:=model.npz", *ASKED, "frame:=''"), "frame: expected the name of a frame"),
        (("model:=model.npz", *ASKED, "episode:=model.npz/drive.json"), "cannot be written"),
        (
            ("model:=model.npz", *ASKED, "footprint:='[[1, 1], [1, -1], [-1, 0]]'"),
            "footprint, radius: expected one of them",
        ),
    ],
)
def test_bad_parameters_end_in_one_sentence(graph, tmp_path, asked, words):
    told(sliding.model(), given=(0, 1)).save(tmp_path / "model.npz")
    pilot = node(graph, tmp_path, *asked)
    complained = pilot.communicate()[1]
    ours = [line for line in complained.splitlines() if line.startswith("sims.ros: ")]
    assert pilot.returncode == 2 and len(ours) == 1 and words in ours[0], complained


def test_parameters_are_fixed_and_whole_numbers_are_numbers(graph, tmp_path):
    """One set while the node ran was answered "successful", and changed nothing."""
    told(sliding.model(), given=(0, 1)).save(tmp_path / "model.npz")
    code = """
import rclpy
from rclpy.parameter import Parameter
from sims.ros.node import PilotNode
rclpy.init()
asked = {"model": "model.npz", "radius": 1, "leave": 1, "sensor": [0, 0, 0]}
asked |= {"given": ["twist.twist.linear.x", "twist.twist.linear.y"]}
node = PilotNode(parameter_overrides=[Parameter(x, value=asked[x]) for x in asked])
driving = node.pilot.driving
assert driving.leave == 1.0 and driving.sensor == (0.0, 0.0, 0.0), driving
for name, value in (("radius", 0.6), ("mover_radius", 0.5), ("sensor", [1.0, 0.0, 0.0])):
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert not result.successful and "read-only" in result.reason, result
"""
    done = subprocess.run(
        [sys.executable, "-c", code], env=graph, cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
