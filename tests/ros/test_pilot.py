"""A pilot that is told messages: it drives to its goal through proved manoeuvres, and what it is
told wrongly changes nothing.
"""

import functools
import json
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace as Some

import numpy as np
import pytest
import sliding
from needs import need
from toy_models import told

import parc_jax as pj
from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from parc_jax.checker.claim import OURS
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.episode_file import episode_part
from parc_jax.drive.loop.loop import Loop
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.labels import Labels
from sims.driving import Driving
from sims.guide import Guide, along_ways
from sims.pilot import Pilot
from sims.ros.measured import map_in, seen_in

need("shapely")
GIVEN = ("twist.twist.linear.x", "twist.twist.linear.y")
POSTS = [(1.0, -0.4, 1.2, 0.3), (2.2, 0.3, 2.4, 0.9)]
CYCLE = 400_000_000  # [ns] after which a manoeuvre may be left


@functools.cache
def model():
    """The platform's, which says that its velocity at the start is measured."""
    return told(sliding.model(), given=(0, 1))


def pilot(radius=0.2, **driving):
    asked = {"leave": 0.4, "given": GIVEN, "deadline": 300.0, "arrived": 0.4} | driving
    return Pilot(model(), radius, Driving(**asked))


def test_it_drives_to_its_goal_and_every_manoeuvre_is_proved():
    one = pilot()
    place, speed, at = np.zeros(2), np.zeros(2), 5 * 10**9
    said = one.hear_pose(sliding.odometry(place, speed, at))
    assert said is None  # no goal yet
    one.hear_goal(sliding.posed(3.2, 0.3))
    step = one.hear_pose(sliding.odometry(place, speed, at + 1))
    assert step.committed is None and "no map yet" in step.reason
    one.hear_map(sliding.map_of(sliding.hall(POSTS)))
    begun, knots = place, 0
    for _ in range(40):
        at += CYCLE
        step = one.hear_pose(sliding.odometry(place, speed, at))
        if step is None:
            break
        begun, knots = (place, 4) if step.new else (begun, knots + 4)
        # half way through nothing is asked
        half = sliding.odometry(*sliding.after(begun, step.committed.k, knots - 2), at + CYCLE // 2)
        assert one.hear_pose(half) is None or knots > 4
        place, speed = sliding.after(begun, step.committed.k, knots)
        for x0, y0, x1, y1 in POSTS:
            off = np.maximum([x0 - place[0], y0 - place[1]], [place[0] - x1, place[1] - y1])
            assert np.linalg.norm(np.maximum(off, 0.0)) > 0.2
    assert np.linalg.norm(place - [3.2, 0.3]) <= 0.4, place
    report = checker.check_episode(json.loads(json.dumps(episode_part(one.driven))), allowance_of)
    assert report.manoeuvres == len(one.driven) >= 4


@pytest.fixture(scope="module")
def ready():
    one = pilot()
    one.hear_map(sliding.map_of(sliding.hall(POSTS)))
    one.hear_goal(sliding.posed(3.2, 0.3))
    return one


BAD = [
    ("hear_map", sliding.map_of(sliding.hall(), frame="odom"), "map: expected one in the"),
    ("hear_map", sliding.map_of(sliding.hall()[:, :0]), "expected rows of cells|cells"),
    ("hear_map", sliding.map_of(np.full((4, 4), 99, np.int8)), "inflated costmap"),
    (
        "hear_goal",
        sliding.posed(1, 1, frame="odom"),
        "goal: expected one in the frame 'map'",
    ),
    ("hear_pose", sliding.odometry([0, 0], [0, 0], 10, "odom"), "pose: expected one in"),
    ("hear_pose", sliding.odometry([np.nan, 0], [0, 0], 10), "expected a finite one"),
    ("hear_pose", sliding.odometry([0, 0], [0, 0], 10, roll=np.pi), "tilted by at most 30 deg"),
    ("hear_pose", sliding.odometry([0, 0], [0, 0], 10, yaw=2, roll=0.6), "tilted by at most 30"),
    ("hear_scan", None, "where its sensor is"),
]


@pytest.mark.parametrize(("hear", "message", "words"), BAD)
def test_what_cannot_be_meant_changes_nothing(ready, hear, message, words):
    before = state(ready)
    with pytest.raises(InputError, match=words):
        getattr(ready, hear)(message)
    assert all(x is y for x, y in zip(before, state(ready), strict=True))


def state(one):
    return one.map, one.goal, one.pose, one.loop.under_way


def test_stamps_that_go_back_are_refused():
    one = pilot()
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    with pytest.raises(InputError, match=r"stamps that increase.*set back.*make a new Pilot"):
        one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))


def test_a_pose_that_is_nowhere_near_changes_nothing():
    one = pilot(sensor=(0.0, 0.0, 0.0), noise=0.01, width=0.15, margin=0.3)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    seen = one.seen
    with pytest.raises(InputError, match="corners of the body"):
        one.hear_pose(sliding.odometry([1e9, 0], [0, 0], 2 * 10**9))
    assert one.seen is seen and one.memory.stamp == 10**9 and (one.pose == 0).all()


def test_a_body_that_does_not_lie_in_free_cells_commits_to_nothing(ready):
    one = pilot()
    one.hear_map(sliding.map_of(sliding.hall(POSTS)))
    one.hear_goal(sliding.posed(3.2, 0.3))
    step = one.hear_pose(sliding.odometry([0.85, 0.0], [0, 0], 10**9))
    assert step.committed is None and "does not lie in what is known to be free" in step.reason
    step = one.hear_pose(sliding.odometry([0.0, 0.0], [0, 0], 2 * 10**9))
    assert step.new


@pytest.mark.soundness
def test_a_newer_map_tells_where_the_manoeuvre_under_way_may_lead_into_what_came():
    """It went on "with 0.659 m clear" into a pallet that the new map had."""
    words = "the manoeuvre under way may lead where it is no longer known to be free"
    for box, leads in (((0.55, -1.0, 0.9, 1.0), True), ((4.0, -1.0, 4.5, 1.0), False)):
        one = pilot()
        one.hear_map(sliding.map_of(sliding.hall()))
        one.hear_goal(sliding.posed(3.0, 0.0))
        first = one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9)).committed
        one.hear_map(sliding.map_of(sliding.hall([box])))
        place = sliding.after(np.zeros(2), first.k, 4)
        step = one.hear_pose(sliding.odometry(*place, 14 * 10**8))
        assert (words in step.reason) == leads and step.new != leads
        if leads:  # a map of elsewhere frees nothing
            one.hear_map(sliding.map_of(sliding.hall(), origin=(50.0, 50.0)))
            assert words in one.hear_pose(sliding.odometry(*place, 141 * 10**7)).reason


@pytest.mark.soundness
def test_a_map_that_is_older_than_the_one_that_is_known_is_refused():
    one = pilot()
    new, old = sliding.map_of(sliding.hall(POSTS)), sliding.map_of(sliding.hall())
    new.header, old.header = (sliding.header(at * 10**9) for at in (20, 5))
    one.hear_map(new)
    with pytest.raises(InputError, match="map: expected stamps that do not fall; got 5000000000"):
        one.hear_map(old)
    known = one.map
    one.hear_map(new)
    assert one.map.free.sum() == known.free.sum() < map_in(old).free.sum()


def test_a_robot_that_left_its_tube_has_no_clearance_and_begins_again_at_rest():
    one, rest = pilot(), np.zeros(2)
    one.hear_map(sliding.map_of(sliding.hall(POSTS)))
    one.hear_goal(sliding.posed(3.2, 0.3))
    assert one.hear_pose(sliding.odometry(rest, rest, 10**9)).new
    step = one.hear_pose(sliding.odometry(np.array([0.0, 0.5]), rest, 11 * 10**8))
    said = one.statement(step)
    assert step.left and "its tube left by 0.1 s" in said and "m clear" not in said
    assert "`restart`" in said
    with pytest.raises(InputError, match=r"restart: expected a robot at rest; .* for 1\.0\d* s"):
        one.restart()  # the robot goes on to the rest of its manoeuvre
    assert one.loop.under_way is not None and len(one.driven) == 1
    one.hear_pose(sliding.odometry(np.array([0.0, 0.5]), rest, 22 * 10**8))
    one.restart()
    assert one.hear_pose(sliding.odometry(rest, rest, 3 * 10**9)).new and len(one.driven) == 1


def test_what_edges_of_a_map_rest_on_is_stated_where_nobody_moves():
    one = pilot()
    one.hear_map(sliding.map_of(sliding.hall(POSTS)))
    one.hear_goal(sliding.posed(3.2, 0.3))
    step = one.hear_pose(sliding.odometry(np.zeros(2), np.zeros(2), 10**9))
    assert step.committed.asked.problem.rests_on
    assert "Within edges of free space nothing stands, and nothing has come" in one.statement(step)


def test_no_more_is_free_at_the_start_than_was_looked_at():
    one = pilot(radius=0.4, sensor=(0.1, 0.0, 0.0), margin=0.8)
    one.hear_pose(sliding.odometry([0.0, 0.0], [0, 0], 10**9))
    seen = np.array(one.seen.region.exterior.coords)
    assert 1.15 < np.linalg.norm(seen, axis=1).max() <= 1.2


def test_a_scan_frees_what_it_sees_from_where_it_was_taken():
    steady = {"acceleration": 0.0, "acceleration_turning": 0.0}
    one = pilot(sensor=(0.1, 0.0, 0.0), noise=0.01, margin=0.15, reach=2.0, **steady)
    wall = 1.5  # [m] along x
    angles = np.linspace(-np.pi, np.pi, 721)
    with np.errstate(divide="ignore"):
        ranges = np.where(np.cos(angles) > 1e-9, (wall - 0.6) / np.cos(angles), np.inf)
    ranges[ranges > 4.0] = np.inf
    ranges[100] = np.nan
    scan = sliding.Some(
        header=sliding.header(15 * 10**8, "lidar"),
        angle_min=-np.pi,
        angle_max=np.pi,
        angle_increment=2 * np.pi / 720,
        time_increment=0.0,
        range_min=0.05,
        range_max=4.0,
        ranges=ranges,
    )
    one.hear_goal(sliding.posed(3.2, 0.3))
    first = one.hear_pose(sliding.odometry([0.0, 0.0], [0, 0], 10**9))
    assert np.abs(first.committed.k).max() < 0.4  # it stays where a person has looked
    one.hear_scan(scan)
    # half way between two poses: the sensor was at x = 0.6
    one.hear_pose(sliding.odometry([1.0, 0.0], [0, 0], 2 * 10**9))
    shapely = pytest.importorskip("shapely")
    sees = lambda x, y: one.seen.region.contains(shapely.Point(x, y))  # noqa: E731
    assert sees(wall - 0.03, 0.0) and not sees(wall + 0.01, 0.0) and sees(-1.0, 1.0)
    late = pilot(sensor=(0.1, 0.0, 0.0), margin=0.15)
    late.hear_scan(scan)
    late.hear_pose(sliding.odometry([0.0, 0.0], [0, 0], 2 * 10**9))
    late.hear_pose(sliding.odometry([1.0, 0.0], [0, 0], 3 * 10**9))
    assert late.seen.region.area < 1.0  # nobody knows where it was taken


@pytest.mark.parametrize("reading", [np.nan, -np.inf, 0.01, 5.0])
def test_a_beam_that_says_nothing_frees_nothing(reading):
    """Ranges that failed, are nearer than the sensor can tell, or farther than it reaches."""
    shapely = pytest.importorskip("shapely")
    ranges = np.full(721, 2.0)
    ranges[360] = reading  # straight ahead
    scan = sliding.Some(
        angle_min=-np.pi,
        angle_increment=2 * np.pi / 720,
        time_increment=0.0,
        range_min=0.05,
        range_max=4.0,
        ranges=ranges,
    )
    limits = {"noise": 0.01, "width": 0.1, "uncertainty": (0.0, 0.0)}
    free = seen_in(scan, np.zeros(3), **limits).region
    assert not free.contains(shapely.Point(0.5, 0.0)) and free.contains(shapely.Point(0.0, 0.5))
    ranges[360] = np.inf  # it came back from nowhere
    free = seen_in(scan, np.zeros(3), **limits).region
    assert free.contains(shapely.Point(0.5, 0.0))


def test_nobody_looked_so_nothing_is_free_where_it_stands():
    one = pilot(sensor=(0.1, 0.0, 0.0))
    one.hear_goal(sliding.posed(3.2, 0.3))
    step = one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    assert step.committed is None and not step.new and step.reason


def test_bad_parameters_are_refused():
    with pytest.raises(InputError, match="given: expected 2 numbers"):
        pilot(given=())
    for radius in (0.0, np.nan, np.inf, "0.2", None):
        with pytest.raises(InputError, match="radius > 0 m"):
            pilot(radius=radius)
    with pytest.raises(InputError, match="reach: expected"):
        Driving(reach=-1.0)
    with pytest.raises(InputError, match="expected a model of the points"):
        Pilot(model(), pj.problem.read_footprint([[0.2, 0.1], [0.2, -0.1], [-0.2, 0.0]]))


@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        (
            [0.0, 0.0, 180.0],
            r"a heading within a turn \[rad\]; got 180.0 rad\. Degrees are 3.14159 rad",
        ),
        ((0.2, 0.0), r"sensor: expected shape \(3,\); got \(2,\)"),
        (("a", 0, 0), "sensor: expected numbers"),
        ((0.0, np.nan, 0.0), "sensor: expected finite numbers"),
    ],
)
def test_a_sensor_is_at_a_place_in_metres_with_a_heading_in_radians(sensor, words):
    with pytest.raises(InputError, match=words):
        Driving(sensor=sensor)


@pytest.mark.soundness
@pytest.mark.parametrize("name", ["drift", "drift_heading"])
def test_a_map_is_not_driven_on_in_a_frame_that_drifts(name):
    """Each manoeuvre would be off by what all before it have drifted."""
    with pytest.raises(InputError, match=rf"{name}: .* got 0\.02\. Take poses localised .* sensor"):
        Driving(**{name: 0.02})
    listed = Driving(sensor=[0, 0.1, np.pi], **{name: 0.02})
    assert listed.sensor == (0.0, 0.1, np.pi)


def rectangle(length, width):
    x, y = length / 2, width / 2
    return pj.problem.read_footprint([[x, y], [x, -y], [-x, -y], [-x, y]])


@functools.cache
def of_rectangle():
    """The platform with a body of 0.8 m x 0.24 m that never turns, from rest to rest."""
    robot = rectangle(0.8, 0.24)
    time = pj.learning.time_grid(dt=sliding.DT, t_f=1.2, dt_record=sliding.DT)
    ways = np.kron(sliding.OF_COMMAND[:, None], np.tile(np.eye(2), (5, 1)))
    net = pj.learning.relu_network([ways[2:]], [np.tile(robot.places.ravel(), 13)[2:]])
    wide = np.full((1, 12, 10), 0.02)
    tube = pj.learning.tube([[-1.0, 1.0]] * 2, wide, np.full((1, 10), 0.02), 5)
    said = "the tests declare it", net, time
    claim = pj.learning.declared_claim(tube, *said, points=robot.points)
    return pj.learning.trajectory_model(net, claim)


@pytest.mark.soundness
@pytest.mark.parametrize(("length", "width"), [(1.6, 0.48), (0.83, 0.24), (0.24, 0.8)])
def test_a_footprint_that_the_model_was_not_learned_with_is_refused(length, width):
    with pytest.raises(InputError, match="expected the footprint that the model was learned with"):
        Pilot(of_rectangle(), rectangle(length, width))


@pytest.mark.soundness
def test_a_body_that_turned_away_from_runs_without_a_rotation_begins_nothing(monkeypatch):
    """Its proof would be of the body along the frame's axes, and it stands across."""
    loop = Some(given=(), under_way=None, go_on=lambda why, *_: why)  # compiles nothing
    loop.step = lambda *_, **__: Some(new=False)
    monkeypatch.setattr("sims.pilot.Loop", lambda *_, **__: loop)
    one = Pilot(of_rectangle(), rectangle(0.8, 0.24))
    one.hear_map(sliding.map_of(sliding.hall()))
    one.hear_goal(sliding.posed(3.0, 0.0))
    for at, yaw in enumerate((np.pi / 2, -0.1, np.pi), 1):
        why = one.hear_pose(sliding.odometry([0, 0], [0, 0], at * 10**9, yaw=yaw))
        assert "a point of the body, turned by" in why and "which has no rotation" in why
    with pytest.raises(InputError, match="plan: expected a start with a way; a point of the body"):
        one.plan(sliding.posed(0, 0, np.pi / 2), sliding.posed(0.4, 0.1), 0.1)
    step = one.hear_pose(sliding.odometry([0, 0], [0, 0], 4 * 10**9, yaw=0.04))  # in its tube
    assert step is not None and step.new is False
    assert "the heading of a pose is only compared with that of its runs" in one.assumed


def test_all_points_of_a_body_are_looked_at_also_where_nothing_is_to_begin(monkeypatch):
    """The others follow of what is measured, which a loop was not told: the first one alone was."""
    told_of, under_way = [], Some(given=(0, 1), under_way=None)
    under_way.go_on = lambda *all_of, **named: Loop.go_on(under_way, *all_of, **named)
    under_way._left = lambda *pose: told_of.append(list(pose[3])) or ("", None)
    monkeypatch.setattr("sims.pilot.Loop", lambda *_, **__: under_way)
    one = pilot()
    one.hear_goal(sliding.posed(0.0, 0.0))
    one.hear_pose(sliding.odometry([0, 0], [0.1, 0.2], 10**9))  # it has arrived
    one.hear_goal(sliding.posed(3.0, 0.0))
    one.hear_pose(sliding.odometry([0, 0], [0.3, 0.4], 2 * 10**9))  # without a map
    assert told_of == [[0.1, 0.2], [0.3, 0.4]]


def test_the_guide_goes_around_what_is_in_the_way():
    cells = sliding.hall([(1.0, -1.5, 1.2, 0.7)])
    guide = Guide(map_in(sliding.map_of(cells)), np.array([3.0, -1.0]), 0.2)
    before, above, behind = guide(np.array([[0.5, -1.0], [1.1, 1.1], [1.6, -1.0]]))
    # from a place before the wall: up to its end, and down again
    assert before == pytest.approx(np.hypot(0.5, 1.9) + np.hypot(1.9, 1.9), rel=0.1)
    assert above == pytest.approx(np.hypot(1.9, 2.1), rel=0.1)
    assert behind == pytest.approx(1.4, rel=0.1)
    inside, far = guide(np.array([[1.1, -1.0], [50.0, 50.0]]))
    assert inside > 1e6 and far > 1e6
    one = pilot()
    prefer, ends = along_ways(one), np.array([[0.5, -1.0], [1.6, -1.0]])
    seen = Some(path=np.stack([np.zeros((2, 2)), ends], axis=1))
    straight = prefer(seen, guide.goal)
    one.hear_map(sliding.map_of(cells))
    around = prefer(seen, guide.goal)
    assert straight.tolist() == [2.5, 1.4] and around[0] > 3.5 and around[1] < 1.6
    shut = Guide(map_in(sliding.map_of(np.full((8, 8), 100, np.int8))), np.zeros(2), 0.2)
    assert shut(np.array([[1.0, 0.0]])) == pytest.approx(1e6 + 1.0)


@pytest.mark.slow
def test_a_plan_is_proved_from_rest(ready):
    answer = ready.plan(sliding.posed(0, 0), sliding.posed(0.4, 0.1), 0.1)
    assert answer.status.found and answer.cover.proved
    with pytest.raises(InputError, match="expected a start with a way"):
        ready.plan(sliding.posed(1.1, 0), sliding.posed(0.4, 0.1), 0.1)
    tilted = sliding.odometry([0, 0], [0, 0], 10, roll=0.6)
    with pytest.raises(InputError, match=r"plan: expected finite poses, tilted by at most 30 deg"):
        ready.plan(tilted, sliding.posed(0.4, 0.1), 0.1)
    with pytest.raises(InputError, match="goal: expected one in the frame"):
        ready.plan(sliding.posed(0, 0), sliding.posed(0.4, 0.1, frame="odom"), 0.1)


@pytest.mark.soundness
def test_the_frame_of_a_plan_is_that_of_its_start_not_of_the_last_pose():
    law = replace(model().claim.law, parameters=((f"{OURS}pose", "/odom, odom -> base_link"),))
    of_law = model().replace(claim=derived(model().claim, law=law))
    one = Pilot(of_law, 0.2, Driving(leave=0.4, given=GIVEN))
    one.hear_map(sliding.map_of(sliding.hall()))
    start, goal = sliding.odometry([0.5, 0], [0, 0], 2 * 10**9), sliding.posed(0.9, 0.0)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    one.planner = Some(solve=lambda *asked, **more: None)
    for frame, words in (("base_link", "point, as in its runs"), ("", "point is assumed: its")):
        start.child_frame_id = frame
        one.plan(start, goal, 0.3)
        assert f"the model's first reference {words}" in one.assumed_of_plan
    assert "whose pose it is: of a frame that no message names" in one.assumed_of_plan
    assert "of the frame 'base_link'" in one.assumed
    refused = sliding.odometry([50, 50], [0, 0], 2 * 10**9)
    refused.child_frame_id = "base_link"
    with pytest.raises(InputError, match="expected a start with a way"):
        one.plan(refused, goal, 0.3)
    assert "point is assumed: its" in one.assumed_of_plan  # as of the last that was made
    start.child_frame_id = "camera_link"
    with pytest.raises(InputError, match=r"start: expected that of 'base_link'.* 'camera_link'"):
        one.plan(start, goal, 0.3)


@pytest.mark.soundness
def test_a_plan_is_told_to_measure_nothing(ready):
    """Its premise was that of a manoeuvre: numbers of a message that no plan is given."""
    said = ready.assumed_of_plan
    assert "measured at the start: nothing; k0 = 0, k1 = 0, since it is asked at rest" in said
    assert GIVEN[0] not in said and "the heading of a pose is not asked" in said
    same = ready.assumed.split("; measured at the start")[0]
    assert said.startswith(same) and f"k0 is {GIVEN[0]}" in ready.assumed
    free = Pilot(sliding.model(), 0.2, Driving(leave=0.4))
    assert free.assumed_of_plan == free.assumed


@pytest.mark.slow
def test_a_node_without_ros_says_what_to_install():
    code = "import runpy; runpy.run_module('sims.ros.node', run_name='__main__')"
    gone = "import sys; sys.modules['geometry_msgs'] = None; "
    done = subprocess.run([sys.executable, "-c", gone + code], capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "expected ROS 2; its package geometry_msgs" in done.stderr


def test_a_model_that_measures_nothing_is_told_how_to_learn_one_that_does():
    with pytest.raises(InputError, match=r"expected 0 numbers.* got 2\. Learn one of a"):
        Pilot(sliding.model(), 0.2, Driving(leave=0.4, given=GIVEN))


ALIKE = [  # names of places elsewhere, as of a TwistStamped, that end as those in an Odometry
    ("v.x [m/s]", "v.y [m/s]"),
    ("base.vel.x [m/s]", "state.v.y [m/s]"),
    ("twist.linear.x [m/s]", "twist.linear.y [m/s]"),
    ("pose.speed.x [m/s]", "pose.speed.y [m/s]"),
]


SHORT = [
    ("speed_x [m/s]", "speed_y [m/s]"),
    ("vx0 [m/s]", "vy0 [m/s]"),
    ("v0x [m/s]", "v0y [m/s]"),
    ("twist_linear_x [m/s]", "twist_linear_y [m/s]"),
    ("vX [m/s]", "vY [m/s]"),
    ("v_east [m/s]", "v_north [m/s]"),
    ("xdot [m/s]", "ydot [m/s]"),
    ("dxdt [m/s]", "dydt [m/s]"),
    ("vxb [m/s]", "vyb [m/s]"),
    ("v_lon [m/s]", "v_lat [m/s]"),
    ("vlong [m/s]", "vlat [m/s]"),
    ("forward [m/s]", "left [m/s]"),
    ("surge [m/s]", "sway [m/s]"),
]


@pytest.mark.soundness
def test_the_unit_of_what_is_measured_is_that_of_messages_of_ros():
    """A speed in m/s was given to a model of one in km/h: proved, and 18 cm in the wall."""
    for x in ("km/h", "mm/s", "deg/s", "m"):
        with pytest.raises(InputError, match=rf"v0x in \[m/s\], which {GIVEN[0]} .* got 'v0x"):
            Pilot(labelled(f"v0x [{x}]", f"v0y [{x}]"), 0.2, Driving(leave=0.4, given=GIVEN))
    for x, y in (("v0x (mph)", "v0y (mph)"), ("vx_kmh", "vy_kmh"), ("v0x [m/s]", "v0y (km/h)")):
        with pytest.raises(InputError, match=r"in \[m/s\], which twist"):
            Pilot(labelled(x, y), 0.2, Driving(leave=0.4, given=GIVEN))
    one = Pilot(labelled("v0x [m/s]", "v0y (m/s)"), 0.2, Driving(leave=0.4, given=GIVEN))
    assert f"v0x [m/s] is {GIVEN[0]}, v0y (m/s) is" in one.premises["measured at the start"]
    own = ("state.v.0", "state.v.1")  # of messages that ROS does not define: of any unit, told
    one = Pilot(labelled("v0 [km/h]", "v1 [km/h]"), 0.2, Driving(leave=0.4, given=own))
    assert f"v0 [km/h] is {own[0]}" in one.premises["measured at the start"]


TURNING = (GIVEN[0], "twist.twist.angular.z")


@pytest.mark.soundness
def test_a_name_without_a_unit_is_no_word_about_what_messages_of_ros_have():
    """`vx_kmph` was read in m/s, since no list of units had it: proved, and 9.5 cm in the wall."""
    driving = Driving(leave=0.4, given=TURNING)
    for name in ("v_kmph", "speed percent", "v x1000", "speed of knot 3", "v", "x"):
        with pytest.raises(InputError, match=r"given: expected .* name its unit, as '.* \[m/s"):
            Pilot(labelled(name, "w [rad/s]"), 0.2, driving)
    for name in ("yaw_rate_degps", "turn rate, mrad", "w", "yaw [m/s]"):
        with pytest.raises(InputError, match=r"given: expected .* name its unit, as '.* \[rad/s"):
            Pilot(labelled("v [m/s]", name), 0.2, driving)
    for names in (
        ("v_kmph [m/s]", "yaw [rad/s]"),
        ("velocity [m/sec]", "yaw rate [1/s]"),
        ("v [m s^-1]", "turn rate [rad / s]"),
        ("twist.linear.x", "angular.z"),
        ("k0", "k1"),
    ):
        Pilot(labelled(*names), 0.2, driving)
    with pytest.raises(InputError, match=r"given: expected v in \[rad/s"):
        Pilot(labelled("v [m/s]", "w [rad/s]"), 0.2, replace(driving, given=TURNING[::-1]))


@pytest.mark.soundness
def test_what_is_measured_is_no_part_of_a_quaternion_a_stamp_or_a_covariance():
    """The z of an orientation, 0.56, was taken as an exact heading of 1.2 rad."""
    for path in ("pose.pose.orientation.z", "header.stamp.sec", "twist.covariance.0"):
        driving = Driving(leave=0.4, given=(path,))
        for name in ("heading at the start [rad]", "k0"):
            with pytest.raises(InputError, match=rf"given: expected a place.* got {path}, a part"):
                Pilot(told(labelled(name, "k1"), given=(0,)), 0.2, driving)
        Pilot(told(labelled(path, "k1"), given=(0,)), 0.2, driving)


def labelled(*names):
    """The platform's model, its parameters at the start so named."""
    return told(model(), labels=Labels(model().labels.p, model().labels.q, (*names, "vx", "vy")))


@pytest.mark.soundness
def test_a_twist_of_a_turned_body_begins_nothing_where_the_model_goes_along_the_frame():
    """It drove on with (0.6, 0) m/s while the robot went at (0, 0.6) m/s of the map, and left its
    tube where the heading was 0 within the uncertainty alone.
    """
    one = pilot()
    one.hear_map(sliding.map_of(sliding.hall()))
    one.hear_goal(sliding.posed(3.2, 0.3))
    for at, yaw in enumerate((np.pi / 2, -0.1, np.pi), 1):
        step = one.hear_pose(sliding.odometry([0, 0], [0.6, 0.0], at * 10**9, yaw=yaw))
        assert not step.new and "the twist of a pose is of a body that may be" in step.reason
    first = one.hear_pose(sliding.odometry([0, 0], [0.6, 0.0], 4 * 10**9, yaw=1e-7))
    assert first.new and "the heading of a pose is asked to be 0" in one.assumed
    said = one.premises["measured at the start"]
    assert "is taken along the frame's axes" in said and "is 0 within ±1e-06 rad" in said
    place, speed = sliding.after(np.zeros(2), first.committed.k, 4)
    step = one.hear_pose(sliding.odometry(place, speed, 44 * 10**8, yaw=0.3))
    assert not step.new and step.committed is first.committed
    assert "turned by 0.3" in one.statement(step)
    turned = Pilot(told(model(), rotation=()), 0.2, one.driving)
    assert "frame's axes" not in turned.premises["measured at the start"]
    unsure = pilot(uncertainty_heading=0.02)
    unsure.hear_map(sliding.map_of(sliding.hall()))
    unsure.hear_goal(sliding.posed(3.2, 0.3))
    for at, yaw in enumerate((0.0, 0.02), 1):
        step = unsure.hear_pose(sliding.odometry([0, 0], [0.6, 0.0], at * 10**9, yaw=yaw))
        assert not step.new and f"turned by {yaw + 0.02!r} rad, uncertainty_heading" in step.reason


@pytest.mark.soundness
def test_which_numbers_of_a_message_are_measured_is_told_and_compared_with_what_was_learned():
    """It took the y of a twist for its x, or the stamp, and said no more than k0 = 0.6."""
    other = ("pose.pose.position.x", "header.stamp.sec")
    one, exchanged = pilot(), pilot(given=GIVEN[::-1])
    said = one.premises["measured at the start"]
    assert f"k0 is {GIVEN[0]}, k1 is {GIVEN[1]} of the message of the pose" in said
    assert said in one.assumed and said != exchanged.premises["measured at the start"]
    pose = sliding.odometry([0, 0], [0, 0], 10**9)
    for named in (GIVEN, GIVEN[::-1]):
        for given in (GIVEN, GIVEN[::-1], other):
            for names in (named, [f"{x} [m/s]" for x in named]):
                asked = labelled(*names), 0.2, Driving(leave=0.4, given=given)
                if given == named:
                    assert Pilot(*asked).hear_pose(pose) is None
                    continue
                said = f"given: expected {named[0]}(, {named[1]}, in this| in .m., which)"
                with pytest.raises(InputError, match=said):
                    Pilot(*asked).hear_pose(pose)  # the first message has what is named
    for x, y in ALIKE + SHORT:
        Pilot(labelled(x, y), 0.2, Driving(leave=0.4, given=GIVEN)).hear_pose(pose)
        with pytest.raises(InputError, match="given: expected"):
            Pilot(labelled(y, x), 0.2, Driving(leave=0.4, given=GIVEN))
    cut = ((f"{OURS}given", f"last {', '.join(GIVEN)}"),)
    law = replace(model().claim.law, parameters=cut)  # as of a bag; its labels are others
    learned = model().replace(claim=derived(model().claim, law=law))
    Pilot(learned, 0.2, one.driving)
    for x, y in (("v by x", "speed"), ("speed", "velocity at the start"), ("linear x", "v_mps")):
        Pilot(labelled(f"{x} [m/s]", f"{y} [m/s]"), 0.2, one.driving)  # no other axis is told
    for names in (("angular rate", "vy"), ("speed", "vx")):
        with pytest.raises(
            InputError, match=f"expected {names[0]}, {names[1]}.*messages that have"
        ):
            Pilot(labelled(*names), 0.2, one.driving)
    for others in (exchanged.driving, replace(one.driving, given=other)):
        with pytest.raises(InputError, match=f"given: expected {GIVEN[0]}, {GIVEN[1]}, in this"):
            Pilot(learned, 0.2, others)


@pytest.mark.soundness
def test_the_frame_of_a_pose_is_that_of_the_models_runs_or_assumed():
    """Poses of a camera were taken for those of base_link, with the body in a wall."""
    first, runs = "the model's first reference point", (f"{OURS}pose", "/odom, odom -> base_link")
    for parameters, learned in (((), ""), ((runs,), "base_link")):
        law = replace(model().claim.law, parameters=parameters)
        of_law = model().replace(claim=derived(model().claim, law=law))
        for frame in ("base_link", "camera_link", ""):
            one = Pilot(of_law, 0.2, Driving(leave=0.4, given=GIVEN))
            pose = sliding.odometry([0, 0], [0, 0], 10**9)
            pose.child_frame_id = frame
            if learned and frame == "camera_link":
                with pytest.raises(InputError, match=r"'base_link', as in .* that of 'camera_link"):
                    one.hear_pose(pose)
                assert one.pose is None
                continue
            one.hear_pose(pose)
            said = one.premises["whose pose it is"]
            assert (f"{first}, as in its runs" in said) == (frame == learned == "base_link")
            assert (f"that it is {first} is assumed" in said) == (not (learned and frame))


@pytest.mark.soundness
def test_the_deadline_counts_what_is_done_before_the_candidates():
    """Free space took half a second of a deadline of 0.1 s, and a manoeuvre began all the same."""
    now = [0.0]
    one = Pilot(model(), 0.2, Driving(leave=0.4, given=GIVEN, deadline=0.1), clock=lambda: now[0])
    one.hear_map(sliding.map_of(sliding.hall()))
    one.hear_goal(sliding.posed(3.2, 0.3))
    ways, slow = one._ways, [0.2]

    def slowly(*asked):
        now[0] += slow[0]
        return ways(*asked)

    one._ways = slowly
    step = one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    assert not step.new and "no manoeuvre was proved within 0.1 s" in step.reason
    slow[0] = 0.05
    assert one.hear_pose(sliding.odometry([0, 0], [0, 0], 2 * 10**9)).new


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"frame": ""}, "frame: expected the name of a frame"),
        ({"given": GIVEN[0]}, "given: expected paths of numbers"),
        ({"given": (1.0,)}, "given: expected paths of numbers"),
    ],
)
def test_names_that_are_none_are_refused(asked, words):
    with pytest.raises(InputError, match=words):
        Driving(**asked)
