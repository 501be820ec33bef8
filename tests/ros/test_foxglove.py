"""Answers and episodes as MCAP: a second library reads back what was proved, where it lies."""

import json
from dataclasses import replace

import jax
import numpy as np
import pytest
import toy_query
import tyro
from covered import covered
from episodes import driven
from needs import need
from toy_models import line_model, told

import parc_jax as pj
from parc_jax.answer.path import nominal_path
from parc_jax.app.plot.shapes import corners_of
from parc_jax.common.errors import InputError
from parc_jax.learning.system import TURNS
from parc_jax.problem.robust.nominal import query
from sims.ros.foxglove import main, write_mcap
from sims.ros.way import drawn_of, model_of, predicted, way_of

need("rosbags", "mcap_ros2")
from mcap.reader import make_reader  # noqa: E402
from mcap_ros2.decoder import DecoderFactory  # noqa: E402

TOPICS = {
    "/plan": "nav_msgs/msg/Path",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/body": "visualization_msgs/msg/MarkerArray",
    "/tube": "visualization_msgs/msg/MarkerArray",
    "/obstacles": "visualization_msgs/msg/MarkerArray",
    "/statement": "std_msgs/msg/String",
}


def read(path):
    """What the second library reads: by topic (time [ns], message), in the order of the file."""
    out, kinds = {}, {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, line, message in reader.iter_decoded_messages():
            out.setdefault(channel.topic, []).append((line.log_time, message))
            kinds[channel.topic] = schema.name
    assert kinds.items() >= TOPICS.items()
    return out


def places(path):
    return np.array([[p.pose.position.x, p.pose.position.y] for p in path.poses])


def stamps(path):
    """[ns]"""
    return [p.header.stamp.sec * 10**9 + p.header.stamp.nanosec for p in path.poses]


def triangles(markers):
    """(t, 3, 2) of the one marker that is added after all others were taken away."""
    assert markers.markers[0].action == 3 and len(markers.markers) <= 2
    points = [(p.x, p.y) for one in markers.markers[1:] for p in one.points]
    return np.array(points).reshape(-1, 3, 2)


def area(shapes):
    a, b = shapes[:, 1] - shapes[:, 0], shapes[:, 2] - shapes[:, 0]
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2


def test_an_answer_is_read_back_by_another_library(tmp_path):
    answer, rng = toy_query.answer(), np.random.default_rng(0)
    said = read(write_mcap(tmp_path / "a.mcap", answer, plan=1, begin=5.0, frame="hall"))
    at, path = said["/plan"][0]
    plan = answer.samples[1]
    told = nominal_path(answer.model, plan[:2], plan[2:])
    assert at == 5 * 10**9 and path.header.frame_id == "hall"
    assert np.array_equal(places(path), told.places[:, 0])
    assert np.allclose(np.array(stamps(path)) / 1e9, 5 + told.times)
    moved = [message.transforms[0] for _, message in said["/tf"]]
    ways = np.array([[t.transform.translation.x, t.transform.translation.y] for t in moved])
    assert np.array_equal(ways, told.places[:, 0]) and moved[0].child_frame_id == "base_link"
    assert said["/statement"][0][1].data == answer.details()
    assert len(said["/plans"][0][1].markers[1].points) == 2 * 4 * len(answer.samples)
    # the obstacle is there from interval 1 to 3, and is what it is
    shown = [(at, triangles(m)) for at, m in said["/obstacles"]]
    assert [at for at, _ in shown] == [5 * 10**9, 5 * 10**9 + 250_000_000]
    assert len(shown[0][1]) == 0 and area(shown[1][1]) == pytest.approx(0.5 * 0.3)
    corners = corners_of(answer.problem.obstacles[0])
    assert covered(corners, shown[1][1]).all()
    assert area(triangles(said["/goal"][0][1])) == pytest.approx(0.25)
    # runs inside the tube stay in what is drawn of it, body and all
    tube = triangles(said["/tube"][0][1])
    for t, half in enumerate(told.tube[:, 0]):
        share, angle = rng.random((50, 1)), rng.uniform(0, 2 * np.pi, 50)
        way = (1 - share) * told.places[t, 0] + share * told.places[t + 1, 0]
        error = rng.uniform(-half, half, (50, 2))
        rim = 0.1 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        assert covered(way + error + rim, tube).all()
    assert len(said["/body"]) == len(path.poses)
    assert area(triangles(said["/body"][0][1])) == pytest.approx(np.pi * 0.01, rel=0.01)


@pytest.mark.parametrize("turning", [pytest.param(False, marks=pytest.mark.slow), True])
def test_an_episode_is_driven_as_it_was_committed_to(tmp_path, turning):
    done = driven(turning)
    file = pj.drive.save_episode(tmp_path / "drive.json", done)
    said = read(write_mcap(tmp_path / "e.mcap", file))
    paths = said["/plan"]
    assert [at for at, _ in paths] == [round(one.begin * 10**9) for one in done]
    for (_, path), one in zip(paths, done, strict=True):
        pose = one.asked.pose
        assert np.allclose(places(path)[0], pose.place, atol=1e-12)
        if turning:
            first = path.poses[0].pose.orientation
            turned = pose.heading - 2 * np.arctan2(first.z, first.w)
            assert np.cos(turned) == pytest.approx(1.0)
    # each was left half way, where the next one begins
    ends = [places(path)[2] for _, path in paths[:-1]]
    assert np.allclose(ends, [one.asked.pose.place for one in done[1:]], atol=1e-9)
    times = [at for at, _ in said["/tf"]]
    assert times == sorted(set(times)) and times[-1] == round(done[-1].end * 10**9)
    # frames end where the next one begins, whenever the loop's clock begins
    late = read(write_mcap(tmp_path / "l.mcap", [replace(x, begin=x.begin + 5) for x in done]))
    for all_of, first in ((said, 0), (late, 5 * 10**9)):
        begins = [at for at, _ in all_of["/plan"]]
        assert begins[0] == first and len(begins) == len(done) > 2
        knots = [stamps(path) for _, path in all_of["/plan"]]
        ends = [*begins[1:], np.inf]
        shown = [at for one, end in zip(knots, ends, strict=True) for at in one if at < end]
        assert [[at for at, _ in all_of[topic]] for topic in ("/tf", "/body")] == [shown] * 2
    again = read(write_mcap(tmp_path / "again.mcap", done))
    assert again["/statement"][0][1].data == said["/statement"][0][1].data
    assert (tmp_path / "e.mcap").read_bytes() == (tmp_path / "again.mcap").read_bytes()


def test_a_path_is_the_robots_own_prediction_and_begins_by_the_clock_of_its_loop(tmp_path):
    """Of a heading that is off the first way that stands for it was called the prediction."""
    model = told(line_model(4, 0.01, rests=True), rotation=(TURNS,))
    loop = pj.drive.Loop(
        model,
        0.05,
        leave=0.5,
        uncertainty=pj.Uncertainty(heading=0.1),
        effort=pj.drive.Effort(64, deadline=300.0),
    )
    one = loop.step([0.0, 0.0, 0.0], [], [], lambda seen: -seen.path[:, -1, 0], at=5.0).committed
    _, way, _ = way_of(predicted(one.asked, one.asked.at, one.k), one.asked.pose)
    assert np.allclose(way[-1, :2], one.k, atol=1e-9)
    said = read(write_mcap(tmp_path / "e.mcap", [one], begin=100.0))
    assert said["/plan"][0][0] == 105 * 10**9
    assert "\nDrawn: one possible run of the model" in said["/statement"][0][1].data
    assert not np.allclose(places(said["/plan"][0][1])[-1][:2], one.k, atol=1e-3)
    goal, known = pj.box([-5.0] * 3, [5.0] * 3), pj.Uncertainty(heading=0.1)
    asked, soon = pj.reach_avoid(goal, [], 0.05, uncertainty=known), pj.types.FirstProved()
    settings = pj.Settings(samples=1, method=soon)
    answer = pj.Planner(model).solve(asked, jax.random.key(0), settings, at=[0.0, 0.0, 0.0])
    told_of = read(write_mcap(tmp_path / "a.mcap", answer))["/statement"][0][1].data
    drawn = "\nDrawn: one possible run of the model, of those that are uncertain."
    assert told_of == answer.details() + drawn


@pytest.mark.slow  # compiles for itself
def test_where_plans_choose_not_all_of_k_one_possible_run_is_shown_and_said():
    """The robot's own model knows no path of such a plan."""
    model, goal = line_model(4, 0.01, rests=True), pj.box([-5.0] * 3, [5.0] * 3)
    for known, own in (({"unknown": {1: (0.1, 0.25)}}, False), ({"k": {1: 0.05}}, True)):
        asked = pj.reach_avoid(goal, [], 0.05, uncertainty=pj.Uncertainty(**known))
        asked = query(asked, model).nominal()
        n_k = asked.model.n_k
        end = predicted(asked, np.zeros(2), np.full(n_k, 0.5)).places[-1, 0]
        assert (n_k == 2) == own and end[0] == pytest.approx(0.5)
        assert (end[1] == 0.5) if own else (0.1 <= end[1] <= 0.25)
        assert ("one possible run" in drawn_of(model_of(asked))) == (not own)


def test_a_map_is_written_with_its_origin(tmp_path):
    free = np.array([[True, False, True], [False, False, True]])
    grid = pj.problem.GridMap(free, 0.05, (-1.0, 2.0, 0.5))
    said = read(write_mcap(tmp_path / "a.mcap", toy_query.answer(), grid=grid))
    told = said["/map"][0][1]
    assert (told.info.width, told.info.height) == (3, 2) and told.info.resolution == np.float32(
        0.05
    )
    assert list(told.data) == [0, 100, 0, 100, 100, 0]
    turn = told.info.origin.orientation
    assert 2 * np.arctan2(turn.z, turn.w) == pytest.approx(0.5)
    cells = pj.problem.occupancy_grid(np.array(told.data).reshape(2, 3), 0.05, (-1.0, 2.0, 0.5))
    assert np.array_equal(cells.free, free)


def test_rosbags_reads_it_too_and_it_may_be_recorded_runs(tmp_path):
    from parc_jax.bags.recording import heard

    path = write_mcap(tmp_path / "a.mcap", toy_query.answer())
    assert len(heard(path, ["/tf"])["/tf"]) == 5


def test_what_is_not_safe_is_not_written(tmp_path):
    answer, where = toy_query.answer(), tmp_path / "a.mcap"
    with pytest.raises(InputError, match="expected a safe plan"):
        write_mcap(where, answer, plan=answer.samples[0] + [9.0, 0.0, 0.0, 0.0])
    with pytest.raises(InputError, match="number of a sample, 0 to 4; got 5"):
        write_mcap(where, answer, plan=5)
    with pytest.raises(InputError, match=r"ends in \.mcap"):
        write_mcap(tmp_path / "a.bag", answer)
    one = driven(False, 1)[0]
    for begin in (-1.0, np.nan, 2.0**31, 2.0**31 - one.end / 2):  # the last one: its plan ends late
        with pytest.raises(InputError, match="expected stamps from 0 to below"):
            write_mcap(where, [one], begin=float(begin))
    early = replace(one, begin=one.begin - 5)  # a clock may begin anywhere
    with pytest.raises(InputError, match="the loop's clock from begin on; got -5"):
        write_mcap(where, [early])
    assert list(tmp_path.iterdir()) == []
    assert "/plan" not in read_topics(write_mcap(where, answer, plan=None))


def read_topics(path):
    with open(path, "rb") as file:
        return {channel.topic for _, channel, _ in make_reader(file).iter_messages()}


def test_the_command_writes_both_and_refuses_in_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    file = pj.drive.save_episode("drive.json", driven(False))
    toy_query.answer().save("answer.json")

    def run(*options):
        return tyro.cli(main, args=options), *capsys.readouterr()

    assert run("drive.json", "e.mcap")[0] == 0 and "/plan" in read_topics("e.mcap")
    assert run("answer.json", "a.mcap", "--sample", "2")[0] == 0
    assert "/plans" in read_topics("a.mcap")
    before = sorted(tmp_path.iterdir())
    harmed = json.loads(file.read_text())
    harmed["manoeuvres"][2]["begin"] = "0"
    file.write_text(json.dumps(harmed))
    for options, why in (
        (("drive.json", "b.mcap"), "expected an episode"),
        (("answer.json", "b.mcap", "--sample", "9"), "expected the number of a sample"),
        (("answer.json", "b.txt"), "ends in .mcap"),
        (("answer.json", "a.mcap/b.mcap"), "is a file and no folder"),
        (("answer.json", "b.mcap", "--map", "none.yaml"), "none.yaml"),
        (("none.json", "b.mcap"), "no such file"),
    ):
        code, said, complained = run(*options)
        assert code == 2 and said == "" and why in complained, complained
        assert complained.startswith("sims.ros.foxglove: ") and complained.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before
