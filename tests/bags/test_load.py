"""Runs out of bags: the same from every kind of file, as the drive was, and nothing that cannot be
meant.
"""

import itertools
import logging
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from needs import need
from toy_models import line_model

import parc_jax as pj
from parc_jax.bags import load
from parc_jax.checker.claim import LONGEST
from parc_jax.common import premises
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import derived

need("rosbags")
from bag_files import KINDS, TF, drive, ns, write  # noqa: E402

GRID = pj.learning.time_grid(0.25, 0.75, 0.05)
K = ("linear.x", "angular.z")
HEADED = ("twist.linear.x", "twist.angular.z")  # of commands with headers
COMMANDS = np.array([[0.5, 0.3], [1.0, -0.4], [0.7, 0.0]])
DOMAIN = pj.box([0.2, -1.0], [2.0, 1.0])
ASKED = {"pose": "/odom", "command": "/cmd_vel", "k": K, "domain": DOMAIN}


def bag(folder, kind="mcap", name="run", driven=None, commands=COMMANDS, **how):
    path = folder / (f"{name}.bag" if kind == "ros1" else name)
    return write(path, kind, drive(commands) if driven is None else driven, commands, **how)


def exact(commands, times):
    """Places and turns (n, t, 3) of a unicycle on its arcs, from where it begins."""
    v, w = commands.T[:, :, None]
    turn = w * times
    radius = v / np.where(w == 0, 1, w)
    ahead = np.where(w == 0, v * times, radius * np.sin(turn))
    left = np.where(w == 0, 0 * turn, radius * (1 - np.cos(turn)))
    return np.stack([ahead, left, turn], axis=-1)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("topic", [{}, {"pose": "/tf", "frames": ("odom", "base_link")}])
def test_runs_are_the_drive_from_where_each_begins(tmp_path, kind, topic):
    runs = pj.exchange.load_bags(bag(tmp_path, kind), GRID, **ASKED | topic)
    assert np.array_equal(runs.k, COMMANDS) and not runs.failed.any()
    truth = exact(COMMANDS, GRID.dt_record * np.arange(GRID.n_record + 1))
    # a command is heard up to one pose before it acts: 0.02 s at 1 m/s
    assert np.abs(runs.p - truth[..., :2]).max() < 0.021
    assert np.abs(runs.q[:, 0] - truth[:, -1, 2]).max() < 0.021
    assert runs.rotation == ("turns",) and runs.labels.k == K
    assert len(set(runs.groups)) == 1


@pytest.mark.soundness
def test_runs_that_begin_later_than_their_command_drive_no_loop(tmp_path):
    """A loop drove them as if they began with it: the robot touched in 20 of 20 manoeuvres."""
    path, model = bag(tmp_path), line_model(4, 0.01, rests=True)
    for after in (0.0, 0.2):
        law = pj.exchange.load_bags(path, GRID, **ASKED, after=after).law
        law = replace(model.claim.law, parameters=law.parameters)
        asked = model.replace(claim=derived(model.claim, law=law)), 0.1
        if not after:
            assert pj.drive.Loop(*asked, leave=0.5).under_way is None
            continue
        with pytest.raises(InputError, match=r"begin 0.2 s after a command, .* with after=0"):
            pj.drive.Loop(*asked, leave=0.5)


@pytest.mark.parametrize("split", [False, True])
def test_what_differs_in_commands_and_is_not_in_k_is_told(tmp_path, split):
    """In one file, or from one file to the next."""
    alone = {"k": ("linear.x",), "domain": pj.box([0.2], [2.0])}
    same = COMMANDS * [1.0, 0.0]  # turning does not differ
    if split:
        bag(tmp_path, name="a", commands=same)
        bag(
            tmp_path,
            name="b",
            driven=drive(same, begin=1.71e9),
            commands=same + np.array([0.0, 0.2]),
        )
    path = tmp_path if split else bag(tmp_path)
    runs = pj.exchange.load_bags(path, GRID, **ASKED | alone)
    assert "linear.x; angular.z differed too, and k does not tell it" in runs.law.describe()
    assert "differed too" not in pj.exchange.load_bags(path, GRID, **ASKED).law.describe()


@pytest.mark.parametrize("split", [False, True])
def test_texts_and_what_some_commands_lack_differ_too(tmp_path, split):
    """A mode by its name, an effort that some have, and who sent it; not when it was sent."""
    asked = ASKED | {"k": ("position.0", "position.1")}
    modes = [("robot", "eco", [1.0])] * 4
    assert "differed" not in told_of(tmp_path / "same", asked, modes, modes)
    others = [("robot", "sport", []), ("base", "eco", [1.0])] * 2
    said = told_of(tmp_path / "other", asked, *([modes, others] if split else [others, others]))
    assert "; effort.0, header.frame_id and name.0 differed too, and k does not tell it" in said


@pytest.mark.soundness
def test_given_is_what_the_last_message_said_before_the_run(tmp_path):
    """Between two messages stands what no robot has when it chooses: less noise, a part of what
    came after, and an angle between pi and -pi that is neither. Where it is old there is no run.
    """
    times, poses, speeds, sent = drive(COMMANDS)
    speeds[:, 0] = np.random.default_rng(0).uniform(-3, 3, len(times))
    last = np.searchsorted(times, sent := sent + [0.013, 0.007, 0.0, 0.0] + 1e-6) - 1
    asked = ASKED | {"domain": pj.box([-3, 0.2, -1], [3, 2, 1])}
    asked |= {"given": ("twist.twist.linear.x",), "bridge": 0.1}
    runs = pj.exchange.load_bags(bag(tmp_path, driven=(times, poses, speeds, sent)), GRID, **asked)
    assert np.array_equal(runs.k[:, 0], speeds[last[:3], 0]) and not runs.failed.any()
    heard = (times < sent[1] - 0.2) | (times > sent[1])
    some = times[heard], poses[heard], speeds[heard], sent
    runs = pj.exchange.load_bags(bag(tmp_path, name="gap", driven=some), GRID, **asked)
    assert np.array_equal(runs.k[:, 0], speeds[last[[0, 2]], 0])


@pytest.mark.parametrize("scale", [1.0, 180 / np.pi])
def test_theta_in_degrees_is_refused_unless_somebody_says_rad(tmp_path, monkeypatch, scale):
    """A Pose2D has a theta of any unit; the label of the library itself says nothing of it."""
    read = load.pose_in
    monkeypatch.setattr(load, "pose_in", lambda *of: (*read(*of)[:2], scale * read(*of)[2]))
    path, mine = bag(tmp_path), {"labels": {"q": ("heading [rad]",)}}
    assert pj.exchange.load_bags(path, GRID, **ASKED, **(mine if scale > 1 else {})).n == 3
    if scale > 1:
        with pytest.raises(InputError, match=r"headings in rad.*label its q: 'heading \[rad\]'"):
            pj.exchange.load_bags(path, GRID, **ASKED)


def told_of(folder, asked, *modes):
    """The law of a recording for each list of modes: frame, name and effort of its commands."""
    folder.mkdir()
    for i, some in enumerate(modes):
        driven = drive(COMMANDS, begin=1.7e9 + 1000 * i)
        write(folder / f"run {i}", "mcap", driven, COMMANDS, modes=some)
    return pj.exchange.load_bags(folder, GRID, **asked).law.describe()


def test_what_is_measured_at_the_start_is_given_and_corners_are_points(tmp_path):
    need("shapely")
    robot = pj.problem.read_footprint([[0.2, 0.1], [0.2, -0.1], [-0.2, -0.1], [-0.2, 0.1]])
    given = "twist.twist.linear.x"
    asked = ASKED | {"domain": pj.box([0, 0.2, -1], [2, 2, 1]), "given": (given,), "robot": robot}
    runs = pj.exchange.load_bags(bag(tmp_path), GRID, **asked)
    assert runs.given == (0,) and runs.labels.k == (given, *K)
    assert "given = last twist.twist.linear.x" in runs.law.describe()
    before = np.append(0.0, COMMANDS[:-1, 0])
    assert (np.isclose(runs.k[:, 0], before) | np.isclose(runs.k[:, 0], COMMANDS[:, 0])).all()
    assert runs.points == robot.points and runs.p.shape == (3, GRID.n_record + 1, 10)
    corners = runs.p.reshape(3, -1, 5, 2)
    shape = np.linalg.norm(corners - corners[:, :, :1], axis=-1)
    assert np.abs(shape - np.linalg.norm(robot.places, axis=1)).max() < 1e-9
    assert np.abs(corners[:, 0] - robot.places).max() < 1e-9


def test_a_recording_is_a_group_and_is_never_torn_apart(tmp_path):
    for i in range(4):
        bag(tmp_path, "ros1", f"day {i}", drive(COMMANDS, begin=1_700_000_000.0 + 86_400 * i))
    runs = pj.exchange.load_bags(tmp_path, GRID, **ASKED)
    assert runs.n == 12 and len(set(runs.groups)) == 4
    train, held = runs.split(0.5)
    assert not set(train.groups) & set(held.groups)


def test_files_that_go_on_where_another_ends_are_one_recording(tmp_path):
    """As of a recorder that splits its file: parts of one drive are no independent recordings."""
    times, *rest, sent = drive(COMMANDS)
    lasts = times[-1] - times[0]
    # the third goes on before the end of the second by its stamps; the last is beside the fourth
    begins = [0.0, lasts + 2.0, 2 * lasts + 1.995, 3 * lasts + 60.0, 3.5 * lasts + 60.0]
    for i, later in enumerate(begins):
        bag(tmp_path, "ros1", f"part {i}", (times + later, *rest, sent + later))
    runs = pj.exchange.load_bags(tmp_path, GRID, **ASKED)
    assert runs.n == 15 and len(set(runs.groups)) == 3
    apart = pj.exchange.load_bags(tmp_path, GRID, **ASKED, apart=1.0)
    assert len(set(apart.groups)) == 4  # the second and the third overlap
    assert "joined = to 10 s" in runs.law.describe()


def test_two_recordings_of_one_drive_are_no_two_recordings(tmp_path):
    """On the robot and beside it: each hears the same poses, and the commands a little later."""
    for i in range(3):
        times, poses, speeds, sent = drive(COMMANDS, begin=1_700_000_000.0 + 1000 * i)
        bag(tmp_path, "ros1", f"robot {i}", (times, poses, speeds, sent))
    assert pj.exchange.load_bags(tmp_path, GRID, **ASKED).recordings == 3
    bag(tmp_path, "ros1", "laptop", (times[9:], poses[9:], speeds[9:], sent + 0.004))
    with pytest.raises(InputError, match=r"\d+ poses of it are those of robot 2\.bag, as of two"):
        pj.exchange.load_bags(tmp_path, GRID, **ASKED)
    # another robot beside it, which rested at the same place of its frame before it drove
    poses[30:, :2] += 0.01
    (tmp_path / "laptop.bag").unlink()
    bag(tmp_path, "ros1", "beside", (times, poses, speeds, sent + 0.004))
    assert pj.exchange.load_bags(tmp_path, GRID, **ASKED).recordings == 4


def test_a_file_that_ends_in_a_manoeuvre_begins_no_run(tmp_path):
    """Commands are repeated, and the recorder splits its file in the middle of the second."""
    times, *rest, sent = drive(COMMANDS)
    begins = np.concatenate([np.arange(a, b - 0.01, 0.25) for a, b in itertools.pairwise(sent)])
    repeated = COMMANDS[np.searchsorted(sent, begins + 1e-6) - 1]
    whole = pj.exchange.load_bags(
        bag(tmp_path, "ros1", "whole", (times, *rest, [*begins, sent[-1]]), repeated), GRID, **ASKED
    )
    (tmp_path / "parts").mkdir()
    middle = (sent[1] + sent[2]) / 2
    for i, early in enumerate((True, False)):
        kept, mine = ((x < middle) == early for x in (times, begins))
        stop = [] if early else [sent[-1]]
        part = (times[kept], *(x[kept] for x in rest), [*begins[mine], *stop])
        bag(tmp_path / "parts", "ros1", f"part {i}", part, repeated[mine])
    split = pj.exchange.load_bags(tmp_path / "parts", GRID, **ASKED)
    assert split.n == whole.n == 3 and len(set(split.groups)) == 1 and not split.failed.any()
    np.testing.assert_allclose(split.p, whole.p, atol=1e-12)


def test_a_run_that_tips_over_has_failed_and_one_on_a_ramp_has_not(tmp_path):
    """It drove on, with the yaw of a robot that lies on its back."""
    times = drive(COMMANDS)[0]
    for roll, failed in ((0.5, [False] * 3), (0.55, [False, True, False]), (np.pi, None)):
        lies = np.where((1.9 < times - times[0]) & (times - times[0] < 2.1), roll, 0.0)
        path = bag(tmp_path, name=f"rolled {roll}", rolls=lies)
        runs = pj.exchange.load_bags(path, GRID, **ASKED)
        assert runs.failed.tolist() == (failed or [False, True, False])


def test_a_tilt_fails_the_run_that_it_is_in_wherever_the_records_lie(tmp_path):
    """On its back but beside the records it was a good run; and a tilt before a run failed it."""
    times, grid = drive(COMMANDS)[0], pj.learning.time_grid(0.25, 0.75, 0.25)
    t = np.round(times - times[0], 2)  # a pose in 0.02 s; the second run is from 1.5 to 2.25 s
    upright = (abs((t + 0.125) % 0.25 - 0.125) < 0.025) | (t < 1.5) | (t > 2.25)
    cases = [(~upright, True), (t == 1.48, False), (t == 1.5, True), (t == 1.6, True)]
    cases += [((t > 1.27) & (t < 1.49), False), (t == 2.24, True), (t == 2.3, False)]
    for i, (lies, failed) in enumerate(cases):
        path = bag(tmp_path, name=f"tilted {i}", rolls=np.where(lies, np.pi / 2, 0.0))
        runs = pj.exchange.load_bags(path, grid, **ASKED)
        assert runs.failed.tolist() == [False, failed, False], i


def test_a_run_cut_short_has_failed_unless_it_is_dropped(tmp_path, caplog):
    commands = np.array([[0.5, 0.3], [1.0, -0.4]])
    long = pj.learning.time_grid(0.25, 1.25, 0.05)
    driven = list(drive(commands, every=2.0))
    driven[3] = driven[3] + [0.0, -1.0, 0.0]  # the second comes a second early
    path = bag(tmp_path, driven=driven, commands=commands)
    with caplog.at_level(logging.INFO, logger="parc_jax"):
        runs = pj.exchange.load_bags(path, long, **ASKED)
    assert runs.failed.tolist() == [True, False]
    assert np.isfinite(runs.p[0, :20]).all() and np.isnan(runs.p[0, 21:]).all()
    assert "3 commands: 0 without what is given, 1 outside of K, 1 cut short" in caplog.text
    dropped = pj.exchange.load_bags(path, long, **ASKED, short="dropped")
    assert np.array_equal(dropped.k, commands[1:]) and not dropped.failed.any()
    for one, word in ((runs, "failed, joined"), (dropped, "dropped, dropped = 1 left out, joined")):
        said = one.law.describe()
        assert f"command = /cmd_vel, {', '.join(K)}, cut short = {word}" in said
        assert "clock = header" in said and "pose = /odom, odom -> base_link" in said
        assert "records = straight up to 0.1 s" in said


def test_a_claim_is_about_commands_in_a_declared_K_and_counts_the_others(tmp_path):
    """Each recording ends with a command to stop; where K is all that was sent nothing is said."""
    rng, wide = np.random.default_rng(0), pj.box([-9, -9], [9, 9])
    for i in range(12):
        sent = COMMANDS + 0.01 * rng.normal(size=COMMANDS.shape)
        driven = drive(sent, begin=1_700_000_000.0 + 100 * i)
        bag(tmp_path, "ros1", f"{i:02}", driven, sent)
    for K_asked, words in ((ASKED["domain"], True), (wide, False)):
        asked = ASKED | {"domain": K_asked}
        train, held = pj.exchange.load_bags(tmp_path, GRID, **asked).split(0.5)
        net = pj.learning.relu_network([np.zeros((2 * GRID.n_steps + 1, 2))], [np.zeros(7)])
        claim = pj.learning.bound_error(net, held, None, train=train, bins=(1, 1), quiet=True)
        said = claim.details()
        assert ("any run of a new recording whose k lies in K, drawn from" in said) == words
        assert ("K = as declared, which 12 of 48 commands miss" in said) == words


def test_no_run_goes_over_a_gap_between_poses(tmp_path):
    times, *rest, sent = drive(COMMANDS)
    kept = ~((times > sent[1] + 0.2) & (times < sent[1] + 0.4))
    driven = (times[kept], *(part[kept] for part in rest), sent)
    path = bag(tmp_path, driven=driven)
    assert pj.exchange.load_bags(path, GRID, **ASKED).failed.tolist() == [False, True, False]
    assert not pj.exchange.load_bags(path, GRID, **ASKED, bridge=0.3).failed.any()


def test_the_same_command_after_a_pause_is_another_run(tmp_path):
    commands = np.array([[0.5, 0.3], [0.5, 0.3]])
    driven = list(drive(commands, every=1.0))
    path = bag(tmp_path, driven=driven, commands=commands)
    assert pj.exchange.load_bags(path, GRID, **ASKED).n == 2
    repeated = np.repeat(commands[:1], 8, axis=0)
    driven = drive(repeated, every=0.25)
    assert (
        pj.exchange.load_bags(
            bag(tmp_path, name="r", driven=driven, commands=repeated), GRID, **ASKED
        ).n
        == 1
    )


def backwards(folder):
    times = drive(COMMANDS)[0].copy()
    times[70] = times[60]
    return bag(folder, stamps=times), {}, "/odom: expected stamps that increase; message 70"


def two_clocks(folder):
    times = drive(COMMANDS)[0]
    return bag(folder, stamps=times - 1.6e9), {}, "are 1.6e\\+09 s apart"


def frames_between(folder):
    bag(folder, "ros1", "a")
    bag(folder, "ros1", "b", frames=("map", "base_link"))
    return folder, {}, "one frame; got odom -> base_link in a.bag, map -> base_link in b.bag"


def cut_off(folder):
    path = next(bag(folder).glob("*.mcap"))
    path.write_bytes(path.read_bytes()[:-2000])
    return path, {}, "expected a complete bag.*`mcap recover`"


def cut_off_ros1(folder):
    path = bag(folder, "ros1")
    path.write_bytes(path.read_bytes()[:-2000])
    return path, {}, "expected a complete bag.*`mcap recover`"


def fewer_than_indexed(folder):
    path = bag(folder, "mcap")
    meta = path / "metadata.yaml"
    meta.write_text(meta.read_text().replace("message_count: 4", "message_count: 9"))
    return path, {}, "expected 9 messages of /cmd_vel, as its index says; read 4"


ASKED_OF_ONE = {  # of a bag that is good: what is asked for, what is said
    "another frame": ({"frames": ("map", "base_link")}, "expected map -> base_link; it has odom"),
    "no such edge": (
        {"pose": "/tf", "frames": ("map", "base_link")},
        "which are not composed: odom -> base_link; got map -> base_link",
    ),
    "no topic": (
        {"pose": "/pose"},
        "expected a topic /pose; it has /cmd_vel \\(geometry_msgs/msg/Twist\\), /odom",
    ),
    "no field": ({"k": ("linear.x", "speed")}, "no 'speed' there, but linear, angular"),
    "no number": ({"k": ("linear",)}, "expected a number at linear; got x, y, z"),
    "no poses": ({"pose": "/cmd_vel"}, "/cmd_vel: expected poses"),
    "too long": ({"time": pj.learning.time_grid(1.0, 5.0)}, "Try a shorter t_f"),
    "another K": ({"domain": pj.box([0], [1])}, "expected a domain of 2 parameters"),
    "uniform by word": ({"k_law": "uniform", "domain": None}, "expected k_law"),
    "no time apart": ({"apart": float("nan")}, "apart: expected finite"),
    "earlier apart": ({"apart": -5.0}, "apart: expected a number >= 0; got -5"),
    "no bridge": ({"bridge": float("nan")}, "bridge: expected finite"),
    "a bridge in words": ({"bridge": "x"}, "bridge: expected numbers"),
    "one number": ({"k": 3}, "k: expected paths of numbers"),
    "no grid": ({"time": None}, "time: expected TimeGrid"),
    "a word": ({"short": "fine"}, "short: expected one of failed, dropped"),
    "a clock": ({"clock": "wall"}, "clock: expected one of header, recorder"),
}
FILES = {
    "backwards": backwards,
    "two clocks": two_clocks,
    "frames between": frames_between,
    "cut off": cut_off,
    "cut off, ROS 1": cut_off_ros1,
    "fewer than indexed": fewer_than_indexed,
    "no turn": lambda folder: (bag(folder, unit=0.0), {}, "quaternions; got \\(0, 0, 0, 0\\)"),
    "a camera's frame": lambda folder: (
        bag(folder, rolls=np.full(201, -np.pi / 2)),
        {},
        "3 with gaps between poses, or tilted beyond 30 degrees",
    ),
    "nothing there": lambda folder: (folder / "none.mcap", {}, "no such file"),
    "an empty folder": lambda folder: (folder, {}, "or a folder of bags; there is none"),
}


@pytest.mark.parametrize("name", [*FILES, *ASKED_OF_ONE])
def test_what_cannot_be_meant_is_refused_in_one_sentence(tmp_path, name):
    if name in FILES:
        path, asked, words = FILES[name](tmp_path)
    else:
        path, (asked, words) = bag(tmp_path), ASKED_OF_ONE[name]
    asked = {"time": GRID} | ASKED | asked
    with pytest.raises(InputError, match=words) as why:
        pj.exchange.load_bags(path, **asked)
    assert "\n" not in str(why.value) and str(why.value)[-1] in ".?"


def test_the_recorders_clock_needs_no_headers(tmp_path):
    times = drive(COMMANDS)[0]
    path = bag(tmp_path, stamps=0 * times)
    with pytest.raises(InputError, match='take clock="recorder"'):
        pj.exchange.load_bags(path, GRID, **ASKED)
    assert not pj.exchange.load_bags(path, GRID, **ASKED, clock="recorder").failed.any()


def test_commands_without_headers_are_told_to_be_on_the_recorders_clock(tmp_path):
    """Poses 0.8 s off were taken for those of the commands' times, in the same words."""
    times, clocks = drive(COMMANDS)[0], {}
    for off, clock in ((0.05, "header"), (0.8, "header"), (0.8, "recorder")):
        path = bag(tmp_path, name=f"{off} {clock}", stamps=times - off)
        if (off, clock) == (0.8, "header"):
            with pytest.raises(
                InputError, match=r"within 0\.1 s of one clock; .* are 0\.8 s apart"
            ):
                pj.exchange.load_bags(path, GRID, **ASKED, clock=clock)
            continue
        said = pj.exchange.load_bags(path, GRID, **ASKED, clock=clock).law.describe()
        clocks[clock] = said.partition("clock = ")[2].partition(", joined = ")[0]
    mixed = "header, of /cmd_vel the recorder's, clocks = up to 0.05"
    assert clocks["recorder"].startswith("recorder, command = ")
    assert clocks["header"].startswith(mixed)


def test_how_far_two_clocks_of_headers_are_apart_is_told_and_parts_no_logs(tmp_path):
    """0.9 s off were as good as none; those of one robot that differ by little are of one law."""
    laws = []
    for off, told in ((0.895, 0.9), (0.0115, 0.012)):
        driven, path = drive(COMMANDS), tmp_path / f"off {off}"
        write(path, "mcap", driven, COMMANDS, stamps=driven[0] - off, heads=True)
        laws.append(pj.exchange.load_bags(path, GRID, **ASKED | {"k": HEADED}).law)
        apart = f"clock = header, clocks = up to {told} s apart in the median, command = "
        assert apart in laws[-1].describe()
    premises.agree("two logs", laws[0].cut, laws[1].cut)


def heard_beside(arm, late):
    """Of /tf: the edge of the robot, stamped late by [s], beside an arm's in time ("twice", each in
    a message of its own), or in one message behind another's with stamp 0 ("behind").
    """

    def messages(says, t, pose):
        edge = says.transforms(ns(t - late), pose, ("odom", "base_link"))
        other = says.transforms(0 if arm == "behind" else ns(t), (0, 0, 0), ("base_link", "arm"))
        if arm == "twice":
            return [other, edge, other]
        return [says.make(TF, transforms=[*other.transforms, *edge.transforms])]

    return messages


TF_EDGE = {"pose": "/tf", "frames": ("odom", "base_link")}


def test_how_far_clocks_are_apart_is_told_of_the_edge_of_the_robot(tmp_path):
    """It was that of the first transform of each message, of whatever edge."""
    for arm, late, told in (("twice", 0.595, "0.6"), ("behind", 0.0115, "0.012")):
        path, tf = tmp_path / arm, heard_beside(arm, late)
        write(path, "mcap", drive(COMMANDS), COMMANDS, heads=True, tf=tf)
        runs = pj.exchange.load_bags(path, GRID, **ASKED | TF_EDGE | {"k": HEADED})
        assert f"clocks = up to {told} s apart in the median" in runs.law.describe()
    path = bag(tmp_path, tf=heard_beside("twice", 0.6))
    with pytest.raises(InputError, match=r"within 0\.1 s of one clock; .* are 0\.6 s apart"):
        pj.exchange.load_bags(path, GRID, **ASKED | TF_EDGE)


@pytest.mark.parametrize("heads", [True, False])
def test_two_recorders_of_one_drive_are_seen_by_the_clock_of_each(tmp_path, heads):
    """Later by a few milliseconds, each message by others; headers tell it hours later, too."""
    times, poses, speeds, sent = drive(COMMANDS)
    late = np.random.default_rng(0).uniform(0.004, 0.01, len(times))
    stamps = times if heads else 0 * times
    write(tmp_path / "robot", "mcap", (times, poses, speeds, sent), COMMANDS, stamps=stamps)
    for hours in (0, 3)[: 1 + heads]:
        off = 3600 * hours
        heard = (times + late + off, poses, speeds, sent + 0.004 + off)
        path = write(tmp_path / "laptop", "mcap", heard, COMMANDS, stamps=stamps)
        with pytest.raises(InputError, match=r"poses of it are those of"):
            pj.exchange.load_bags(tmp_path, GRID, **ASKED, clock="recorder")
        shutil.rmtree(path)
    later = [x + 3600 for x in (times, sent)]  # the same drive again is another
    again = (later[0], poses, speeds, later[1])
    write(tmp_path / "again", "mcap", again, COMMANDS, stamps=later[0] if heads else stamps)
    assert pj.exchange.load_bags(tmp_path, GRID, **ASKED, clock="recorder").recordings == 2


IN_FOLDERS = ["day 2/run.bag", "run/a_0.db3"]
NOT_CLOSED = ["run.bag.active", "run.bag.part", "run.db3-wal", "run.BAG"]
PACKED = ["run.mcap.zst", "run.bag.tar.gz", "runs.zip", "runs.tgz", "runs.tar.xz"]
PACKED += [f"run.{of}" for of in "tzst tlz zipx gz bz2 xz zst lz4 cab".split()]
COPIES = [
    "run.bag.1",
    "run.bag~",
    "run.bag.bak",
    "run.bag_old",
    "run.mcap2",
    "run.bagA",
    "run.BAGS",
    "run.bagold",
    "run.bag.failed",
    "run.bag.gpg",
    "run.rosbag",
    "run.7zip",
]
ENDS = "txt md py png pdf html svg JPG mp4 npz ipynb md5 sha256 xml docx orig.active".split()


@pytest.mark.parametrize("name", [*IN_FOLDERS, *NOT_CLOSED, *PACKED, *COPIES])
def test_a_recording_in_the_folder_that_is_not_read_is_refused(tmp_path, name):
    bag(tmp_path, "mcap", "good")
    # notes, exports and pictures, what `rosbag reindex` leaves, and what is hidden
    hidden = ("._good.mcap", "._run.bag", ".trash/run.bag")
    ends = (f"run.bag.{end}" for end in ENDS)
    for other in (*ends, "run.mcap.v2.yaml", "bag.py", "a.target", *hidden):
        (tmp_path / other).parent.mkdir(exist_ok=True)
        (tmp_path / other).touch()
    assert pj.exchange.load_bags(tmp_path, GRID, **ASKED).recordings == 1
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).touch()
    with pytest.raises(InputError, match=f"in no sub-folder; got {re.escape(name)}\\. Try") as why:
        pj.exchange.load_bags(tmp_path, GRID, **ASKED)
    assert "\n" not in str(why.value) and str(why.value)[-1] == "."


@pytest.mark.parametrize("name", ["good_1.mcap", "ood.mcap", "failed/a_0.db3"])
def test_a_recording_inside_of_a_bag_that_is_not_of_it_is_refused(tmp_path, name):
    folder = tmp_path / "bags"
    folder.mkdir()
    path = bag(folder, "mcap", "good")
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked/day").symlink_to(path)
    (path / name).parent.mkdir(exist_ok=True)
    (path / name).touch()
    for asked in (folder, path, tmp_path / "linked"):
        with pytest.raises(InputError, match=f"in no sub-folder; got .*{name}"):
            pj.exchange.load_bags(asked, GRID, **ASKED)


def test_recordings_that_are_linked_have_the_names_of_their_links(tmp_path):
    bags = tmp_path / "bags"
    bags.mkdir()
    for i in range(2):
        driven = drive(COMMANDS, begin=1.7e9 + 1e5 * i)
        (bags / f"day{i}.mcap").symlink_to(bag(tmp_path / f"{i}", "mcap", "run", driven))
    assert pj.exchange.load_bags(bags, GRID, **ASKED).recordings == 2


@pytest.mark.parametrize("name", ["failed.bag", "deep/failed.bag", None])
def test_bags_behind_a_linked_folder_are_refused_as_in_a_real_one(tmp_path, name):
    bags, disk = tmp_path / "bags", tmp_path / "disk"
    for folder in (bags, disk / "deep"):
        folder.mkdir(parents=True)
    bag(bags, "ros1", "good")
    (bags / "day 2").symlink_to(disk)
    (disk / "loop").symlink_to(bags)
    (disk / "notes.txt").touch()
    assert pj.exchange.load_bags(bags, GRID, **ASKED).recordings == 1
    where = f"day 2/{name}" if name else "day 2"
    if name:
        (disk / name).touch()
    else:  # a disk that is not there may hold any
        shutil.rmtree(disk)
    with pytest.raises(InputError, match=f"in no sub-folder; got {where}\\. Try"):
        pj.exchange.load_bags(bags, GRID, **ASKED)


def test_a_bag_with_damaged_metadata_is_refused_in_a_sentence(tmp_path):
    meta = bag(tmp_path) / "metadata.yaml"
    key = "rosbag2_bagfile_information:"
    first = next(meta.parent.glob("*.mcap"))
    first.rename(meta.parent / "run_0.mcap")  # as the recorder of ROS 2 names it
    for text in (
        f"{key} {{", "", "\n", f"{key}\n  relative_file_paths:\n", "\0" * 99, "version: 5\n"
    ):  # fmt: skip
        meta.write_text(text)
        for asked in (tmp_path, meta.parent):  # asked for itself it was read file by file
            with pytest.raises(InputError, match="run: expected a complete bag") as why:
                pj.exchange.load_bags(asked, GRID, **ASKED)
            assert "\n" not in str(why.value) and str(why.value)[-1] == "."


def test_metadata_of_something_else_makes_no_folder_a_bag(tmp_path):
    """A folder of good bags was refused with a KeyError."""
    path = bag(tmp_path, "mcap", "good")
    (tmp_path / "config").mkdir()
    for folder in (tmp_path, tmp_path / "config"):
        (folder / "metadata.yaml").write_text("license: !own MIT\n")
    for asked in (tmp_path, path):
        assert pj.exchange.load_bags(asked, GRID, **ASKED).recordings == 1
    (tmp_path / "config/run.mcap").touch()
    with pytest.raises(InputError, match=r"in no sub-folder; got config/run\.mcap\. Try"):
        pj.exchange.load_bags(tmp_path, GRID, **ASKED)


def test_labels_swap_no_two_numbers_of_a_command(tmp_path):
    own = {"k": ("speed [m/s]", "angular.z [rad/s]")}
    path = bag(tmp_path)
    assert pj.exchange.load_bags(path, GRID, **ASKED, labels=own).labels.k == own["k"]
    for words in (K[::-1], ("angular.z [rad/s]", "speed [m/s]")):
        with pytest.raises(InputError, match=r"'linear\.x', in its unit and with no other's name"):
            pj.exchange.load_bags(path, GRID, **ASKED, labels={"k": words})
    given = "twist.twist.linear.x"
    asked = ASKED | {"domain": pj.box([0, 0.2, -1], [2, 2, 1]), "given": (given,)}
    with pytest.raises(InputError, match=f"column '{given}', in its unit and with no other's name"):
        pj.exchange.load_bags(path, GRID, **asked, labels={"k": (K[0], given, K[1])})


def test_another_footprint_or_another_corner_0_is_another_law(tmp_path):
    need("shapely")
    corners, path = np.array([[0.2, 0.1], [0.2, -0.1], [-0.2, -0.1], [-0.2, 0.1]]), bag(tmp_path)
    robots = (corners, np.roll(corners, 1, axis=0), 3 * corners)
    own, *others = (
        pj.exchange.load_bags(path, GRID, **ASKED, robot=pj.problem.read_footprint(x)).law
        for x in robots
    )
    assert f"robot = corners from 0: {corners.tolist()} m" in own.describe()
    for other in others:
        with pytest.raises(InputError, match=r"robot is corners from 0: .*, beside corners from 0"):
            premises.agree("two logs", own.cut, other.cut)


def test_the_folder_that_one_stands_in_has_its_name(tmp_path, monkeypatch):
    path = bag(tmp_path, name="monday")
    monkeypatch.chdir(path)
    runs = pj.exchange.load_bags(".", GRID, **ASKED)
    assert runs.law.generator == "file:monday"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p").mkdir()
    np.savetxt("k.csv", runs.k, delimiter=",")
    for i, p in enumerate(runs.p):
        np.savetxt(f"p/{i}.csv", p, delimiter=",")
    assert pj.load_rollouts(".", GRID).law.generator == f"file:{tmp_path.name}"


def test_the_law_of_bags_is_told_whole_by_explain(tmp_path):
    """Of topics with names of usual length."""
    asked = ASKED | {"domain": pj.box([0, 0.2, -1], [2, 2, 1]), "given": ("twist.twist.linear.x",)}
    law = pj.exchange.load_bags(bag(tmp_path), GRID, **asked).law.describe()
    assert len(f"any run of a new recording whose k lies in K, drawn from {law}") <= LONGEST


def test_records_between_poses_bear_no_bound_on_motion(tmp_path):
    """A robot that sways in step with its poses leaves every tube that a bound of its speed, paid
    for the time between records, makes: the records are none of its places.
    """
    for i in range(40):
        bag(tmp_path, name=f"run{i}", commands=(1 - 0.005 * i) * COMMANDS)
    train, held = pj.exchange.load_bags(tmp_path, GRID, **ASKED).split(0.5)
    net = pj.learning.relu_network([np.zeros((7, 2))], [np.zeros(7)])
    ask = {"eps": 0.2, "delta": 0.1, "train": train, "bins": (1, 1), "quiet": True}
    assert pj.learning.bound_error(net, held, None, **ask).eps is not None
    with pytest.raises(InputError, match="expected records of where it was, for a bound"):
        pj.learning.bound_error(net, held, None, intersample=pj.types.SpeedBound(3.0), **ask)
