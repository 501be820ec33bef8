"""TPCAP's cases: the car keeps the competition's limits, broken cases are named, a case is parked
and its file accepted; at night all of them.
"""

import json
import re
import runpy
import shutil
import sys
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import jax
import numpy as np
import pytest
import shapely
from matplotlib.figure import Figure

import parc_jax as pj
from parc_jax.app import cli
from parc_jax.app.cli import check as second
from parc_jax.drive.loop.episode_file import load_episode
from parc_jax.learning.runs.law import law_of
from parc_jax.safe_set.verdict.outline import require_same
from sims.parking import (
    again,
    ahead,
    car,
    cases,
    drive,
    guide,
    kinematics,
    known,
    last,
    polish,
    predict,
    prove,
    quicker,
    rehearse,
    shortest,
    slot,
    space,
    turned,
)
from sims.parking.drive import Parked
from sims.parking.film import sheet
from sims.parking.job import Options, job, park, park_all
from sims.parking.way import Way, lasts
from tests.helpers.compilations import compiled_by

FAR = [[[20.0, 0.0], [21.0, 0.0], [21.0, 1.0]]]
REST = [0.0, 0.0, 0.0]


def test_the_car_keeps_the_limits_and_comes_to_rest():
    system = car.system()
    lo, hi = np.asarray(system.domain.lo), np.asarray(system.domain.hi)
    k = np.random.default_rng(0).uniform(lo, hi, (200, 5)).astype(np.float32)
    k[:100, 1] *= car.STANDS  # from rest
    states = np.asarray(
        jax.jit(jax.vmap(system.states))(jax.random.split(jax.random.PRNGKey(0), 200), k)
    )
    times = np.array([car.moments(one) for one in k])
    seconds = np.diff(times, axis=1)
    assert (seconds[:, car.EVERY :] > 0).all() and (seconds >= 0).all()
    assert (seconds[:100, : car.EVERY] > 0).all()  # only a car that rolls begins at once
    speed, wheels = states[..., 3], states[..., 4]
    assert speed.max() <= car.SPEED and np.abs(wheels).max() <= car.STEERING
    assert (np.abs(np.diff(speed, axis=1)) <= car.ACCELERATION * seconds + 1e-3)[
        :, : -car.EVERY
    ].all()
    assert (np.abs(np.diff(wheels, axis=1)) <= car.RATE * seconds + 1e-4).all()
    assert np.abs(speed[:, -1]).max() < 0.01  # [m/s] at rest
    # the way that was asked for, give or take what differs between runs
    driven = np.linalg.norm(np.diff(states[..., :2], axis=1), axis=2).sum(axis=1)
    assert np.abs(driven - np.abs(car.asked_of(k.T)[0])).max() < 0.1


def test_the_clock_of_a_plan_is_that_of_its_speeds():
    draw = np.random.default_rng(0)
    begins = draw.uniform(0.0, car.SPEED, 200)
    way = car.stopping(begins) + draw.uniform(0.05, 6.0, 200)
    plan = car.plan_of(way, draw.uniform(-1.2, 1.2, 200), begins)
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    at, speed = car.passes(plan, share * way)
    assert np.abs(at[[0, -1]] - [np.zeros(200), plan.lasts]).max() < 1e-9
    assert np.abs(speed[[0, -1]] - [begins, np.zeros(200)]).max() < 1e-6
    passed, mean = np.diff(at, axis=0), 0.5 * (speed[1:] + speed[:-1])
    assert (passed >= 0).all() and np.abs(passed * mean - way / 2000).max() < 1e-3
    assert (np.abs(np.diff(speed, axis=0)) <= car.PLANNED * passed + 1e-9).all()


def test_what_is_asked_is_what_the_model_has():
    """Ways in metres, at a speed, and back."""
    k = np.random.default_rng(0).uniform([4.0, -1, -1], [7.7, 1, 1], (100, 3))
    for begins in (0.0, 0.6, 2.3):
        for way in (k, k * [-1, 1, 1]):
            start = car.start_of(begins) if begins else 0.0
            all_of_k = np.column_stack(
                [np.tile([0.1, start], (100, 1)), predict.asked(way, begins)]
            )
            assert np.abs(predict.told(all_of_k) - way).max() < 1e-9
            assert np.abs(car.asked_of(all_of_k.T)[0] - way[:, 0]).max() < 1e-9
            assert np.abs(car.asked_of(all_of_k.T)[3] - begins).max() < 1e-9


def test_wheels_that_are_turned_first_are_so_for_a_share_of_all_starts():
    first = car.asked_of(np.array([0.3, car.AT_REST, -0.5, 0.8, 0.1]))
    for start in (0.0, 0.07, car.TURNED):
        assert car.asked_of(np.array([0.3, start, -0.5, 0.8, 0.1])) == first
    assert first[4] == 1.0 and car.asked_of(np.array([0.3, car.STANDS, -0.5, 0.8, 0.1]))[4] == 0.0


def test_a_way_is_told_finer_where_it_is_short():
    ways = np.linspace(-car.WAY, car.WAY, 401)
    told = car.told_of(ways)
    assert np.abs(car.way_of(told) - ways).max() < 1e-9
    assert np.abs(car.way_of(told.astype(np.float32)) - ways).max() < 1e-5
    compiled = np.asarray(jax.jit(car.way_of)(told.astype(np.float32)))
    assert np.abs(compiled - ways).max() < 1e-5
    assert car.told_of(0.2) == 0.25 and car.told_of(car.WAY) == 1.0


def test_its_model_is_of_the_car_as_it_is():
    model, system = predict.model(), car.system()
    require_same(system, model)
    assert model.claim.law == law_of(system) and model.claim.kind == "pac"
    assert predict.MODEL.stat().st_size < 3_000_000
    # [m] at rest, of the rear axle
    rest = model.tube.bins_of(
        np.random.default_rng(0).uniform([-0.7, 0, -1, -1, -1], [0.7, 0.2, 1, 1, 1], (400, 5))
    )
    assert np.median(np.linalg.norm(model.tube.final[rest[:, 0], :2], axis=1)) < 0.04
    # and where there is no room, of the corners
    most = kinematics.MOST
    k = np.random.default_rng(0).uniform([0.0, -most, -most], [0.19, most, most], (200, 3))
    for way in (k, k * [-1, 1, 1]):
        assert predict.tube_of(model, way)[1][:, : model.n_c].max() < 0.026


def test_how_often_what_was_driven_leaves_its_tube_is_counted():
    model = predict.model()
    k = np.array([[0.0, 0.1, 0.5, 0.2, -0.4], [0.3, 0.7, -0.7, 0.8, 0.1]])
    assert (again.shares_left(model.net, model.tube, k, 50, 0) < 0.05).all()
    # of a tube a hundredth as wide nearly all are left
    thin = model.tube.with_halves(*(0.01 * half for half in model.tube.halves))
    assert (again.shares_left(model.net, thin, k, 50, 0) > 0.9).all()


@pytest.mark.parametrize(
    ("start", "goal", "obstacles", "words"),
    [
        (REST, [8.0, 0.0, 0.0], [[[3.0, -1], [4, -1], [4, 1], [3, 1]]], "start .* obstacle 0"),
        (REST, [8.0, 0.0, 0.0], [*FAR, [[9.0, -1], [10, -1], [10, 1]]], "goal .* obstacle 1"),
        (REST, [8.0, 0.0, 0.0], [[[20.0, 0], [21, 1], [21, 0], [20, 1]]], "obstacle 0 is broken"),
        (REST, [8.0, 0.0, 0.0], [[[20.0, 0], [21, 1]]], "obstacle 0 is broken: not 3 or more"),
        (REST, [8.0, 0.0, 0.0], [[["a", 0], [21, 1], [20, 1]]], "obstacle 0 is broken: not 3"),
        (REST, [8.0, np.nan, 0.0], FAR, "a start and a goal"),
        (REST, [800.0, 0.0, 0.0], FAR, "a goal within 200 m"),
    ],
)
def test_a_broken_case_is_named(start, goal, obstacles, words):
    with pytest.raises(pj.InputError, match=words):
        cases.case_of("here", start, goal, obstacles)


def test_an_unknown_case_is_named():
    with pytest.raises(pj.InputError, match=r"expected one of 1, 2, .*; got 3"):
        cases.case(3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "expected a JSON file of cases"),
        ('{"first": {}}', "by their numbers"),
        ('{"1": {"start": [0, 0, 0], "goal": 3, "obstacles": []}}', "lists named start, goal"),
        (
            '{"1": {"start": [0, 0, 0], "goal": [9, 0, 0], "obstacles": [[[20, 0], [21, 1]]]}}',
            "case 1: expected polygons; obstacle 0 is broken",
        ),
    ],
)
def test_a_broken_file_of_cases_is_named(tmp_path, text, words):
    place = tmp_path / "cases.json"
    place.write_text(text)
    with pytest.raises(pj.InputError, match=words):
        park(1, Options(file=place, out=tmp_path))


def test_a_goal_behind_walls_is_named():
    wall = [[[4.0, -30], [4.3, -30], [4.3, 30], [4, 30]]]  # the grid around both ends before it
    start, goal = [-4.0, 0, 0], [8.0, 0, 0]
    with pytest.raises(pj.InputError, match=r"here: expected a goal that the car can reach"):
        guide.Guide(cases.case_of("here", start, goal, wall))
    door = [[*wall[0][:2], [4.3, -2], [4, -2]], [[4, 2], [4.3, 2], *wall[0][2:]]]
    guide.Guide(cases.case_of("here", start, goal, door))


def test_the_judge_sees_a_contact_between_records():
    case = cases.case_of("here", REST, [8.0, 0.0, 0.0], [[[4.5, 0.97], [4.6, 2.0], [4.4, 2.0]]])
    path = np.array([REST, [8.0, 0.0, 0.0]])  # neither the first nor the last pose is at 4.5 m
    assert drive.judged(case, path) == 0.0
    assert drive.judged(case, path - [0.0, 0.5, 0.0]) == pytest.approx(0.499, abs=1e-6)


def test_a_case_that_is_turned_is_the_same_seen_from_its_start():
    case = cases.case(5)
    for mirrored, side in ((False, [1.0, 1.0, 1.0]), (True, [1.0, -1.0, -1.0])):
        other = turned.turned(case, 13.0, mirrored)
        seen = kinematics.offset_from(other.start, other.goal)
        assert seen == pytest.approx(side * kinematics.offset_from(case.start, case.goal))
        ends, there = np.stack([case.start, case.goal]), np.stack([other.start, other.goal])
        assert drive.judged(other, there) == pytest.approx(drive.judged(case, ends))


@pytest.mark.parametrize("more", [0.01, -0.01])
def test_a_gap_of_one_stroke_is_left_at_full_steering_and_no_shorter_one(more):
    case = shortest.street(shortest.one_stroke() + more)
    radius, turned = car.WHEELBASE / np.tan(car.STEERING), np.linspace(0.0, 1.2, 500)
    back = 0.5 * (shortest.one_stroke() + more - car.LENGTH) - 0.001  # from the middle of the gap
    along = [radius * np.sin(turned) - back, radius * (1 - np.cos(turned)), turned]
    path = kinematics.compose(case.goal, np.stack(along, axis=1))
    assert (drive.judged(case, path) > 0) == (more > 0)


def test_a_way_of_the_guide_leads_from_the_start_to_the_goal():
    case = cases.case(5)
    way = guide.Guide(case).search()
    pose = case.start
    for k, end, upto in zip(way.k, way.poses[1:], way.upto, strict=True):
        pose = kinematics.compose(pose, kinematics.ends(k[None], 1, upto)[0, 0])
        assert np.abs(kinematics.offset_from(pose, end)).max() < 0.02
    assert np.abs(kinematics.offset_from(pose, case.goal)).max() < 0.1


def test_a_way_is_made_quicker_and_is_still_clear():
    model = predict.model()
    case = cases.case(1)
    searcher = guide.Guide(case, known.Learned(case, model))
    quick, found = searcher.search(), searcher.first(case.start)
    assert lasts(quick, 0.0) < lasts(found, 0.0) - 1.0  # [s]
    pose = case.start
    widths = predict.tube_of(model, quick.k)[0]
    for k, width, upto in zip(quick.k, widths, quick.upto, strict=True):
        poses = kinematics.compose(pose, kinematics.ends(k[None], 40)[0])
        assert drive.judged(case, poses) > min(width, 0.1)  # its stop included
        pose = kinematics.compose(pose, kinematics.ends(k[None], 1, upto)[0, 0])
    assert np.abs(kinematics.offset_from(pose, case.goal)).max() < 0.02


def test_a_way_that_the_car_cannot_roll_along_ends_at_rest_where_it_was_left():
    """The wheels of the second are turned against those of the first."""
    room, model = space.Space(cases.case_of("here", REST, [9.0, 0.0, 0.0], FAR)), predict.model()
    for then, rolls in (([4.0, 0.5, 0.1], True), ([4.0, -0.8, -0.8], False)):
        k = np.array([[5.0, 0.0, 0.5], then])
        first = kinematics.ends(k[:1], 1, kinematics.UPTO)[0, 0]
        poses = np.array([REST, first, kinematics.compose(first, kinematics.ends(k[1:])[0, 0])])
        way = Way(k, poses, np.array([True, False]))

        def tried(*at):
            return rehearse.aimed(model, room, *at)

        seen, fails, takes = rehearse.mended(way, prove.Moving(poses[0]), model, tried)
        assert not fails or not rolls
        assert abs(takes - lasts(seen, 0.0)) < 0.2  # [s]
        assert seen.rolls_on.tolist() == [rolls, False]
        there = kinematics.ends(seen.k[:1], 1, seen.upto[0])[0, 0]
        assert np.abs(there - first).max() < 1e-3  # [m], [rad]


def test_a_polished_way_rolls_where_it_rested_and_leads_where_it_led(monkeypatch):
    """Of three manoeuvres straight on, with a rest between each; it is proved nowhere here."""
    monkeypatch.setattr(polish, "SHORTLY", 12)
    monkeypatch.setattr(polish, "ROUNDS", 12)
    case = cases.case_of("here", REST, [9.0, 0.0, 0.0], FAR)
    learned, room = known.Learned(case, predict.model()), space.Space(case)
    poses = np.column_stack([[0.0, 3.0, 6.0, 9.0], np.zeros((4, 2))])
    way = Way(np.tile([3.0, 0.0, 0.0], (3, 1)), poses, np.zeros(3, bool))
    maker = polish.Polish(room, learned, case.start, 0.0)
    found = maker.polished(way, 0)
    assert not found.fails and found.way.rolls_on.any()
    assert found.takes < learned.mend(way, case.start, 0.0, room).takes - 1.0  # [s]
    pose, longest = case.start, 0.0
    for k, upto in zip(found.way.k, found.way.upto, strict=True):
        pose = kinematics.compose(pose, kinematics.ends(k[None], 1, upto)[0, 0])
        longest = max(longest, abs(k[0]))
    assert np.abs(kinematics.offset_from(pose, case.goal)).max() < 0.1  # [m], without lags
    assert longest <= kinematics.LONGEST
    # where it may not roll, or has too many manoeuvres, it is what it was
    assert not maker.polished(way, 0, rolling=False).way.rolls_on.any()
    monkeypatch.setattr(polish, "MOST_POLISHED", 2)
    assert maker.polished(way, 0).way.k.tolist() == way.k.tolist()


def test_a_way_that_rolls_on_passes_the_pose_where_it_rested():
    k = np.array([[-3.0, 0.5, 0.2], [-1.5, -0.3, 0.4]])
    first = kinematics.ends(k[:1])[0, 0]
    poses = np.array([REST, first, kinematics.compose(first, kinematics.ends(k[1:])[0, 0])])
    way = polish.rolled(Way(k, poses, np.zeros(2, bool)), 0)
    assert way.rolls_on.tolist() == [True, False]
    there = kinematics.ends(way.k[:1], 1, kinematics.UPTO)[0, 0]
    assert np.abs(there - first).max() < 1e-3  # [m], [rad]
    assert np.abs(way.stopped(0).k - k).max() < 1e-6


def test_a_chosen_stand_is_tried_first_and_longer_ones_after_it():
    now, k = prove.Moving(np.array(REST), wheels=-0.5), np.array([[1.0, 0.4, 0.4]])
    usual, chosen, least = (prove.starts_for(k, now, x) for x in (None, 0.1, 0.0))
    assert all(np.diff(found).max() < 0 for found in (usual, chosen, least))  # standing longer
    assert least[0] > chosen[0] > usual[0]
    assert usual[-1] == chosen[-1] == least[-1] == car.AT_REST


def test_a_last_manoeuvre_stands_no_longer_than_the_goal_asks_for():
    """Its wheels are turned far; with less of that before it drives it ends beside the middle."""
    case, k = cases.case(1), np.array([0.9, 0.0, -0.5])
    begin = kinematics.compose(case.goal, kinematics.ends(kinematics.backwards(k[None]))[0, 0])
    loop, now = prove.loop_of(), prove.Moving(begin, wheels=0.4)
    way = Way(k[None], np.array([begin, case.goal]), np.zeros(1, bool))
    started = []
    for goal in (prove.goal_of(case, begin), None):
        loop.restart()
        step = prove.link(loop, case.pieces, now, way, 0, goal, 0.0)
        assert step.new
        started.append(float(step.committed.k[1]))
    assert started[0] > started[1]  # the more, the less it stands


def test_a_last_manoeuvre_that_cannot_correct_all_still_ends_in_the_goal():
    """A stroke of 45 cm brings a car that is 3 cm beside its way back by no more than a few mm, and
    the goal has 10 cm on either side.
    """
    case, k = cases.case(1), np.array([0.45, 0.0, -0.46])
    begin = kinematics.compose(case.goal, kinematics.ends(kinematics.backwards(k[None]))[0, 0])
    pose = kinematics.compose(begin, np.array([0.0, 0.03, 0.03]))
    goal, loop = prove.goal_of(case, pose), prove.loop_of()
    loop.restart()
    way = Way(k[None], np.array([begin, case.goal]), np.zeros(1, bool))
    assert prove.link(loop, case.pieces, prove.Moving(pose), way, 0, goal, 0.0).new


@pytest.mark.parametrize("off", [(0.1, -0.09, -0.3), (-0.1, 0.04, -0.08), (0.2, -0.11, 0.0)])
def test_in_a_slot_strokes_to_and_fro_turn_the_car_and_move_it_sideways(off):
    """The slot is 50 cm longer than the car; a car that is turned by 0.3 rad has 11 cm in it."""
    case, loop, run = cases.case(7), prove.loop_of(), drive.black_box()
    loop.restart()
    around, pose, wheels, gear = case.pieces, kinematics.compose(case.goal, off), 0.0, 1.0
    there = slot.Slot(case, loop.model)
    path, last = [pose[None]], False
    for i in range(20):
        goal = prove.goal_of(case, pose)
        now = prove.Moving(pose, wheels)
        step, last = prove.shuffle(
            loop, around, now, gear, there, case, cases.GOAL, goal, i * loop.model.time.t_f
        )
        assert step.new
        k = step.committed.k
        states = np.asarray(run(jax.random.PRNGKey(i), k), np.float64)
        path.append(kinematics.compose(pose, states[1:, :3]))
        pose, wheels, gear = path[-1][-1], float(states[-1, 4]), -np.sign(k[2])
        if last:
            break
    assert last and drive.judged(case, np.concatenate(path)) > 0
    assert (np.abs(kinematics.offset_from(case.goal, pose)) <= [0.1, *cases.GOAL]).all()


def test_strokes_into_the_goal_are_found_where_the_best_single_one_leads_to_and_fro(monkeypatch):
    """Between the curb and the corner of the car in front: it has to come out again first."""
    monkeypatch.setattr(slot, "BEAMS", ((100, 30, 0.006),))
    case, path = cases.case(7), []
    pose = kinematics.compose(case.goal, np.array([0.24, -0.108, -0.476]))
    there, n = slot.Slot(case, predict.model()), 0
    assert there.alone(kinematics.compose(case.goal, np.array([0.1, -0.09, -0.3])), 1.0)
    assert not there.alone(pose, 1.0)
    strokes = np.concatenate([slot.strokes(1.0), slot.strokes(-1.0)])
    while (after := there.after(pose)) is not None:
        off = slot.apart(kinematics.compose(pose, kinematics.ends(strokes)[:, 0]), after)
        assert off.min() < 1e-4
        along = kinematics.ends(strokes[[off.argmin()]], 16)[0]
        path.append(np.concatenate([pose[None], kinematics.compose(pose, along)]))
        assert n or slot.wrong(case, after) > slot.wrong(case, pose)
        pose, n = after, n + 1
        there.driven()
    assert 5 < n <= 30 and drive.judged(case, np.concatenate(path)) > 0
    assert (np.abs(kinematics.offset_from(case.goal, pose)) <= [0.1, *cases.GOAL]).all()


def test_strokes_are_found_where_nothing_is_near():
    case = cases.case_of("here", REST, [8.0, 0.0, 0.0], [[[60.0, 0], [61, 0], [61, 1]]])
    assert slot.Slot(case, predict.model()).after(np.array([8.0, 0.1, 0.0])) is not None


def test_in_a_wider_goal_a_way_ends_where_it_suits():
    case, within = cases.case(1), (0.25, np.radians(5.0))
    told = known.Learned(case, predict.model(), within)
    way = guide.Guide(case, told).search()
    off = np.abs(kinematics.offset_from(case.goal, way.poses[-1]))
    assert (off <= np.array([0.15, 0.15, np.radians(3.0)]) + 1e-9).all()
    assert off.max() > 0.01
    # what is left of the goal there holds the tube of the last manoeuvre
    assert told.sure(way.k[-1:], way.poses[-1]).all()
    beside = kinematics.compose(case.goal, np.array([0.24, 0.0, 0.0]))
    assert not told.sure(way.k[-1:], beside).any()


@pytest.mark.parametrize("within", [(0.0, 2.0), (0.1, np.nan), (0.1, 90.0)])
def test_a_goal_of_no_size_is_named(within, tmp_path):
    with pytest.raises(pj.InputError, match="within: expected"):
        park_all(Options(case=(5,), within=within, out=tmp_path))


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_what_the_grid_says_is_clear_is_about_what_it_is(angle):
    case = cases.case(5)
    room = space.Space(case, angle)
    poses = np.random.default_rng(0).uniform([-8, -8, -4], [8, 8, 4], (400, 3)) + case.goal
    bodies = shapely.polygons(car.corners(*poses.T)[:, 1:])
    true = np.min([shapely.distance(bodies, shape) for shape in case.shapes], axis=0)
    told, exact = room.around(poses), room.around(poses, exact=True)
    assert (told <= true + space.CELL).all() and (true > 0).sum() > 100
    near = (true > 0.02) & (true < space.TIGHT / 2)
    assert near.sum() > 5 and np.abs(exact - true)[near].max() < 1e-9


def test_a_turned_car_is_farther_away_than_one_that_goes_straight_on():
    room = space.Space(cases.case_of("here", REST, [15.0, 0.0, 0.0], FAR))
    ways = room.ways_from(np.zeros(3))
    straight, about = room.takes(ways, np.array([[15.0, 0.0, 0.0], [15.0, 0.0, np.pi]]))
    assert 13.0 < straight < 17.0 and about > straight + 5.0


@pytest.mark.night
def test_a_chain_is_proved_for_all_places_that_the_one_before_may_leave(tmp_path, monkeypatch):
    """The file of each, for both checkers, states as its doubt what the one before leaves."""
    case, chain = cases.case(8), ahead.ahead(8)
    monkeypatch.delenv(second.VARIABLE, raising=False)
    left = [(0.0, 0.0), *zip(chain.place, chain.heading, strict=True)][:2]
    for one, (place, heading) in zip(chain.driven, left, strict=False):
        path = pj.drive.save_episode(tmp_path / "one.json", [one])
        file = json.loads(path.read_text())
        doubt = [float.fromhex(x) for x in file["doubt"]]
        assert doubt == [place, place, heading, 0.0] and len(load_episode(path).manoeuvres) == 1
        if shutil.which("node"):
            assert second.ask(second.find_second(), path).code == second.IN_PART
        assert file["copies"] == (3 if heading else 1)
    # the goal is too small for what the last but one may leave, which is said
    assert 1 < chain.proved < chain.links == 4
    assert len(chain.place) == len(chain.heading) == len(chain.driven) == chain.proved
    run = jax.jit(car.system().states)
    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    for i in range(1, chain.proved):
        most, ended = ([chain.place[j], chain.place[j], chain.heading[j]] for j in (i - 1, i))
        for n, start in enumerate(chain.poses[i] + most * corners):
            states = np.asarray(run(jax.random.PRNGKey(n), chain.driven[i].k), np.float64)
            path = kinematics.compose(start, states[:, :3])
            assert drive.judged(case, path) > 0
            assert (np.abs(path[-1] - chain.poses[i + 1]) <= ended).all()


@pytest.mark.night
def test_a_search_that_finds_nothing_begins_anew_with_cells_that_are_turned(monkeypatch):
    case, followed = cases.case(5), set()
    for angle in (0.0, 0.5, 1.0):
        monkeypatch.setattr(guide, "GREEDY", ((1.1, 1, False, 0.0), (1.1, 1000, False, angle)))
        searcher = guide.Guide(case)
        way = searcher.first(case.start)
        followed.add(guide.BUDGET - searcher.budget)
        path = [case.start[None]]
        for k in way.k:
            path.append(kinematics.compose(path[-1][-1], kinematics.ends(k[None], 40)[0]))
        assert np.abs(kinematics.offset_from(path[-1][-1], case.goal)).max() < 0.1
        assert drive.judged(case, np.concatenate(path)) > 0.03  # [m]
    assert min(followed) > 1 and len(followed) > 1  # other cells, other poses


def test_a_search_begins_at_all_poses_at_which_a_way_may_end():
    """That is where there is room. Some of them are in one cell."""
    case = cases.case(1)
    told, begun = known.Learned(case, predict.model(), (0.25, np.radians(5.0))), set()
    sure = told.sure
    told.sure = lambda k, aim, *more: begun.add(tuple(aim)) or sure(k, aim, *more)
    searcher = guide.Guide(case, told)
    assert searcher.first(case.start) is not None
    room = searcher.space
    fits = told.aims[room.around(told.aims) >= room.room(case.start)]
    assert begun == set(map(tuple, fits))
    assert len({guide.cell_of(one, False) for one in fits}) < len(fits)


def test_a_search_ends_within_its_budget():
    searcher = guide.Guide(cases.case(5))
    searcher.budget = 3
    assert searcher.search() is None and searcher.budget == 0


def test_another_search_looks_for_the_place_where_the_car_is():
    # close to the goal, far from the start of the case
    searcher = guide.Guide(cases.case(10))
    assert searcher.search([9.48, -22.78, -5.58]) is not None
    assert guide.BUDGET - searcher.budget < 500  # poses


@pytest.mark.parametrize(
    ("changed", "good"),
    [
        ({}, True),
        ({"proved": False}, False),
        ({"clearance": 0.0}, False),
        ({"left": True}, False),
        ({"reached": False, "why": "no plan"}, False),
    ],
)
def test_all_that_came_of_a_case_is_in_the_json_and_in_the_exit_code(
    changed, good, tmp_path, monkeypatch, capsys
):
    path = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    came = Parked(
        True, True, "", 0.1, 1, 0, 9.0, np.zeros(3), 1.0, 0.0, False, [], path, np.zeros(2)
    )
    one, module = replace(came, **changed), sys.modules[job.__module__]
    monkeypatch.setattr(module, "park", lambda number, _: (one, "| row |"))
    monkeypatch.setattr(module, "sheet", lambda *_: None)
    assert job(case=(8,), out=tmp_path, json=True) == int(not good)
    told = json.loads(capsys.readouterr().out)["8"]
    names = ("reached", "proved", "touched", "left", "clearance", "why")
    assert {name: told[name] for name in names} == {name: getattr(one, name) for name in names}


def test_a_sheet_names_the_cases_that_are_not_parked(tmp_path, monkeypatch):
    path, titles = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), []
    came = Parked(
        True, True, "", 0.1, 1, 0, 9.0, np.zeros(3), 1.0, 0.0, False, [], path, np.zeros(2)
    )
    shown = [came, replace(came, proved=False), replace(came, reached=False)]
    keep = lambda figure, _: titles.extend(axes.get_title() for axes in figure.axes)  # noqa: E731
    monkeypatch.setattr(Figure, "savefig", keep)
    sheet(tmp_path / "cases.png", [cases.case(8)] * 3, shown)
    name = cases.case(8).name
    assert titles == [name, f"{name}, not parked", f"{name}, not parked"]


def test_files_of_an_older_drive_are_gone_where_nothing_is_found(tmp_path, monkeypatch):
    path, said, module = np.zeros((2, 3)), [], sys.modules[job.__module__]
    nothing = Parked(
        False, False, "none", 0.1, 0, 0, 0.0, np.zeros(3), 1.0, 0.0, False, [], path, np.zeros(2)
    )
    for name, found in (("drive", nothing), ("loop_of", None), ("sheet", None)):
        monkeypatch.setattr(module, name, lambda *_, found=found, **__: found)
    for name in ("case_8.json", "case_8.png", "case_8.gif", "case_2.json"):
        (tmp_path / name).touch()
    park_all(Options(case=(8,), out=tmp_path), said.append)
    assert {one.name for one in tmp_path.iterdir()} == {"case_2.json", "cases.json"}
    assert "Verify with" not in said[-1]


@pytest.mark.slow
def test_the_shell_parks_a_case(tmp_path, capsys, monkeypatch):
    shortly(monkeypatch)
    with pytest.raises(SystemExit) as ended:
        cli.main(["run", "parking", "--case", "8", "--out", str(tmp_path / "eight"), "--json"])
    assert ended.value.code == 0
    assert json.loads(capsys.readouterr().out)["8"]["reached"]
    written = {one.name for one in (tmp_path / "eight").iterdir()}
    assert {"case_8.json", "case_8.png", "case_8.gif", "cases.json"} <= written


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["parking", "--case", "3"], "expected one of 1, 2, .*; got 3"),
        (["drift_parking", "--case", "3"], "drift_parking has none"),
        (["barn", "--case", "3"], "expected an option of sims.barn.job"),
    ],
)
def test_a_case_that_is_not_there_is_named_in_the_shell(arguments, words, capsys):
    with pytest.raises(SystemExit):
        cli.main(["run", *arguments])
    assert re.search(words, capsys.readouterr().err)


@pytest.fixture(scope="module")
def parked(tmp_path_factory):
    """Case 2, whose way is polished shortly, and its file."""
    folder = tmp_path_factory.mktemp("parked")
    with pytest.MonkeyPatch.context() as patched:
        shortly(patched)
        return park(2, Options(out=folder))[0], folder / "case_2.json"


def shortly(patched) -> None:
    """A way is polished in a few rounds: quicker, but not much."""
    patched.setattr(polish, "SHORTLY", 5)
    patched.setattr(polish, "ROUNDS", 10)


@pytest.mark.night
def test_nothing_compiles_between_cases(parked, monkeypatch):
    shortly(monkeypatch)
    loop, key = prove.loop_of(), jax.random.PRNGKey(8)
    assert compiled_by(lambda: drive.drive(cases.case(8), loop, key)) == 0


def test_a_case_is_parked_and_its_file_is_accepted(parked):
    one, file = parked
    assert one.reached and one.proved and not one.touched and not one.left
    driven = load_episode(file)
    assert len(driven.manoeuvres) == len(one.commitments)
    assert driven.meta["within"] == ["0.1", "2.0"] and "none passes while it plans" in str(
        driven.meta
    )
    # the last manoeuvre is proved to end in the goal: two axes and the heading, each on both sides
    assert len(driven.manoeuvres[-1].problem.goal.b) == 6


def test_runs_of_another_model_than_that_of_the_files_are_not_made(parked, tmp_path):
    one, file = parked
    model = predict.model()
    driven = again.driven_in(file.parent, model)
    assert [name for name, _ in driven] == ["case_2"] * len(one.commitments)
    net = pj.learning.relu_network(model.net.weights, [1.01 * b for b in model.net.biases])
    points = model.claim.subject.points
    claim = pj.learning.declared_claim(model.tube, "a test", net, model.time, points=points)
    with pytest.raises(pj.InputError, match="expected manoeuvres of the model"):
        again.driven_in(file.parent, pj.learning.trajectory_model(net, claim))
    with pytest.raises(pj.InputError, match="expected a folder"):
        again.driven_in(tmp_path, model)


def test_a_car_rolls_from_one_manoeuvre_into_the_next(parked):
    one, file = parked
    begins = np.array([float(each.begin) for each in one.commitments])
    rolled = np.flatnonzero(np.diff(begins) == car.ROLLS_ON)
    assert len(rolled) == one.rolled > 1
    # what the next was proved for is how fast the car is there, and what the file tells
    ends = np.cumsum([car.EVERY * n for n in np.diff([*begins, begins[-1] + car.SHARES + 2])])
    for i in rolled:
        told = car.rolls_at(*one.commitments[i + 1].k[1:3])
        assert told > quicker.ROLLING / 2
        at = slice(int(ends[i]) - 1, int(ends[i]) + 1)
        way, took = np.diff(one.path[at, :2], axis=0), np.diff(one.times[at])
        assert (
            abs(told - np.linalg.norm(way) / took[0]) < 0.1
        )  # [m/s], the mean of what leads there
    assert "is left while the car rolls" in file.read_text()


@pytest.mark.night
def test_a_car_that_rolls_and_finds_nothing_more_comes_to_its_stop_and_goes_on(monkeypatch):
    asked, refused, found = drive.link, [], []

    def fails_once(loop, around, now, *more):
        if now.stop and not refused:  # in the drive, not in its rehearsal
            refused.append(now)
            return loop.go_on("nothing is proved")
        found.append(now)
        return asked(loop, around, now, *more)

    monkeypatch.setattr(drive, "link", fails_once)
    one = drive.drive(cases.case(2), prove.loop_of(), jax.random.PRNGKey(2))
    assert one.reached and one.proved and not one.touched and not one.left
    (rolling,) = refused
    stopped = rolling.stop[0][-1]
    at = np.flatnonzero((one.path == stopped).all(axis=1))
    assert len(at) and any((now.pose == stopped).all() and not now.speed for now in found)


@pytest.mark.night
def test_a_car_whose_motor_pushes_as_no_run_begins_goes_on_to_its_stop(monkeypatch):
    loop = prove.loop_of()
    drive.black_box()(jax.random.PRNGKey(0), np.zeros(5))  # compiled with the law as it is
    monkeypatch.setattr(car, "PUSH", 5.0)
    monkeypatch.setattr(drive, "LINKS", 3)
    assert drive.drive(cases.case(2), loop, jax.random.PRNGKey(2)).rolled == 0


def test_why_a_car_stopped_on_its_way_is_told(monkeypatch):
    shortly(monkeypatch)
    monkeypatch.setattr(drive, "LINKS", 1)
    one = drive.drive(cases.case(5), prove.loop_of(), jax.random.PRNGKey(5))
    assert not one.reached and one.why == "not in the goal after 1 manoeuvre"


@pytest.mark.night
def test_a_last_stroke_that_is_not_proved_from_a_pose_that_may_be_wrong_is_shuffled():
    loop = prove.loop_of(start=0.02, heading=0.005)  # [m], [rad]
    one = drive.drive(cases.case(1), loop, jax.random.PRNGKey(1))
    assert one.reached and one.proved and not one.touched and not one.left


@pytest.mark.night
def test_a_car_that_no_way_leads_on_within_a_gap_is_shuffled():
    one = drive.drive(shortest.street(6.0), prove.loop_of(), jax.random.PRNGKey(0))
    assert one.reached and one.proved and not one.touched and not one.left


@pytest.mark.night
def test_all_cases_are_parked_and_nothing_is_touched(tmp_path):
    done = {number: park(number, Options(out=tmp_path))[0] for number in cases.numbers()}
    assert not any(one.touched or one.left for one in done.values())
    assert all(one.reached and one.proved for one in done.values())


def test_a_replay_says_of_how_many_and_what_left_its_tube(tmp_path, monkeypatch, capsys):
    runs = SimpleNamespace(
        plans=np.zeros((5, 8)),
        reached=np.array([True] * 4 + [False]),
        touched=np.zeros(5, bool),
        inside=np.array([True] * 3 + [False] * 2),
    )
    said = "5 plans replayed: 4 reached the goal, 0 touched something, 2 left the tube"
    assert last.told_of(runs) == said
    old = tmp_path / "last.png"
    old.write_bytes(b"of other plans")
    none = SimpleNamespace(summary=lambda: "none", samples=())
    monkeypatch.setattr(last, "last_set", lambda _: none)
    last.drive(last.Options(case=(1,), out=old))
    assert not old.exists() and "no picture" in capsys.readouterr().out


def test_a_way_whose_tube_was_left_is_not_told_as_proved(monkeypatch):
    told = {"reached": True, "proved": True, "touched": False, "commitments": [1, 2]}
    monkeypatch.setattr(shortest, "loop_of", lambda: None)
    monkeypatch.setattr(shortest, "Guide", lambda *_, **__: SimpleNamespace(search=lambda: None))
    monkeypatch.setattr(shortest, "cost_of_a_pose", lambda _: 0.0)
    for left, n in ((False, 2), (True, None)):
        one = SimpleNamespace(**told, left=left, clearance=0.1)
        monkeypatch.setattr(shortest, "drive", lambda *_, one=one: one)
        assert shortest.tried(6.0).driven == n


def test_help_of_the_shortest_gap_is_told_and_drives_nothing(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["shortest", "--help"])
    with pytest.raises(SystemExit) as stop:
        runpy.run_path(shortest.__file__, run_name="__main__")
    assert stop.value.code == 0 and "--gaps" in capsys.readouterr().out
    with pytest.raises(pj.InputError, match="gaps: expected each longer than the car"):
        shortest.tabled(shortest.Options(gaps=(1.0,)))
