"""A pilot among discs that move: wherever they go within their bound, nobody is touched while a
manoeuvre is under way, and what is not known of them begins nothing.
"""

import functools
import json

import numpy as np
import pytest
import sliding
from compilations import compiled_by
from needs import need
from toy_models import told

from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.episode_file import episode_part
from sims.driving import Driving
from sims.pilot import Pilot
from sims.ros.measured import Movers, among

need("shapely")
RADIUS, SPEED = 0.2, 0.3  # [m], [m/s] of who moves
ROBOT = 0.2  # [m]
CYCLE, KNOT = 400_000_000, 100_000_000  # [ns]
GOAL = np.array([3.2, 0.3])


def discs(*places, at=10**9, frame="map"):
    poses = [sliding.pose(*place) for place in places]
    return sliding.Some(header=sliding.header(at, frame), poses=poses)


def driving(**asked):
    given = ("twist.twist.linear.x", "twist.twist.linear.y")
    known = {"leave": 0.4, "given": given, "arrived": 0.4}
    return Driving(**(known | {"mover_radius": RADIUS, "mover_speed": SPEED} | asked))


@functools.cache
def model():
    return told(sliding.model(), given=(0, 1))


def pilot(**asked):
    one = Pilot(model(), ROBOT, driving(**asked), clock=lambda: 0.0)  # the world waits for it
    one.hear_map(sliding.map_of(sliding.hall()))
    one.hear_goal(sliding.posed(*GOAL))
    return one


def test_who_chases_the_robot_touches_it_under_way_nowhere_and_all_is_proved():
    one = pilot()
    place, speed, at = np.zeros(2), np.zeros(2), 10**9
    mover = before = np.array([1.6, 0.9])
    begun, knots, nearest = place, 13, np.inf
    while at < 20 * 10**9:
        one.hear_movers(discs(before, at=at - KNOT))  # told late: not where it is by now
        step = one.hear_pose(sliding.odometry(place, speed, at))
        if step is None:
            break
        begun, knots = (place, 0) if step.new else (begun, knots)
        for _ in range(4):
            towards = (place - mover) / np.linalg.norm(place - mover)
            before, mover = mover, mover + SPEED * sliding.DT * towards
            knots += 1
            place, speed = sliding.after(begun, step.committed.k, knots)
            if knots <= 12:
                nearest = min(nearest, np.linalg.norm(place - mover) - RADIUS - ROBOT)
        at += CYCLE
    assert np.linalg.norm(place - GOAL) <= 0.4 and 0 < nearest < 0.6
    report = checker.check_episode(json.loads(json.dumps(episode_part(one.driven))), allowance_of)
    assert report.manoeuvres == len(one.driven) >= 4
    assert all(any(driven.asked.problem.all_spans) for driven in one.driven)


def test_nothing_is_begun_before_all_are_told_or_where_they_may_be():
    one = pilot()
    at = 10**9

    def stepped(seconds, place=(0, 0), speed=(0, 0)):
        step = one.hear_pose(sliding.odometry(place, speed, at + round(seconds * 1e9)))
        return step.committed, step.reason

    assert stepped(0) == (None, "nobody has said yet where those are who move")
    one.hear_movers(discs((0.1, 0.1), at=at))
    assert "who moves may be where the robot is" in stepped(0.1)[1]
    one.hear_movers(discs((1.5, 1.0), at=at))
    assert stepped(5)[1] == "where those are who move was last said 5.0 s ago"  # who came since?
    one.hear_movers(discs((0.4, 0.1), at=at + 5 * 10**9))  # 1.1 s at 0.3 m/s, and the radius
    assert "seen 1 s apart from its pose, within 0.5301 m when" in stepped(6)[1]
    with pytest.raises(InputError, match="movers: expected a stamp of the clock of poses"):
        one.hear_movers(discs(at=at + 8 * 10**9))  # it would be told as new by then
    one.hear_movers(discs(at=at + 6 * 10**9))  # nobody is there
    committed, reason = stepped(6.5)
    assert "who moves was told 0.5 s before, and nobody has come since" in one.assumed
    assert committed is not None and not reason and not any(committed.asked.problem.all_spans)
    one.hear_movers(discs((2.5, 1.0), at=at + 7 * 10**9))
    with pytest.raises(InputError, match="movers: expected stamps that do not fall"):
        one.hear_movers(discs(at=at))
    there = sliding.after(np.zeros(2), committed.k, 5)
    assert compiled_by(lambda: stepped(7, *there)) == 0 and len(one.driven) == 2
    assert any(one.driven[1].asked.problem.all_spans)


@pytest.mark.soundness
def test_who_moves_is_told_anew_after_a_restart():
    one, rest = pilot(), np.zeros(2)
    one.hear_movers(discs((2.5, 1.0)))
    assert one.hear_pose(sliding.odometry(rest, rest, 10**9)).new
    one.hear_pose(sliding.odometry(rest, rest, 22 * 10**8))
    one.restart()
    step = one.hear_pose(sliding.odometry(rest, rest, 23 * 10**8))
    assert step.reason == "nobody has said yet where those are who move"
    one.hear_movers(discs((2.5, 1.0), at=23 * 10**8))
    assert one.hear_pose(sliding.odometry(rest, rest, 24 * 10**8)).new


@pytest.mark.soundness
def test_outlines_hold_every_disc_wherever_it_goes_and_who_is_far_away_is_none():
    draw = np.random.default_rng(2)
    time, d, pose = model().time, driving(reach=2.0), np.zeros(3)
    far = 2.0 + RADIUS + SPEED * (time.t_f + 0.5 + d.deadline)
    places = np.concatenate([draw.uniform(-2.4, 2.4, (6, 2)), [[far + 0.01, 0.0]]])
    places = places[np.abs(places).max(axis=1) > 0.5]
    obstacles, spans = among(Movers(10**9, places), (), pose, 15 * 10**8, d, time, 0.5)
    each = len(obstacles) // (len(places) - 1)
    assert [t for a, b in spans[:each] for t in range(a, b + 1)] == list(range(time.n_steps))
    angles = np.linspace(0, 2 * np.pi, 33)
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for i, (part, (_, last)) in enumerate(zip(obstacles, spans, strict=True)):
        # told half a second before a manoeuvre that begins as late as it may
        reach = RADIUS + SPEED * (0.5 + d.deadline + (last + 1) * time.dt)
        rim = places[i // each] + reach * around
        assert (rim @ part.A.T <= part.b).all()
        assert (rim @ part.A.T > part.b - 2e-9).any()
    near = Movers(10**9, np.array([[far - 0.01, 0.0]]))
    assert len(among(near, ("wall",), pose, 15 * 10**8, d, time, 0.5)[0]) == 1 + each


def drifted(place, robot, off, turned):
    """A place (2,) in a frame that has drifted: the robot, now told at `robot`, was told `off`."""
    c, s = np.cos(turned), np.sin(turned)
    return robot + np.array([[c, -s], [s, c]]) @ (place - (robot + off))


@pytest.mark.soundness
def test_outlines_hold_every_disc_wherever_the_frame_has_drifted():
    """60 robots of a frame that drifts 6 cm touched 20 movers, who were where they were told."""
    draw, time = np.random.default_rng(3), model().time
    d = driving(sensor=(0.0, 0.0, 0.0), drift=0.06, drift_heading=0.04, mover_speed=0.0)
    robots = [np.array([-0.5, 0.3]), np.zeros(2)]
    for drifts in (robots[1:], robots):
        for place in draw.uniform(0.8, 2.0, (20, 2)):
            told = Movers(10**9, place[None])
            (disc, *_), _ = among(told, (), np.zeros(3), 10**9, d, time, 0.0, drifts)
            reached = []
            for angle in np.linspace(0, 2 * np.pi, 65):
                for turned in (-d.drift_heading, d.drift_heading):
                    there, off = place, d.drift * np.array([np.cos(angle), np.sin(angle)])
                    for robot in drifts:
                        there = drifted(there, robot, off, turned)
                    reached.append(disc.A @ there + RADIUS - disc.b)
            assert -0.05 < np.max(reached) <= 0.0


@pytest.mark.soundness
@pytest.mark.parametrize(("told", "drifts"), [(12 * 10**8, 1), (9 * 10**8, 2)])
def test_who_moves_may_be_off_by_each_drift_since_it_was_told(told, drifts):
    off = {"sensor": (0.0, 0.0, 0.0), "drift": 0.05, "margin": 3.0, "mover_speed": 0.0}
    one, rest, place = pilot(**off), np.zeros(2), (1.5, 1.2)
    one.hear_goal(sliding.posed(*GOAL))
    one.hear_movers(discs(place, at=9 * 10**8))
    first = one.hear_pose(sliding.odometry(rest, rest, 10**9))
    assert first.new
    one.hear_movers(discs(place, at=told))
    step = one.hear_pose(sliding.odometry(*sliding.after(rest, first.committed.k, 4), 14 * 10**8))
    assert "no faster than 0.0 m/s, for the 0.1 s of a step in between too" in one.statement(step)
    asked = step.committed.asked.problem
    pairs = zip(asked.obstacles, asked.all_spans, strict=True)
    disc = next(one for one, span in pairs if span is not None)
    assert step.new and np.max(disc.b - disc.A @ place) == pytest.approx(RADIUS + drifts * 0.05)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (discs((0, 0), frame="odom"), "movers: expected one in the frame 'map'"),
        (discs((np.nan, 0)), "movers: expected finite places with a stamp"),
        (sliding.Some(header=sliding.Some(frame_id="map"), poses=[]), "with a stamp"),
    ],
)
def test_what_cannot_be_meant_changes_nothing(message, words):
    one = pilot()
    one.hear_movers(discs((2.0, 1.0)))
    before = one.movers
    with pytest.raises(InputError, match=words):
        one.hear_movers(message)
    assert one.movers is before


def test_where_somebody_moves_sizes_are_told_and_no_plan_is_made_for_later():
    with pytest.raises(InputError, match="set mover_radius"):
        pilot(mover_radius=0.0, mover_speed=0.0).hear_movers(discs((2.0, 1.0)))
    with pytest.raises(InputError, match="mover_radius: expected above 0 m"):
        driving(mover_radius=0.0)
    with pytest.raises(InputError, match="mover_speed: expected 0 or more"):
        driving(mover_speed=np.nan)
    with pytest.raises(InputError, match="plan: expected a place where nobody moves"):
        pilot().plan(sliding.posed(0, 0), sliding.posed(0.4, 0.1), 0.1)
