"""Where a robot may be that is under way is an obstacle of all others. [T45]"""

import copy
import math
import pickle
from fractions import Fraction

import jax
import numpy as np
import pytest
from episodes import PATIENT, driven
from toy_models import line_model
from toy_movers import straight

import parc_jax as pj
from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from parc_jax.learning.network.predict import trajectories
from parc_jax.problem.uncertainty import FREE
from parc_jax.problem.world.movers import mover_obstacles, see_mover

pytestmark = pytest.mark.soundness
RADIUS, OFF = 0.05, 0.01  # [m] of the body, and of the uncertainty of its place
RESTS = (
    "That a robot is in the way rests on its manoeuvre, on its staying where that ends, or on one "
    "after it that keeps clear of this plan, of a loop ("
)
SIDES = 2 * np.pi / 16 * np.arange(16)
RIM = RADIUS * np.stack([np.cos(SIDES), np.sin(SIDES)], axis=1)


def places(one, seconds: float, rng, n: int = 50) -> np.ndarray:
    """Points (n, 2) of the body at a time after the beginning, for runs at the edge of the tube."""
    model, pose = one.asked.query.model, one.asked.pose
    knots = trajectories(model.net, model.layout, one.k[None])[0][0][:, :2]
    at = min(seconds / model.time.dt, model.time.n_steps)
    i = min(int(at), model.time.n_steps - 1)
    way = knots[i] + (at - i) * (knots[i + 1] - knots[i])
    off = model.tube.interval[model.tube.bins_of(one.k[None])[0], i].min(axis=0)[:2]
    run = way + off * rng.choice([-1.0, 1.0], (n, 2))
    cos, sin = math.cos(pose.heading or 0.0), math.sin(pose.heading or 0.0)
    away = run @ np.array([[cos, sin], [-sin, cos]])
    return pose.place + away + OFF * rng.choice([-1.0, 1.0], (n, 2)) + rng.choice(RIM, n)


@pytest.mark.parametrize("turning", [False, True], ids=["straight", "turning"])
@pytest.mark.parametrize("every", [1, 3])
def test_a_robot_under_way_and_at_rest_is_inside_of_what_is_reserved(turning, every):
    rng = np.random.default_rng(every)
    for one in (driven(turning, n)[-1] for n in (1, 2, 3)):
        time = one.asked.query.model.time
        for later in (0.0, 0.13, 0.5, 0.77, 1.0, 9.0):
            at = float(one.begin) + later * time.t_f
            obstacles, spans = pj.drive.reserved(one, at, time, every=every)
            told = [t for first, last in spans for t in range(first, last + 1)]
            assert told == list(range(time.n_steps))
            for body, (first, last) in zip(obstacles, spans, strict=True):
                for share in (0.01, 0.4, 0.99):  # at a knot it is inside of the tubes on both sides
                    seconds = at - float(one.begin) + time.dt * (first + share * (last + 1 - first))
                    assert (places(one, seconds, rng) @ body.A.T <= body.b).all()
        # at rest it is one obstacle, hardly wider than the robot, its tube and its uncertainty
        assert len(obstacles) == 1
        ahead, back = obstacles[0].b[:4], obstacles[0].b[4:]
        wide = 2 * one.asked.query.model.tube.interval[:, -1].max() * math.sqrt(2)
        assert (ahead + back <= 2 * RADIUS + 2 * math.sqrt(2) * OFF + wide + 1e-4).all()


def test_intervals_that_are_no_whole_number_are_refused():
    one = driven(False, 1)[0]
    with pytest.raises(pj.InputError, match=r"expected every >= 1.*; got 1\.5"):
        pj.drive.reserved(one, float(one.begin), one.asked.query.model.time, every=1.5)


def test_who_decides_before_the_other_was_measured_is_refused():
    first, second, *_ = driven(False, 2)
    time, now = first.asked.query.model.time, float(second.begin)
    with pytest.raises(pj.InputError, match="decides later"):
        pj.drive.reserved(second, float(first.begin), time)
    with pytest.raises(pj.InputError, match="every >= 1"):
        pj.drive.reserved(second, now, time, every=0)
    second.seen_outside.append(second.begin)
    with pytest.raises(pj.InputError, match="seen outside: nobody knows where it goes"):
        pj.drive.reserved(second, now, time)


def test_what_was_reserved_before_its_robot_was_seen_outside_is_void():
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)

    def step(robot, place, at, obstacles=(), spans=None):
        goes = lambda seen: -seen.path[:, -1, 0]  # noqa: E731
        return robot.step(place, [0.1], obstacles, goes, at=at, spans=spans)

    one = step(loop, np.zeros(2), 0.0).committed
    obstacles, spans = pj.drive.reserved(one, 1.0, model.time)
    assert step(loop, np.full(2, 5.0), 1.0).left and one.under_way
    after = step(loop.another(), np.array([0.0, 9.0]), 1.0, obstacles, spans)
    void = "seen outside of its tube since: stop"
    assert not after.new and void in after.reason
    goal = pj.box([-0.2] * 3, [0.2] * 3)
    planner, asked = pj.Planner(model), pj.reach_avoid(goal, obstacles, RADIUS, spans=spans)
    for ask in (planner.solve, lambda *of: planner.solve_batch([of[0]], of[1])):
        with pytest.raises(pj.InputError, match=f"span of obstacle 0: expected .* {void}"):
            ask(asked, jax.random.PRNGKey(0))
    loop.restart()
    with pytest.raises(pj.InputError, match="a robot that has left that since"):
        planner.solve(asked, jax.random.PRNGKey(0))


def ahead(seen):
    """As far along x as it may."""
    return -seen.path[:, -1, 0]


def side_by_side():
    """Two loops of a kind, and what the second one commits to beside the first, both at 0 s."""
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)
    beside = loop.another()
    other = loop.step(np.array([0.0, 0.6]), [0.0], [], ahead, at=0.0).committed
    obstacles, spans = pj.drive.reserved(other, 0.0, model.time)
    one = beside.step(np.zeros(2), [0.0], obstacles, ahead, at=0.0, spans=spans).committed
    return loop, beside, one


def test_what_was_measured_of_a_robot_in_the_way_is_named():
    """Where more is uncertain, "for what is measured, exactly" does not stand there. And a loop can
    be sent to worker processes, with the clock that it has by default.
    """
    model = line_model(4, 0.01, rests=True)
    known = {"uncertainty": pj.Uncertainty(start=0.02), "effort": PATIENT}
    loop = pickle.loads(pickle.dumps(pj.drive.Loop(model, 0.05, leave=0.5, given=(1,), **known)))
    one = loop.step(np.zeros(2), [0.0], [], ahead, at=0.0).committed
    _, (span, *_) = pj.drive.reserved(one, 0.0, model.time)
    assert "what is measured of its k was so (k1)" in span.rests_on


def test_a_manoeuvre_beside_a_robot_that_left_its_tube_is_not_told_as_clear(tmp_path):
    """It began while the other was inside: its repr, its files and its episode said no word."""
    loop, beside, one = side_by_side()
    assert "m clear under an assumed tube>" in repr(one) and not one.others_left
    assert loop.step(np.full(2, 3.0), [0.0], [], ahead, at=0.5).left
    words = "a robot in its way left its tube by 0.5 s"
    assert repr(one).endswith(f", {words}>") and words in one.certificate()["meta"]["rests_on"]
    assert words in beside.go_on("").reason
    file = pj.drive.save_episode(tmp_path / "one.json", [one])
    report = checker.check_episode(checker.load(file), allowance_of)
    assert report.premises[-1] == ["TUBE_LEFT", "measured", [f"manoeuvres[0]: {words}"]]
    drive = lambda *_: pj.drive.Outcome(True, False, {}, [one], 0.7)  # noqa: E731
    done = pj.drive.drive_episodes(drive, lambda _: 0, jax.random.key(0), 1, workers=0, quiet=True)
    assert not done.contradictions and done.left == 1


def test_a_robot_in_the_way_that_left_its_next_tube_is_told_too(tmp_path):
    """It replans beside this manoeuvre: outside of what it drives then it may be here as well."""
    loop, beside, one = side_by_side()
    obstacles, spans = pj.drive.reserved(one, 0.5, one.asked.query.model.time)
    there = np.array([0.5 * loop.under_way.k[0], 0.6])
    assert loop.step(there, [0.0], obstacles, ahead, at=0.5, spans=spans).new
    assert "m clear under an assumed tube>" in repr(one) and not beside.go_on("").reason
    assert loop.step(np.full(2, 3.0), [0.0], [], ahead, at=0.75).left
    words = "a robot in its way left its tube by 0.75 s"
    assert repr(one).endswith(f", {words}>") and words in beside.go_on("").reason
    report = checker.check_episode(
        checker.load(pj.drive.save_episode(tmp_path / "one.json", [one])), allowance_of
    )
    assert report.premises[-1] == ["TUBE_LEFT", "measured", [f"manoeuvres[0]: {words}"]]
    drive = lambda *_: pj.drive.Outcome(True, False, {}, [one], 0.8)  # noqa: E731
    done = pj.drive.drive_episodes(drive, lambda _: 0, jax.random.key(0), 1, workers=0, quiet=True)
    assert not done.contradictions and done.left == 1


@pytest.mark.parametrize("seen_at", [0.5, 0.75])
def test_what_was_left_for_another_manoeuvre_before_is_told_as_it_was(seen_at):
    """A sighting after that made no contradiction of a touch that it cannot explain; by one at the
    very moment, as of robots that step together, the tube was left while it was driven.
    """
    loop, beside, one = side_by_side()
    place = np.array([0.5 * one.k[0], 0.0])
    then = beside.step(place, [0.0], [pj.box([20.0, 20.0], [21.0, 21.0])], ahead, at=0.5).committed
    assert loop.step(np.full(2, 3.0), [0.0], [], ahead, at=seen_at).left
    assert ("m clear under an assumed tube>" in repr(one)) == (
        seen_at > 0.5
    ) and "m clear under an assumed tube>" in repr(then)
    drive = lambda *_: pj.drive.Outcome(True, False, {}, [one, then], 1.2)  # noqa: E731
    done = pj.drive.drive_episodes(drive, lambda _: 0, jax.random.key(0), 1, workers=0, quiet=True)
    assert done.left == (seen_at == 0.5) and done.contradictions == (0,)[: 1 - done.left]


def test_who_moves_is_not_told_of_where_the_first_part_of_its_way_is_left_out():
    """Its last part alone was told of as clear until the end."""
    model, goes = line_model(4, 0.01, rests=True), lambda seen: -seen.path[:, -1, 0]
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)
    other = loop.step(np.array([0.0, 9.0]), [0.0], [], goes, at=0.0).committed
    far = pj.box([5.0, 5.0], [6.0, 6.0])
    dt, where = model.time.dt, [[9.0, 9.1], [9.0, 9.0], [9.0, 8.9]]
    seen = see_mover(0.1 * np.arange(3), where, 0.1)
    late = mover_obstacles(straight(), [seen], 0.1, model.time, 0.2)
    for (obstacles, spans), at in (
        (pj.drive.reserved(other, 0.0, model.time), 0.0),
        (pj.problem.moving(far, [0.1, 0.0], (0, 3), dt, at=0.0), 0.0),
        (late[:2], 0.2),
    ):
        for first, told in ((0, 4), (1, 0)):
            told_of = {"at": at, "spans": spans[first:]}
            step = loop.another().step(np.zeros(2), [0.0], obstacles[first:], goes, **told_of)
            assert step.committed.told_until == step.committed.begin + told * Fraction(dt)
    # one that comes to be later was nowhere before, as it is told of
    obstacles, spans = pj.problem.moving(far, [0.1, 0.0], (2, 3), dt, at=0.0)
    step = loop.another().step(np.zeros(2), [0.0], obstacles, goes, at=0.0, spans=spans)
    assert step.committed.told_until == step.committed.end
    for name in ("cart", "17", "1"):  # as people number tracks: it says nothing of where it begins
        parts = [pj.problem.Span(x, dt, 0.0, None, "", name) for x in ((0, 1), (2, 3))]
        step = loop.another().step(np.zeros(2), [0.0], [far, far], goes, at=0.0, spans=parts)
        assert step.committed.told_until == step.committed.end


def test_robots_whose_poses_drifted_share_no_frame():
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)

    def step(robot, at, drift=0.0, obstacles=(), spans=None):
        here = np.zeros(2) if robot.under_way is None else robot.under_way.k * at
        goes = {"at": at, "spans": spans, "drift": drift}
        return robot.step(here, [0.1], obstacles, lambda seen: -seen.path[:, -1, 0], **goes)

    first = step(loop, 0.0).committed
    obstacles, spans = pj.drive.reserved(first, 0.0, model.time)
    far = [type(one)(one.A, one.b + one.A @ [30.0, 30.0]) for one in obstacles]
    assert step(loop.another(), 0.0, obstacles=far, spans=spans).new
    refused = step(loop.another(), 0.0, 0.5, far, spans)
    assert not refused.new and "frame that both robots share" in refused.reason
    assert step(loop, 1.0, 0.5).new
    for at in (1.0, 2.0):  # that the last step did not drift is no help
        with pytest.raises(pj.InputError, match=r"drifted by 0\.5 m"):
            pj.drive.reserved(loop.under_way, at, model.time)
        assert at == 2.0 or step(loop, 2.0).new


def test_plans_beside_a_robot_say_whose_manoeuvre_they_rest_on(tmp_path):
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)
    one = loop.step(np.zeros(2), [0.1], (), lambda seen: -seen.path[:, -1, 0], at=0.0).committed
    for later in (0.0, 9.0):  # at rest it is there for the whole plan
        obstacles, spans = pj.drive.reserved(one, later, model.time)
        asked = pj.reach_avoid(pj.box([-5.0] * 3, [5.0] * 3), obstacles, RADIUS, spans=spans)
        answer = pj.Planner(model).solve(asked, jax.random.PRNGKey(0), pj.Settings.fast())
        assert f"{RESTS}{one.loop})." in answer.details()
    assert "Not any more" not in answer.details()
    prepared = pj.Planner(model).prepare(asked)
    well = pj.load_answer(answer.save(tmp_path / "well.json"))
    loop.restart()  # its robot may be anywhere
    over = "Not any more: what is in the way was made for number 0 of a robot that has left that"
    assert over in answer.summary() and over in answer.details()
    for ask in (prepared.solve, prepared.first):
        with pytest.raises(pj.InputError, match="a robot that has left that since"):
            ask(jax.random.PRNGKey(0))
    # a file that was written before does not see it, and tells what held then
    assert f"{RESTS}{one.loop})." in well.details() and "Not any more" not in well.details()
    back = pj.load_answer(answer.save(tmp_path / "answer.json"))
    again = pj.load_answer(back.save(tmp_path / "again.json"))
    for read in (back, again):  # a file that was written then says it for ever
        assert f"{RESTS}{one.loop}; n{over[1:]}" in read.details()


def test_no_scene_file_tells_of_a_robot_that_may_leave_its_manoeuvre(tmp_path):
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)
    loop.step(np.zeros(2), [0.1], (), lambda seen: -seen.path[:, -1, 0], at=0.0)
    obstacles, spans = pj.drive.reserved(loop.under_way, 0.0, model.time)
    asked = pj.reach_avoid(pj.box([-5.0] * 3, [5.0] * 3), obstacles, RADIUS, spans=spans)
    with pytest.raises(pj.InputError, match="obstacles: expected those of which a file can"):
        pj.exchange.save_problem(tmp_path / "scene.toml", asked)
    assert not list(tmp_path.iterdir())


def test_what_a_robot_has_left_for_another_manoeuvre_reserves_nothing():
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)
    left = "has under way, `loop.under_way`; its loop has left number 0"

    def one(robot):
        return robot.step(np.zeros(2), [0.1], (), lambda seen: -seen.path[:, -1, 0]).committed

    first = one(loop)
    pj.drive.reserved(first, 0.0, model.time)
    other = loop.another()  # begins nothing in its place
    pj.drive.reserved(first, 0.0, model.time)
    first_of_other = one(other)
    loop.restart()
    with pytest.raises(pj.InputError, match=left):
        pj.drive.reserved(first, 0.0, model.time)
    pj.drive.reserved(first_of_other, 0.0, model.time)
    for copied in (copy.deepcopy(first_of_other), pickle.loads(pickle.dumps(first_of_other))):
        with pytest.raises(pj.InputError, match="has under way"):  # which nobody tells of another
            pj.drive.reserved(copied, 0.0, model.time)
    loop.restart(first)
    pj.drive.reserved(first, 0.0, model.time)
    with pytest.raises(pj.InputError, match=left):
        pj.drive.reserved(driven(False, 2)[0], 0.5, model.time)


@pytest.mark.parametrize(("dt", "share"), [(1.0, 0.4), (0.7, 0.21)])
def test_who_rests_before_the_other_does_avoids_all_of_its_way(dt, share):
    rng = np.random.default_rng(0)
    one = driven(True, 1)[0]
    grid = one.asked.query.model.time
    step = dt * grid.dt
    time = pj.learning.time_grid(step, max(1, round(share * grid.t_f / step)) * step, step)
    assert time.t_f < 0.6 * grid.t_f
    obstacles, spans = pj.drive.reserved(one, float(one.begin), time)
    first, last = spans[-1]
    assert last == time.n_steps - 1
    for seconds in np.linspace(step * first + 1e-6, 1.5 * grid.t_f, 60):
        assert (places(one, seconds, rng) @ obstacles[-1].A.T <= obstacles[-1].b).all()


def test_what_a_file_keeps_of_another_robot_is_not_asked_again(tmp_path):
    """No file sees whether that robot has left its manoeuvre since."""
    model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(model, RADIUS, leave=0.5, given=(1,), effort=PATIENT)
    goes = lambda seen: -seen.path[:, -1, 0]  # noqa: E731
    one = loop.step(np.zeros(2), [0.1], (), goes, at=0.0).committed
    obstacles, spans = pj.drive.reserved(one, 1.0, model.time)
    goal, planner = pj.box([-0.2] * 3, [9.0] * 3), pj.Planner(model)
    free = pj.Uncertainty(given={axis: FREE for axis in model.given})
    asked = pj.reach_avoid(goal, obstacles, RADIUS, spans=spans, uncertainty=free)
    answer = planner.solve(asked, jax.random.PRNGKey(0), pj.Settings(target=0.5))
    back = pj.load_answer(answer.save(tmp_path / "answer.json"))
    assert RESTS in answer.details() and answer.problem.rests_on == back.problem.rests_on
    again = pj.load_answer(back.save(tmp_path / "again.json"))
    for problem in (back.problem, again.problem, back.problem.replace(body=0.01)):
        with pytest.raises(pj.InputError, match=r"span of obstacle 0: .* is of a file, which does"):
            planner.solve(problem, jax.random.PRNGKey(0))
        with pytest.raises(pj.InputError, match="no file would see it"):
            pj.exchange.save_problem(tmp_path / "scene.toml", problem)
    about = {"spans": back.problem.spans, "at": 1.0}
    step = loop.another().step([0.0, 9.0], [0.1], back.problem.obstacles, goes, **about)
    assert not step.new and "is of a file, which does not see whether" in step.reason
