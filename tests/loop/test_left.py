"""Leaving a tube, by a robot that is exactly where its network says, but for what is done to it."""

import math
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from episodes import PATIENT
from platform_env import TIME, platform_net, ways
from toy_bodies import points_model
from toy_models import line_model, told

import parc_jax as pj
from parc_jax.checker import check_episode
from parc_jax.checker.answer import allowance_of
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.commitment import leads_to, outside_tube
from parc_jax.drive.loop.episode_file import episode_part
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.system import TURNS
from parc_jax.problem.body import hull
from parc_jax.problem.robust.pose import Pose

WIDE = 0.01  # [m] of the tube
WAY = (0.0, 0.25, 0.5, 1.0, 1.0)  # of it at each record
HALF = 2  # records, of four, after which a manoeuvre is left


def driven(turning: bool, between: float = 0.0):
    """Commitments, path and headings of three manoeuvres, the last one up to its rest.
    between: [m] of the tube for the time between records.
    """
    model = line_model(4, WIDE, rests=True)
    model = model.replace(claim=derived(model.claim, intersample=(between, between)))
    if turning:
        model = told(model, rotation=(TURNS,))
    loop = pj.drive.Loop(
        model, 0.05, leave=0.5, given=(1,), uncertainty=pj.Uncertainty(start=0.05), effort=PATIENT
    )
    place, heading, path, headings, done = np.array([0.3, -0.2]), 0.7 * turning, [], [], []
    for i in range(3):
        pose = np.append(place, heading) if turning else place
        measured = np.array([0.04, -0.03, 0.0])[
            : len(pose)
        ]  # the pose is uncertain, the tube is not
        step = loop.step(pose + measured, [0.1], [], lambda seen: -seen.path[:, -1, 0], i * 0.5)
        done.append(step.committed)
        cosine, sine = math.cos(heading), math.sin(heading)
        way = np.array([[cosine, -sine], [sine, cosine]]) @ step.committed.k
        records = range(HALF if i < 2 else 5)
        path += [place + way * WAY[s] for s in records]
        headings += [heading] * len(records)
        place, heading = place + way / 2, heading + 0.3 * turning
    return done, np.array(path), np.array(headings)


@pytest.mark.parametrize("turning", [False, True])
def test_a_robot_where_it_should_be_is_inside_and_one_pushed_aside_is_not(turning):
    done, path, heading = driven(turning)
    assert not pj.drive.left_tube(done, path, heading)
    for off, left in ((0.9 * WIDE, False), (1.1 * WIDE, True), (np.nan, True)):
        for record in (1, 3, len(path) - 1):
            aside = path.copy()
            aside[record, 1] += off / (np.cos(heading[record]) if turning else 1.0)
            assert pj.drive.left_tube(done, aside, heading) == left or (
                turning and not np.isnan(off)
            )
    if turning:
        assert pj.drive.left_tube(done, path, heading + 0.1)


def test_what_pays_for_the_time_between_records_is_not_for_the_records():
    done, path, _ = driven(False, 0.4 * WIDE)
    for off, left in ((0.5 * WIDE, False), (0.7 * WIDE, True)):
        aside = path.copy()
        aside[3, 1] += off
        assert pj.drive.left_tube(done, aside) == left


def test_what_a_manoeuvre_would_have_done_after_it_was_left_does_not_count():
    done, path, _ = driven(False)
    moved = path.copy()
    moved[2:] += 0.5  # it is where it is; the next manoeuvre begins there
    assert pj.drive.left_tube(done, moved)
    assert not pj.drive.left_tube(done, path[:5])


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        (lambda done, path: (done, path[:, :1]), r"\(n, 1, 2\); got shape \(9, 1\)"),
        (lambda done, path: (done[:1], path[:1]), r"2 records or more, .* got shape \(1, 2\)"),
        (lambda done, path: (done, path[:2]), "from 0 to 0.25 s; number 1 began at 0.5 s"),
        (lambda done, path: ([], path), r"a list of commitments alone; got \[\]"),
        (lambda done, path: (iter(done), path), "a list of commitments alone; got <list_iterator"),
        (lambda done, path: ([3], path), r"a list of commitments alone; got \[3\]"),
        (lambda done, path: (done, [[0, 0], [1]]), "places as numbers; got ValueError"),
        # what is unknown of the others is never "not left"
        (lambda done, path: (done[1:], path), "from number 0 on; got number 1 first"),
        (lambda done, path: (done[:2], path), "of which 3 began on this path; got 2"),
        (
            lambda done, path: (done[::2], path),
            "committed to in between.* got number 2 after 0",
        ),
        (
            lambda done, path: ([*done[:2], driven(False)[0][2]], path),
            "got number 2 of another after 1",
        ),
        (lambda done, path: ([*done, *driven(True)[0]], path), "frame is .*, beside"),
        (lambda done, path: (driven(True)[0], path), r"heading: expected shape \(9,\); got \(\)"),
    ],
)
def test_what_makes_no_sense_is_told(spoilt, words):
    done, path, _ = driven(False)
    with pytest.raises(InputError, match=words):
        pj.drive.left_tube(*spoilt(done, path))


def a_bar(heading: float):
    """Of a bar of four points that stays where it is, its commitment at a heading."""
    rng = np.random.default_rng(0)
    model = points_model(rng, fitted=True)
    W, b = (part[-1].copy() for part in (model.net.weights, model.net.biases))
    W[:] = 0.0
    ends = np.array([[0.0, 0.0], [0.4, 0.0], [-0.4, 0.0], [0.0, 0.2]]).ravel()
    b[: model.layout.n_offsets] = np.tile(ends, model.time.n_steps + 1)[2:]
    net = relu_network([*model.net.weights[:-1], W], [*model.net.biases[:-1], b])
    model = told(model, net=net, rotation=(TURNS,) * model.n_q)
    problem = SimpleNamespace(uncertainty=None, body=hull(1, 2, radius=0.1))
    asked = SimpleNamespace(
        query=SimpleNamespace(model=model, problem=problem),
        pose=Pose(np.array([3.0, -1.0]), heading),
    )
    k = (model.domain.lo + model.domain.hi) / 2
    return SimpleNamespace(asked=asked, k=k, begin=Fraction(0)), model, k


def test_a_heading_that_jumps_is_outside_by_what_the_other_points_are():
    last, model, k = a_bar(0.7)
    wide = model.tube.interval.max()
    now = Fraction(model.time.t_f) / 2
    place = last.asked.pose.place
    assert outside_tube(last, last.asked.pose, now, k)[0] == 0.0
    turned, _ = outside_tube(last, Pose(place, 0.7 + np.pi), now, k)
    assert 0.8 - 3 * wide < turned < 0.8
    assert outside_tube(last, Pose(place, 0.7 + 2 * np.pi), now, k)[0] == 0.0
    last.asked.query.problem.uncertainty = pj.Uncertainty(start=0.01, heading=0.1)
    less, _ = outside_tube(last, Pose(place, 0.7 + np.pi), now, k)
    assert turned - 0.04 - 2 * 0.25 < less < turned - 0.04


def test_where_a_manoeuvre_may_lead_is_all_of_the_body_its_tube_and_its_uncertainty():
    shapely = pytest.importorskip("shapely")
    last, model, _ = a_bar(0.5 * np.pi)
    for uncertainty in (None, pj.Uncertainty(start=0.01)):
        last.asked.query.problem.uncertainty = uncertainty
        off = 0.0 if uncertainty is None else 0.02
        for away, meets in (
            (0.5 + off - 1e-6, True),
            (0.5 + off + 3 * model.tube.interval.max(), False),
        ):
            there = shapely.Point(3.0, -1.0 + away)  # it stands along y
            assert leads_to(last, there, 0.0) == meets
            assert leads_to(last, shapely.Point(3.0, -0.7 + away), 0.3) == meets
    assert not leads_to(last, shapely.Polygon(), 1.0)


@pytest.mark.parametrize("drift", [math.nan, -100.0, None, "a"])
def test_a_drift_that_makes_no_sense_hides_nothing_of_where_it_may_lead(drift):
    shapely = pytest.importorskip("shapely")
    loop = pj.drive.Loop(line_model(4, WIDE, rests=True), 0.05, leave=0.5, effort=PATIENT)
    asked = [], [], lambda seen: -seen.path[:, -1, 0]
    assert loop.step([0.0, 0.0], *asked).new
    far = shapely.Point(50.0, 0.0).buffer(1.0)
    step = loop.step([0.0, 0.0], *asked, 0.5, drift=drift, gone=far)
    assert not step.new and "drift: expected" in step.reason
    assert "may lead where it is no longer known to be free" in step.reason


def test_how_far_a_pose_is_beyond_is_told_without_what_drift_allows():
    model = line_model(4, WIDE, rests=True)
    loop = pj.drive.Loop(model, 0.05, leave=0.5, given=(1,), effort=PATIENT)
    loop.step([0.0, 0.0], [0.1], [], lambda seen: -seen.path[:, -1, 0])
    off = [0.5 * loop.under_way.k[0] + WIDE + 0.31, 0.05]
    step = loop.step(off, [0.1], [], lambda seen: -seen.path[:, -1, 0], 0.5, drift=0.3)
    assert step.left and "this one is 0.01 m beyond" in step.reason


def test_a_long_drive_is_compared_at_its_records_as_well():
    """Half a record beside one, a million records after the beginning."""
    patient = pj.drive.Effort(deadline=300.0)  # of all candidates: one stays where it is
    loop = pj.drive.Loop(
        line_model(4, WIDE, rests=True), 0.05, leave=0.5, given=(1,), effort=patient
    )
    far, still = 1_200_000, lambda seen: np.abs(seen.k[:, 0])
    done = [loop.step(np.zeros(2), [0.0], [], still, at).committed for at in (0.0, 0.25 * far)]
    path = np.zeros((far + 9, 2))
    path[1:] += np.outer(np.append(WAY[1:], np.ones(far + 4)), done[0].k)
    path[far + 1 :] += np.outer(np.append(WAY[1:], np.ones(4)), done[1].k)
    assert not pj.drive.left_tube(done, path)
    beside = loop.step(np.zeros(2), [0.0], [], still, 0.25 * (far + 4.4)).committed
    with pytest.raises(InputError, match=r"number 2 began at 300001\.1 s"):
        pj.drive.left_tube([*done, beside], path)


def test_what_was_driven_before_the_first_manoeuvre_is_not_called_inside():
    """As after a restart, of which the commitments before are not told."""
    loop = pj.drive.Loop(
        line_model(4, WIDE, rests=True), 0.05, leave=0.5, given=(1,), effort=PATIENT
    )
    one = loop.step(np.zeros(2), [0.0], [], lambda seen: np.abs(seen.k[:, 0]), at=1.0).committed
    path = np.zeros((9, 2))
    path[4:] += np.outer(WAY, one.k)
    assert not pj.drive.left_tube([one], path)  # it stood
    for record, place in ((1, 0.05), (3, np.nan), (0, -1.0)):
        moved = path.copy()
        moved[record, 1] = place
        with pytest.raises(
            InputError, match=r"stands until the first .* moves before 1 s. Tell of all"
        ):
            pj.drive.left_tube([one], moved)
    drifted = path.copy()
    drifted[:4] += 0.009  # as one that settles
    assert not pj.drive.left_tube([one], drifted)


@pytest.mark.parametrize("begin", [0.0, 0.8, 1_795_720_000.3])
def test_at_a_knot_a_pose_is_within_the_intervals_before_and_after_it(begin):
    """The wider one of them was asked alone: a pose beyond the other was told as inside."""
    model = line_model(4, WIDE, rests=True)
    dt, still = model.time.dt, lambda seen: np.abs(seen.k[:, 0])
    for narrow, passed, left in ((1, 2, True), (2, 2, True), (0, 2, False), (1, 2.3, False)):
        interval = np.full((1, 4, 2), 5 * WIDE)
        interval[:, narrow] = WIDE
        tube = pj.learning.tube(model.tube.edges, interval, model.tube.final)
        loop = pj.drive.Loop(told(model, tube=tube), 0.05, leave=0.5, given=(1,), effort=PATIENT)
        done = loop.step(np.zeros(2), [0.0], [], still, at=begin).committed
        step = loop.step([0.0, 3 * WIDE], [0.0], [], still, at=begin + passed * dt)
        assert step.left == left != step.new
        if begin == 0.0 and passed == 2:
            assert (
                pj.drive.left_tube([done], np.array([[0.0, 0.0]] * 2 + [[0.0, 3 * WIDE]])) == left
            )


@pytest.mark.parametrize("narrow", [0.0, 1e-15, 5e-10])
def test_a_robot_where_a_tube_without_width_has_it_is_inside(narrow):
    """As one on a rail, or of an axis along which nothing moves; the checker accepts it."""
    loop = pj.drive.Loop(
        line_model(4, narrow, rests=True), 0.05, leave=0.5, given=(1,), effort=PATIENT
    )
    goes = [0.0], [], lambda seen: -seen.path[:, -1, 0]
    first = loop.step([0.0, 0.0], *goes, 0.0).committed
    step = loop.step([first.k[0] / 2, 0.0], *goes, 0.5)
    assert step.new and not step.left
    check_episode(episode_part([first, step.committed]), allowance_of)
    assert loop.step([first.k[0], 1e-8], *goes, 1.0).left


@pytest.mark.soundness
def test_what_begins_at_the_border_of_a_tube_is_accepted_by_the_checker():
    """A pose half a nanometre beyond it was inside to the loop, and its file was rejected."""
    loop = pj.drive.Loop(
        line_model(4, WIDE, rests=True), 0.05, leave=0.5, given=(1,), effort=PATIENT
    )
    for beyond, new in ((-2e-9, True), (5e-10, False)):
        loop.restart()
        goes = [0.1], [], lambda seen: -seen.path[:, -1, 0]
        first = loop.step([0.0, 0.0], *goes, 0.0).committed
        step = loop.step([first.k[0] / 2 + WIDE + beyond, 0.05], *goes, 0.5)
        assert step.new == new != step.left
        if new:
            check_episode(episode_part([first, step.committed]), allowance_of)


@pytest.mark.parametrize("where", ["at the end", "in another bin", "at the records"])
def test_what_stayed_inside_is_told_where_the_tube_itself_holds_it(where):
    """It is narrower at its end than in its last interval, in one of the bins of a k between, and
    at records, of which a part is for the time between them.
    """
    wide, narrow = np.full((12, 2), 0.05), np.full((12, 2), 0.01)
    edges, tube = [[-1, 1]] * 4, (wide[None], (wide if where == "at the records" else narrow)[:1])
    if where == "in another bin":
        edges, tube = (
            [[-1, 0, 1], *edges[1:]],
            (np.stack([wide, narrow]), np.stack([wide, narrow])[:, 0]),
        )
    net, about = platform_net(), {"system": "platform", "given": (0, 1)}
    claim = pj.learning.declared_claim(pj.learning.tube(edges, *tube), "test", net, TIME, **about)
    if where == "at the records":
        claim = derived(claim, intersample=(0.04, 0.04))
    model = pj.learning.trajectory_model(net, claim)
    loop = pj.drive.Loop(model, 0.2, leave=0.4, effort=PATIENT)
    k = loop.step([0, 0], [0, 0], [], lambda seen: -seen.k[:, 2], 0.0).committed.k
    a, b = ways(0.1 * np.arange(13))
    path = np.outer(a, k[:2]) + np.outer(b, k[2:])
    for off, left in ((0.0, False), (0.03, True)):
        run = path + off * np.linspace(0, 1, 13)[:, None] * [1, 0]
        seen = [loop.go_on("", None, run[i], 0.1 * i, 0.0, [0, 0]).left for i in (4, 8, 12)]
        assert pj.drive.left_tube([loop.under_way], run) is left
        assert seen == [False] * 3 if not left else False not in seen[-1:]
