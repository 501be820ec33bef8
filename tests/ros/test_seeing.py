"""A pilot on scans: who comes into view is not driven into, a sweep takes time, and other sensors
are refused.
"""

import functools

import numpy as np
import pytest
import sliding
from needs import need
from toy_models import told

from parc_jax.common.errors import InputError
from parc_jax.drive.loop.episode_file import episode_part
from sims.driving import Driving
from sims.pilot import Pilot

need("shapely")
import shapely  # noqa: E402
from lidar_worlds import cast  # noqa: E402

RADIUS, CYCLE = 0.2, 400_000_000  # [m], [ns]
ANGLES = np.linspace(-np.pi, np.pi, 361)
GIVEN = ("twist.twist.linear.x", "twist.twist.linear.y")


@functools.cache
def model():
    return told(sliding.model(), given=(0, 1))


def pilot(**asked):
    known = {"leave": 0.4, "given": GIVEN, "deadline": 300.0, "sensor": (0.0, 0.0, 0.0)}
    known |= {"noise": 0.01, "width": 0.15, "margin": 0.3, "arrived": 0.2, "reach": 2.5}
    return Pilot(model(), RADIUS, Driving(**(known | asked)))


def scan(world, path, at, each=0.0, frame="lidar", heading=0.0):
    """From path(beam), a place each; at [ns] of the first, `each` [s] between two."""
    ranges = [
        cast(world, np.append(path(i), heading), np.array([heading + angle]), 6.0)[0]
        for i, angle in enumerate(ANGLES)
    ]
    return sliding.Some(
        header=sliding.header(at, frame),
        angle_min=ANGLES[0],
        angle_max=ANGLES[-1],
        angle_increment=ANGLES[1] - ANGLES[0],
        time_increment=each,
        range_min=0.0,
        range_max=6.0,
        ranges=np.where(np.array(ranges) < 6.0, ranges, np.inf),
    )


@pytest.mark.soundness
@pytest.mark.parametrize("beside", [0.0, 0.25])
def test_who_comes_into_full_view_on_the_way_back_is_not_driven_into(beside):
    """The robot drives out and is called back; meanwhile somebody stands where it came from."""
    one, posts = pilot(), [shapely.box(3.0, -1.5, 3.1, 1.5)]
    person = shapely.Point(0.5, beside).buffer(0.2)
    place, speed, at = np.zeros(2), np.zeros(2), 10**9
    begun, knots, nearest, said = place, 13, np.inf, []
    one.hear_goal(sliding.posed(1.8, 0.0))
    for cycle in range(22):
        world = [*posts, person] if cycle >= 9 else posts
        if cycle == 9:
            assert place[0] > 1.4 and one.seen.region.contains(person)
            one.hear_goal(sliding.posed(-0.3, 0.0))
        one.hear_scan(scan(world, lambda _, here=place: here, at))
        step = one.hear_pose(sliding.odometry(place, speed, at))
        said.append(one.said)
        if cycle >= 9:
            assert not one.seen.region.intersects(person)
        if step is not None and step.new:
            begun, knots = place, 0
        for _ in range(4):
            knots += 1
            if one.loop.under_way is not None:
                place, speed = sliding.after(begun, one.loop.under_way.k, knots)
            if cycle >= 9:
                nearest = min(nearest, person.distance(shapely.Point(place)) - RADIUS)
        at += CYCLE
    assert nearest > 0 and not any(said[:9]) and "something came" in said[9]


def test_what_is_under_way_where_somebody_came_is_said_to_lead_there():
    one, at = pilot(), 10**9
    one.hear_goal(sliding.posed(2.5, 0.0))
    one.hear_scan(scan([], lambda _: np.zeros(2), at))
    first = one.hear_pose(sliding.odometry([0, 0], [0, 0], at))
    assert first.new and first.committed.k[2] > 0.5
    place, speed = sliding.after(np.zeros(2), first.committed.k, 4)
    around = [shapely.Point(place).buffer(0.5).difference(shapely.Point(place).buffer(0.28))]
    one.hear_scan(scan(around, lambda _: place, at + CYCLE))
    step = one.hear_pose(sliding.odometry(place, speed, at + CYCLE))
    assert not step.new and step.committed is first.committed
    assert "may lead where it is no longer known to be free" in step.reason


@pytest.mark.soundness
@pytest.mark.parametrize("poses", [2, 5])
def test_a_sweep_from_a_robot_that_drives_frees_nothing_where_a_post_stands(poses):
    """A tenth of a second for all beams, at 1.6 m/s: first and last are taken 16 cm apart."""
    each, at, speed = 0.1 / 360, 10**9, np.array([1.6, 0.0])
    posts = [shapely.Point(x, y).buffer(0.08) for x in (-1.0, 0.2, 1.2) for y in (-0.9, 0.9)]
    one = pilot(reach=4.0)
    one.hear_pose(sliding.odometry([0, 0], speed, at))
    one.hear_scan(scan(posts, lambda i: i * each * speed, at, each))
    for part in np.linspace(0, 0.12, poses)[1:]:
        one.hear_pose(sliding.odometry(part * speed, speed, at + round(part * 1e9)))
    assert one.seen.region.area > 15.0
    assert not shapely.intersects(one.seen.region, posts).any()


@pytest.mark.soundness
def test_between_poses_far_apart_nothing_is_freed_where_a_post_stands():
    """It starts late between two poses, and is 20 cm behind the straight way."""
    post = shapely.box(0.9, -0.1, 1.1, 0.1)
    one, at = pilot(), 10**9
    one.hear_pose(sliding.odometry([0, 0], [0, 0], at))
    one.hear_scan(scan([post], lambda _: np.zeros(2), at + CYCLE))
    one.hear_pose(sliding.odometry([0.6, 0.0], [0, 0], at + 3 * CYCLE))
    assert not one.seen.region.intersects(post)


@pytest.mark.soundness
def test_scans_wait_for_their_pose_in_turn_and_without_any_nothing_new_begins():
    at, still = 10**9, lambda _: np.zeros(2)
    person = shapely.box(1.0, -0.2, 1.2, 0.2)

    def standing(one, cycle):
        return one.hear_pose(sliding.odometry([0, 0], [0, 0], at + round(cycle * CYCLE)))

    for pause in (1.0, 3.0):
        one = pilot()
        one.hear_scan(scan([], still, at))
        standing(one, 0)
        for cycle in (1, 2, 3):  # each comes before the pose at which the one before it is added
            one.hear_scan(scan([person], still, at + cycle * CYCLE + CYCLE // 8))
            standing(one, cycle)
        assert not one.seen.region.intersects(person)
        one.hear_goal(sliding.posed(2.5, 0.0))
        step = standing(one, 3.125 + pause)
        if pause == 1.0:
            assert step.new and f"the last scan is {CYCLE / 1e9!r} s older" in one.statement(step)
        else:
            assert step.committed is None and "no scan of the last 1.0 s" in step.reason
    late = Pilot(model(), RADIUS, one.driving)
    late.hear_pose(sliding.odometry([0, 0], [0, 0], at))
    late.hear_scan(scan([], still, at - 1))
    late.hear_pose(sliding.odometry([0, 0], [0, 0], at + CYCLE))
    assert "older than all poses, and is not used" in late.said
    assert "no pose was heard yet" in Pilot(model(), RADIUS, one.driving).memory.stale
    with pytest.raises(InputError, match="whose pose it is"):
        other = sliding.odometry([0, 0], [0, 0], at + 2 * CYCLE)
        other.child_frame_id = "mast"
        late.hear_pose(other)


@pytest.mark.soundness
def test_a_driver_that_fills_one_buffer_of_ranges_frees_no_wall():
    """The first scan waits for its pose; by then the buffer has the second, of a metre behind."""
    one, at, wall, buffer = pilot(), 10**9, shapely.box(1.5, -3.0, 1.6, 3.0), np.zeros(361)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], at))
    for x, later in ((0.0, 10**7), (-1.0, 35 * 10**7)):
        message = scan([wall], lambda _, x=x: np.array([x, 0.0]), at + later)
        buffer[:] = message.ranges
        message.ranges = buffer
        one.hear_scan(message)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], at + 2 * 10**7))
    assert one.seen.region.area > 4.0 and not one.seen.region.intersects(wall)


def test_a_scan_waits_until_its_sweep_has_ended():
    one, at = pilot(), 10**9
    one.hear_pose(sliding.odometry([0, 0], [0, 0], at))
    one.hear_scan(scan([], lambda _: np.zeros(2), at + 1, 0.1 / 360))
    one.hear_pose(sliding.odometry([0, 0], [0, 0], at + 50_000_000))
    assert one.seen.region.area < 1.0
    one.hear_pose(sliding.odometry([0, 0], [0, 0], at + 110_000_000))
    assert one.seen.region.area > 50.0


@pytest.mark.parametrize(
    ("asked", "taken"),
    [({}, 0.0), ({"drift": 0.05}, 0.05), ({"drift_heading": 0.05}, 0.05 * 5.93)],
)
def test_a_scan_that_is_heard_after_a_manoeuvre_began_has_drifted_as_all_before_it(asked, taken):
    """Turned about where that began: about where the robot is, a scan freed 6 cm of a wall."""
    one, rest, on = pilot(reach=3.5, **asked), np.zeros(2), np.array([0.5, 0.0])
    one.hear_goal(sliding.posed(1.8, 0.0))
    one.hear_scan(scan([], lambda _: rest, 10**9))
    assert one.hear_pose(sliding.odometry(rest, rest, 10**9)).new
    one.memory.seen = None  # what the scan alone frees
    one.memory.begun = 11 * 10**8  # as if another one had begun meanwhile
    one.hear_pose(sliding.odometry(rest, rest, 11 * 10**8))
    one.memory.seen = None
    one.hear_scan(scan([], lambda _: rest, 105 * 10**7))
    one.hear_pose(sliding.odometry(on, rest, 12 * 10**8))
    x0, _, x1, _ = one.seen.region.bounds
    assert (x1 - x0) / 2 == pytest.approx(5.93 - taken, abs=0.015)
    one.memory.before = 115 * 10**7  # drifted twice since
    one.hear_scan(scan([], lambda _: rest, 106 * 10**7))
    one.hear_pose(sliding.odometry(rest, rest, 13 * 10**8))
    assert "a scan was 0.24 s old, which is too old, and is not used" in one.said


@pytest.mark.soundness
def test_a_restart_forgets_what_was_seen_where_the_frame_was():
    """Wheels slip by 0.5 m: what was free behind the robot is a wall where it is told to be now."""
    one, rest, jumped = pilot(drift=0.01), np.zeros(2), np.array([0.5, 0.0])
    one.hear_goal(sliding.posed(1.8, 0.0))
    one.hear_scan(scan([], lambda _: rest, 10**9))
    assert one.hear_pose(sliding.odometry(rest, rest, 10**9)).new
    assert one.hear_pose(sliding.odometry(jumped, rest, 11 * 10**8)).left
    with pytest.raises(InputError, match=r"plan: .* may have led; .* call `restart` first"):
        one.plan(sliding.posed(*jumped), sliding.posed(0.2, 0.0), 0.1)
    one.hear_pose(sliding.odometry(jumped, rest, 22 * 10**8))
    one.hear_scan(scan([], lambda _: rest, 225 * 10**7, each=1e-3))  # waits
    one.restart()
    with pytest.raises(InputError, match="expected a start with a way; no scan of the last"):
        one.plan(sliding.posed(*jumped), sliding.posed(0.2, 0.0), 0.1)
    one.hear_pose(sliding.odometry(jumped, rest, 24 * 10**8))
    one.hear_pose(sliding.odometry(jumped, rest, 27 * 10**8))
    assert "older than all poses, and is not used" in one.said
    looked = shapely.Point(jumped).buffer(RADIUS + 0.3, quad_segs=64)
    assert looked.contains(one.seen.region) and one.seen.region.area > 0.95 * looked.area


@pytest.mark.soundness
@pytest.mark.parametrize(("moved", "forgets"), [(0.12, False), (0.2, True)])
def test_what_was_seen_is_forgotten_where_others_move_the_robot_in_a_frame_that_drifts(
    moved, forgets
):
    """A joystick before the first goal: nothing bounds the drift. Errors of poses are no motion."""
    one, rest = pilot(drift=0.01, uncertainty_start=0.05), np.zeros(2)
    one.hear_scan(scan([], lambda _: rest, 10**9))
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    for i in range(1, 5):  # in small parts, of which none is motion
        assert one.seen.region.area > 50.0 and not one.said
        one.hear_scan(scan([], lambda _: rest, 10**9 + i * 10**8 - 5 * 10**7))
        one.hear_pose(sliding.odometry([moved * i / 4, 0.0], rest, 10**9 + i * 10**8))
    assert ("no manoeuvre is under way" in one.said) == forgets
    body = shapely.Polygon(one.outline.at(one.pose))  # nobody has looked around it meanwhile
    assert body.buffer(1e-6).contains(one.seen.region) == forgets
    one.hear_scan(scan([], lambda _: rest, 15 * 10**8))
    one.hear_pose(sliding.odometry([moved, 0.0], rest, 15 * 10**8))
    assert one.seen.region.area > 50.0 and not one.said


@pytest.mark.parametrize("drift", [{"drift": 0.01}, {"drift_heading": 1e-3}])
def test_what_a_pose_at_rest_jitters_is_no_motion(drift):
    """Poses of odometry whose errors nobody told: the robot would never see anything."""
    one, rest = pilot(**drift), np.zeros(2)
    one.hear_scan(scan([], lambda _: rest, 10**9))
    for i, off in enumerate((0.0, 0.002, -0.002)):
        one.hear_pose(sliding.odometry([off, 0.0], rest, 10**9 + i * 10**8, yaw=off))
        assert one.seen.region.area > 50.0 and not one.said


def test_after_a_joystick_a_lidar_that_sees_half_is_told_how_to_begin_again():
    """Nobody has seen what is behind the robot where the joystick has left it."""
    one, rest, there = pilot(drift=0.01), np.zeros(2), np.array([0.3, 0.0])

    def half(at):
        found = scan([], lambda _: there, at)
        found.ranges = np.where(np.abs(ANGLES) < 2.3, found.ranges, 0.0)
        return found

    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    one.hear_pose(sliding.odometry(there, rest, 11 * 10**8))
    one.hear_goal(sliding.posed(1.8, 0.0))
    one.hear_scan(half(12 * 10**8))
    reason = one.hear_pose(sliding.odometry(there, rest, 12 * 10**8)).reason
    assert "bring it to rest, look `margin` around it, which is 0.3 m, and `restart`" in reason
    one.restart()
    one.hear_scan(half(13 * 10**8))
    assert one.hear_pose(sliding.odometry(there, rest, 13 * 10**8)).new


def test_in_a_frame_that_keeps_what_was_seen_stays_whoever_drives():
    one, rest = pilot(), np.zeros(2)
    one.hear_scan(scan([], lambda _: rest, 10**9))
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    one.hear_pose(sliding.odometry([0.4, 0.0], rest, 11 * 10**8))
    assert one.seen.region.area > 50.0


def test_a_scan_from_before_something_was_forgotten_is_not_used():
    """It would be remembered for longer than its age."""
    one, rest = pilot(age=0.5), np.zeros(2)
    one.hear_scan(scan([], lambda _: rest, 10**9))
    for at in (10, 13, 15):
        one.hear_pose(sliding.odometry(rest, rest, at * 10**8))
    one.hear_scan(scan([], lambda _: rest, 12 * 10**8))
    one.hear_pose(sliding.odometry(rest, rest, 16 * 10**8))
    assert "a scan was 0.4 s old, which is too old" in one.said


@pytest.mark.soundness
@pytest.mark.parametrize("late", [0, 100_000_000])
def test_a_sweep_under_way_while_something_is_forgotten_is_used_and_leaves_by_its_age(late):
    """Poses come between its beams; drivers tell it after its last one. Half an age is 0.5 s."""
    one, rest, told = pilot(age=1.0), np.zeros(2), scan([], lambda _: np.zeros(2), 0, 0.09 / 360)

    for at in range(10**9, 2_960_000_000, 20_000_000):
        begun = at - late
        if begun % 10**8 == 4 * 10**7 and 10**9 < begun < 2 * 10**9:  # the last one: at 1.94 s
            told.header = sliding.header(begun, "lidar")
            one.hear_scan(told)
        one.hear_pose(sliding.odometry(rest, rest, at))
        assert "not used" not in one.said and (at > 2.2e9 or not one.memory.stale)
        assert not 1.3e9 < at < 2.2e9 or one.seen.region.area > 50.0
    assert one.seen.region.area < 1.0


@pytest.mark.soundness
def test_a_scan_from_before_what_was_forgotten_leaves_with_those_of_its_half():
    one, rest = pilot(age=1.0), np.zeros(2)
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    one.hear_pose(sliding.odometry(rest, rest, 155 * 10**7))
    one.hear_scan(scan([], lambda _: rest, 145 * 10**7))
    one.hear_pose(sliding.odometry(rest, rest, 16 * 10**8))
    assert one.seen.region.area > 50.0
    one.hear_pose(sliding.odometry(rest, rest, 2 * 10**9))
    assert one.seen.region.area < 1.0


def test_a_scan_that_makes_no_sense_hides_no_pose_outside_of_the_tube():
    one, rest = pilot(), np.zeros(2)
    one.hear_goal(sliding.posed(1.8, 0.0))
    one.hear_scan(scan([], lambda _: rest, 10**9))
    assert one.hear_pose(sliding.odometry(rest, rest, 10**9)).new
    bad = scan([], lambda _: rest, 11 * 10**8)
    bad.ranges, bad.angle_max = bad.ranges[:1], bad.angle_min
    one.hear_scan(bad)
    step = one.hear_pose(sliding.odometry(np.array([0.0, 2.0]), rest, 12 * 10**8))
    assert step.left and "a scan is not used: " in one.said


@pytest.mark.soundness
def test_after_a_scan_that_could_not_be_used_nothing_begins_until_one_is():
    """Somebody steps in front of it, and the scan that shows them is broken."""
    one, rest, person = pilot(), np.zeros(2), shapely.Point(1.0, 0.0).buffer(0.3)
    one.hear_scan(scan([], lambda _: rest, 10**9))
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    one.hear_goal(sliding.posed(1.8, 0.0))
    bad = scan([person], lambda _: rest, 11 * 10**8)
    bad.ranges, bad.angle_max = bad.ranges[:1], bad.angle_min
    one.hear_scan(bad)
    for at in (11, 12):
        step = one.hear_pose(sliding.odometry(rest, rest, at * 10**8))
        assert not step.new and "the last scan could not be used" in step.reason
    one.hear_scan(scan([person], lambda _: rest, 13 * 10**8))
    assert one.hear_pose(sliding.odometry(rest, rest, 13 * 10**8)).new
    assert not one.seen.region.intersects(person)


BROKEN = {
    "cut": {"ranges": np.ones(100)},
    "strings": {"ranges": ["x"] * 361},
    "time_increment": {"time_increment": np.nan},
    "long": {"time_increment": 1e9},
    "endless": {"time_increment": 1e308},
    "range_max": {"range_max": 5.0},
    "angle_min": {"angle_min": np.nan},
    "empty": {"ranges": []},
}


@pytest.mark.soundness
@pytest.mark.parametrize("of", [*BROKEN, "frame"])
def test_after_a_scan_of_this_sensor_that_is_refused_nothing_begins_until_one_is_used(of):
    """Nor by one from before it, which waits; a scan of another sensor says nothing of this one."""
    one, rest = pilot(), np.zeros(2)
    one.hear_scan(scan([], lambda _: rest, 10**9))
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    one.hear_goal(sliding.posed(1.8, 0.0))
    one.hear_scan(scan([], lambda _: rest, 105 * 10**7))
    bad = scan([], lambda _: rest, 11 * 10**8, frame="rear" if of == "frame" else "lidar")
    vars(bad).update(BROKEN.get(of, {}))
    with pytest.raises(InputError, match="scan: "):
        one.hear_scan(bad)
    step = one.hear_pose(sliding.odometry(rest, rest, 12 * 10**8))
    assert one.memory.added == 105 * 10**7 and step.new == (of == "frame")
    assert step.new or "the last scan could not be used" in step.reason
    one.hear_scan(scan([], lambda _: rest, 13 * 10**8))
    one.hear_pose(sliding.odometry(rest, rest, 13 * 10**8))
    assert one.memory.added == 13 * 10**8 and not one.memory.stale


def test_a_scan_that_was_refused_before_the_first_pose_blocks_no_other_clock():
    one, rest = pilot(), np.zeros(2)
    bad = scan([], lambda _: rest, 10**18)
    bad.ranges = []
    with pytest.raises(InputError, match="scan: expected ranges from angle_min"):
        one.hear_scan(bad)
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    assert not one.memory.stale


def test_a_scan_that_raises_anything_is_not_tried_again(monkeypatch):
    """Every later pose raised again, so that nobody looked whether it is in its tube."""
    one, rest = pilot(), np.zeros(2)
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    one.hear_scan(scan([], lambda _: rest, 11 * 10**8))
    with monkeypatch.context() as broken:
        broken.setattr("sims.ros.memory.seen_in", lambda *_, **__: 1 / 0)
        one.hear_pose(sliding.odometry(rest, rest, 12 * 10**8))
    assert "a scan is not used: division by zero" in one.said and one.memory.stale
    one.hear_scan(scan([], lambda _: rest, 13 * 10**8))
    one.hear_pose(sliding.odometry(rest, rest, 13 * 10**8))
    assert not one.said and not one.memory.stale and one.seen.region.area > 50.0


@pytest.mark.soundness
def test_a_lidar_that_turns_keeps_being_used_while_what_is_old_is_forgotten():
    one, still, posts = pilot(age=2.0), lambda _: np.zeros(2), [shapely.box(1.5, -1.5, 1.6, -0.5)]
    posts += [shapely.Point(1.2, 1.0).buffer(0.1), shapely.Point(-1.0, 0.7).buffer(0.2)]
    person = shapely.Point(0.9, 0.0).buffer(0.2)
    for tenth in range(10, 60):
        at, yaw = tenth * 10**8, 0.4 * np.sin(0.05 * tenth)
        world = [*posts, person] if tenth > 56 else posts
        one.hear_scan(scan(world, still, at, heading=yaw))
        one.hear_pose(sliding.odometry([0, 0], [0, 0], at, yaw=yaw))
        assert "not used" not in one.said and not shapely.intersects(one.seen.region, world).any()


def test_no_plan_is_made_for_later_where_what_is_free_has_an_age():
    one, rest = pilot(age=1.0), np.zeros(2)
    one.hear_scan(scan([], lambda _: rest, 10**9))
    one.hear_pose(sliding.odometry(rest, rest, 10**9))
    with pytest.raises(InputError, match=r"what is free stays so \(age = 0\)"):
        one.plan(sliding.posed(0.0, 0.0), sliding.posed(0.4, 0.0), 0.1)


def test_scans_of_another_sensor_or_without_a_clock_are_refused():
    one, still = pilot(), lambda _: np.zeros(2)
    one.hear_scan(scan([], still, 10**9))
    with pytest.raises(InputError, match="frame of the scan is lidar, beside rear"):
        one.hear_scan(scan([], still, 10**9 + 1, frame="rear"))
    for each in (-1e-4, np.nan):
        with pytest.raises(InputError, match="time_increment of 0 s or more"):
            one.hear_scan(scan([], still, 10**9 + 1, each))


@pytest.mark.soundness
@pytest.mark.parametrize(("of", "taken"), [(2, False), (3, False), (1, True)])
def test_ranges_that_are_not_of_the_angles_are_refused(of, taken):
    """A filter kept every second one and the old increment: posts were seen at half their angle."""
    one, thinned = pilot(), scan([], lambda _: np.zeros(2), 10**9)
    thinned.ranges = thinned.ranges[::of]
    if taken:  # drivers tell the last beam, or where the next one would be
        for at, more in enumerate((0.0, 1.0, -1.0), 1):
            thinned.header = sliding.header(at * 10**9, "lidar")
            thinned.angle_max = np.float32(ANGLES[-1] + more * thinned.angle_increment)
            one.hear_scan(thinned)
        return
    with pytest.raises(InputError, match="scan: expected ranges from angle_min"):
        one.hear_scan(thinned)
    thinned.angle_increment *= of
    one.hear_scan(thinned)


def test_a_scan_that_lies_ahead_does_not_wait_until_the_robot_is_elsewhere():
    """Nine of nine robots drove into a wall that they had seen from another place."""
    one, at, rest = pilot(), 10**9, np.zeros(2)
    one.hear_pose(sliding.odometry(rest, rest, at))
    with pytest.raises(InputError, match=r"no more than 1\.0 s after .*; got 4\.0 s"):
        one.hear_scan(scan([], lambda _: rest, 5 * at))
    early = pilot()  # before the first pose nothing tells what now is
    early.hear_scan(scan([], lambda _: rest, 5 * at))
    early.hear_pose(sliding.odometry(rest, rest, at))
    early.hear_pose(sliding.odometry(rest, rest, 6 * at))
    assert early.memory.added is None and one.memory.added is None
    early.hear_scan(scan([], lambda _: rest, 6 * at))
    early.hear_pose(sliding.odometry(rest, rest, 61 * 10**8))
    assert early.memory.added == 6 * at


def test_a_pose_that_jumps_begins_nothing_and_drift_is_a_parameter():
    for drift, believed in ((0.0, False), (0.3, True)):
        one = pilot(drift=drift, margin=1.5)
        one.hear_goal(sliding.posed(2.5, 0.0))
        first = one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9)).committed
        place, speed = sliding.after(np.zeros(2), first.k, 4)
        step = one.hear_pose(sliding.odometry(place + np.array([0.0, 0.2]), speed, 10**9 + CYCLE))
        assert step.new == believed
        assert believed or "0.18 m beyond what tube, uncertainty and drift allow" in step.reason


@pytest.mark.soundness
@pytest.mark.parametrize("there", [(40.0, 0.0), (2.5, 0.0)])
def test_a_pose_that_jumps_out_of_what_is_known_or_onto_the_goal_is_told_of(there):
    """Also where nothing could begin for another reason, or nothing has to."""
    one = pilot()
    one.hear_goal(sliding.posed(2.5, 0.0))
    first = one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9)).committed
    step = one.hear_pose(sliding.odometry(there, [0, 0], 10**9 + CYCLE))
    assert step.left and not step.new and "beyond what tube" in step.reason
    told = episode_part(one.driven, assumed=one.premises)["premises"]
    left = next(value for name, _, value in told if name == "TUBE_LEFT")
    assert left[0].startswith("manoeuvres[0], by ") and first.seen_outside


@pytest.mark.soundness
def test_an_older_scan_does_not_take_away_who_came_since():
    one, person = pilot(), shapely.Point(1.0, 0.0).buffer(0.2)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    empty = scan([], lambda _: np.zeros(2), 10**9)
    one.hear_scan(empty)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9 + CYCLE))
    one.hear_scan(scan([person], lambda _: np.zeros(2), 10**9 + CYCLE))
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9 + 2 * CYCLE))
    for late in (empty, scan([], lambda _: np.zeros(2), 10**9 + CYCLE)):
        with pytest.raises(InputError, match="scan: expected stamps that increase"):
            one.hear_scan(late)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9 + 3 * CYCLE))
    assert not one.seen.region.intersects(person)


@pytest.mark.soundness
def test_what_a_person_looked_at_is_around_the_robot_and_not_around_its_measured_pose():
    """The robot truly stands 0.1 m to the right, and 0.15 m around it were looked at."""
    one = pilot(margin=0.15, uncertainty_start=0.1)
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    looked = shapely.Point(0.1, 0.0).buffer(RADIUS + 0.15, quad_segs=64)
    assert not one.seen.region.is_empty and looked.contains(one.seen.region)


@pytest.mark.soundness
def test_what_was_seen_is_remembered_less_where_the_frame_drifts():
    """Truly free places are those of the first scan, 0.1 m aside of where they are told now."""
    one, walls = pilot(drift=0.1), [shapely.box(1.5, -3.0, 1.6, 3.0)]
    one.hear_goal(sliding.posed(3.0, 0.0))
    one.hear_scan(scan(walls, lambda _: np.zeros(2), 10**9))
    assert one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9)).new
    assert one.seen.region.area > 4.0
    assert not one.seen.region.intersects(shapely.box(1.41, -3.0, 1.6, 3.0))


@pytest.mark.soundness
def test_a_frame_that_turns_loses_more_of_what_is_far_away():
    """Nobody lost anything by a turn of 0.1 rad: 1.5 m away it is 0.15 m."""
    one, walls = pilot(drift_heading=0.1), [shapely.box(1.5, -3.0, 1.6, 3.0)]
    one.hear_goal(sliding.posed(3.0, 0.0))
    one.hear_scan(scan(walls, lambda _: np.zeros(2), 10**9))
    assert one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9)).new
    assert not one.seen.region.intersects(shapely.box(1.36, -3.0, 1.6, 3.0))
    assert one.drift == pytest.approx(0.1 * np.linalg.norm(one.outline.corners, axis=1).max())


CHANGED = {
    "frame": "odom",
    "noise": 0.011,
    "width": 0.16,
    "margin": 0.31,
    "age": 5.0,
    "sensor": (0.0, 0.0, 0.01),
    "uncertainty_start": 0.001,
    "uncertainty_heading": 0.002,
    "drift": 0.003,
    "drift_heading": 0.004,
    "acceleration": 3.1,
    "acceleration_turning": 6.1,
    "mover_radius": 0.4,
}


@pytest.mark.parametrize("name", CHANGED)
def test_all_that_a_manoeuvre_rests_on_is_in_its_sentence_and_in_the_file(name):
    one, other = pilot(), pilot(**{name: CHANGED[name]})
    one.hear_goal(sliding.posed(2.5, 0.0))
    one.hear_scan(scan([], lambda _: np.zeros(2), 10**9))
    step = one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    said = one.statement(step)
    assert other.statement(step) != said and other.premises != one.premises
    assert all(f"{name}: {value}" in said for name, value in one.premises.items())
    assert (
        "nothing is touched. Assumed: that it rests at its end, where its prediction moves by"
        in said
    )
    assert "all that the body can touch at any height crosses the plane of the lidar" in said
    for words in (
        "a body (point 0 grown by 0.2 m) among",
        "its measured start is exact: ",
        "; the last scan is 0.0 s older. (E)",
        "whose pose it is: of the frame 'base_link'; that it is the model's first reference point",
    ):
        assert words in said
    told = episode_part(one.driven, assumed=one.premises)["premises"]
    assert all([name, "assumed", value] in told for name, value in one.premises.items())
    one.loop.given = ()  # both doors, of manoeuvres and of plans, say it
    start = "its start is not measured: each manoeuvre begins as the model's runs did"
    assert start not in said and start in one.statement(step) and start in one.assumed


def test_stairs_on_a_map_are_no_obstacle_beside_a_lidar_and_the_statement_says_so():
    words, rest = "a map only guides: what stands on it alone is no obstacle", np.zeros(2)
    one = pilot()
    one.hear_map(sliding.map_of(sliding.hall([(0.5, -1.4, 1.4, 1.4)])))
    one.hear_goal(sliding.posed(2.5, 0.0))
    one.hear_scan(scan([], lambda _: rest, 10**9))
    step = one.hear_pose(sliding.odometry(rest, rest, 10**9))
    assert step.new and words in one.statement(step)
    assert words not in Driving(leave=0.4, given=GIVEN).premises["what stands"]


def test_what_was_not_seen_for_its_age_is_not_free_any_more_but_where_the_body_stands():
    """A first scan sees all; later ones see only half; no place stays for longer than 2 s."""
    one, half, still = pilot(age=2.0), shapely.box(-0.5, 0.5, 0.5, 0.6), lambda _: np.zeros(2)
    aside = shapely.Point(0.0, 1.5)
    for tenth in range(10, 32):
        one.hear_scan(scan([half] if tenth > 10 else [], still, tenth * 10**8))
        one.hear_pose(sliding.odometry([0, 0], [0, 0], tenth * 10**8))
        if tenth == 10:
            assert one.seen.region.contains(aside)
    assert not one.seen.region.intersects(aside)
    for tenth in (41, 52):  # no scan any more
        assert one.seen.region.area > 10.0
        one.hear_pose(sliding.odometry([0, 0], [0, 0], tenth * 10**8))
    body = shapely.Polygon(one.outline.corners)
    assert body.buffer(1e-6).contains(one.seen.region) and one.seen.region.area > 0.9 * body.area


def seen_after(second):
    """The free space after a scan and this one, between poses of a robot that drives."""
    one = pilot()
    one.hear_goal(sliding.posed(2.5, 0.0))
    one.hear_scan(scan([], lambda _: np.zeros(2), 10**9))
    one.hear_pose(sliding.odometry([0, 0], [0, 0], 10**9))
    one.hear_scan(second)
    for i in range(1, 9):
        one.hear_pose(sliding.odometry([0.02 * i, 0], [0.2, 0], (10 + i) * 10**8))
    return one.seen.region


NEXT = {
    "header": lambda _: sliding.header(11 * 10**8, "other"),
    "angle_min": lambda x: x + 0.1,
    "angle_max": lambda x: x - 0.1,
    "angle_increment": lambda x: 0.9 * x,
    "time_increment": lambda _: 1e-3,
    "range_min": lambda _: 0.2,
    "range_max": lambda _: 7.0,
    "ranges": lambda x: np.minimum(x, 1.5),
}


@pytest.mark.parametrize("field", vars(scan([], lambda _: np.zeros(2), 0)))
def test_a_scan_and_the_next_agree_in_every_field_or_free_something_else(field):
    """One without a rule fails."""
    second = scan([], lambda _: np.zeros(2), 11 * 10**8)
    before = seen_after(second)
    setattr(second, field, NEXT[field](getattr(second, field)))
    try:
        after = seen_after(second)
    except InputError as error:
        agree = "of the sensor whose place was told: expected premises that agree"
        assert agree in str(error) or "scan: expected ranges from angle_min" in str(error)
    else:
        assert field in ("ranges", "time_increment") and not after.equals(before)


def test_those_who_move_are_told_with_their_speed():
    slow, fast = (pilot(mover_radius=0.3, mover_speed=speed) for speed in (0.5, 0.6))
    assert slow.premises["who moves"] != fast.premises["who moves"]


def test_poses_as_fast_as_they_come_locate_scans_that_come_late():
    """The last 256 poses of 1 kHz were younger than each scan, so that nothing ever began."""
    one, rest, told = pilot(), np.zeros(2), scan([], lambda _: np.zeros(2), 0, 0.1 / 360)
    for at in range(10**9, 1_900_000_000, 10**6):
        begun = at - 280_000_000
        if begun % 10**8 == 0 and begun > 10**9:
            told.header = sliding.header(begun, "lidar")
            one.hear_scan(told)
        one.hear_pose(sliding.odometry(rest, rest, at))
        assert "older than all poses" not in one.said
    assert one.memory.added == 16 * 10**8


def test_what_a_person_looked_at_is_not_forgotten_as_of_before():
    """Between a restart and the next pose a pause was longer than `age`."""
    areas = []
    for pause in (10**8, 25 * 10**8):
        one, rest = pilot(age=1.0), np.zeros(2)
        one.hear_pose(sliding.odometry(rest, rest, 10**9))
        one.restart()
        one.hear_pose(sliding.odometry(rest, rest, 10**9 + pause))
        areas.append(one.seen.region.area)
    assert areas[0] == areas[1] > 0.2
