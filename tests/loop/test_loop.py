"""One proved manoeuvre after another: the best that is safe, or the one under way."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from compilations import compiled_by
from toy_models import line_model, model_of, resting, told, toy_case, uniform_tube
from toy_movers import straight

import parc_jax as pj
from parc_jax import checker
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.drive.loop.candidates import even_candidates, outlook
from parc_jax.drive.loop.episode_file import episode_of, episode_part
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.system import TURNS
from parc_jax.problem.body import Disc, Part
from parc_jax.problem.robust.pose import pose_of
from parc_jax.safe_set.verdict.scene import scene_along

PATIENT = pj.drive.Effort(candidates=256, deadline=300.0)
WALL = pj.box([0.45, -2.0], [0.5, 2.0])


def forward(seen):
    """Likes to get far along x."""
    return -seen.path[:, -1, 0]


@pytest.fixture(scope="module")
def line():
    """k_1 is measured, k_0 is chosen: a point that goes to k in four steps, give or take 0.01."""
    return line_model(4, 0.01, rests=True)


def afresh(loop, *asked, **more):
    """A step of another episode."""
    loop.restart()
    return loop.step(*asked, **more)


def loop_of(model, **options):
    options = {"body": 0.1, "leave": 0.5, "given": (1,), "effort": PATIENT} | options
    return pj.drive.Loop(model, **options)


def test_the_best_liked_of_the_safe_ones_is_committed_to(line):
    loop = loop_of(line)
    step = loop.step([0.0, 0.0], [0.25], [WALL], forward)
    assert step.new and step.reason == "" and step.committed is loop.under_way
    # radius 0.1 and error 0.01 stay free before the wall at 0.45; the next candidate would not
    every = np.sort(even_candidates(line, (1,), 256)[:, 0])
    free = every[every < 0.45 - 0.11]
    assert step.committed.k.tolist() == [free[-1], 0.25]
    assert step.committed.clearance == pytest.approx(0.34 - free[-1], abs=1e-9)
    assert step.committed.end - step.committed.begin == line.time.t_f
    k = repr(step.committed).partition("k = (")[2].partition(")")[0]
    assert [float(x) for x in k.split(", ")] == step.committed.k.tolist()
    for clearance in (0.016827, 0.0994999):  # told as 0.017 and 0.099
        told_as = repr(replace(step.committed, clearance=clearance)).split(" s, ")[1]
        assert float(told_as.split(" m clear")[0]) <= clearance


def test_what_is_measured_is_no_preference(line):
    """Nor what is committed to: who sorts candidates may not change them."""

    def changes(seen):
        seen.k[:, 1] = 0.0
        return forward(seen)

    with pytest.raises(ValueError, match="read-only"):
        loop_of(line).step([0.0, 0.0], [0.25], [WALL], changes)


@pytest.mark.parametrize(("leave", "first"), [(0.25, 0.25), (0.4, 0.4), (0.30000000000000004, 0.3)])
def test_nothing_begins_before_a_manoeuvre_may_be_left(line, leave, first):
    loop, stays = loop_of(line, leave=leave), lambda seen: np.abs(seen.k[:, 0])
    assert loop.step([0.0, 0.0], [0.0], [], stays, 0.0).new
    early = loop.step([0.0, 0.0], [0.0], [], stays, first - 1e-4)
    assert not early.new and f"to be left from {leave:g} s" in early.reason
    assert float(loop.leave_after) == pytest.approx(first, abs=1e-15)
    assert loop.step([0.0, 0.0], [0.0], [], stays, first).new


def test_what_an_obstacle_was_stays_in_its_proof(line):
    """Though the user's arrays do not."""
    A, b = np.array(from_box(WALL).A), np.array(from_box(WALL).b)
    view = b[:]
    view.setflags(write=False)  # of what may be written to all the same
    for own in (pj.types.HPolytope(A, b), pj.types.HPolytope(A, view)):
        b[:] = from_box(WALL).b
        step = loop_of(line).step([0.0, 0.0], [0.25], [own], forward)
        unsure = pj.Uncertainty(obstacles=own)
        b[:] = from_box(pj.box([-0.1, -0.1], [0.1, 0.1])).b
        assert step.new and step.committed.proved()
        assert unsure.obstacles[0].b[0] == 0.5
    (edge, *_) = pj.problem.free_place([[0, 0], [1, 0], [1, 1], [0, 1]], 0.0).obstacles()
    with pytest.raises(ValueError, match="read-only"):
        edge.b[:] = 10.0


def test_what_moves_is_kept_away_from_until_the_rest(line):
    """A wall that comes at 0.1 m/s at most: the farther the later, so it takes room at the rest."""
    loop, time = loop_of(line), line.time
    whole = (0, time.n_steps - 1)
    toward, spans = pj.problem.moving(WALL, [0.0, 0.0], whole, time.dt, at=0.0, off_by=0.1)
    step = loop.step([0.0, 0.0], [0.25], toward, forward, spans=spans)
    every = np.sort(even_candidates(line, (1,), 256)[:, 0])
    free = every[every < 0.45 - 0.1 * time.t_f - 0.11]
    assert step.new and step.committed.k.tolist() == [free[-1], 0.25] and step.committed.proved()
    first = [pj.problem.Span((0, 0), time.dt, 0.0)]
    gone = afresh(loop, [0.0, 0.0], [0.25], toward[:1], forward, spans=first)
    assert gone.committed.k[0] > 0.5  # what is there in the first interval alone
    assert not afresh(loop, [0.0, 0.0], [0.25], toward, forward, spans=first).new


def test_what_moves_is_told_for_this_moment_and_these_intervals(line):
    """Of every source of spans: those of the moment are taken, others are refused in words."""
    dt, whole = line.time.dt, (0, line.time.n_steps - 1)
    other = loop_of(line)
    first = other.step([9.0, 0.0], [0.25], [], forward).committed
    seen = pj.problem.see_mover(0.1 * np.arange(-2, 1), np.full((3, 2), 5.0), 0.1)
    walks = straight()

    def grid(step):
        return pj.learning.time_grid(step, line.time.t_f, step)

    sources = {
        "moving": lambda at, step: pj.problem.moving(
            WALL, [0.0, 0.0], whole, step, at=at, off_by=0.1
        ),
        "movers": lambda at, step: pj.problem.mover_obstacles(
            walks, [seen], 0.3, grid(step), at, until=0.5
        )[:2],
        "reserved": lambda at, step: pj.drive.reserved(first, at, grid(step)),
    }
    loop = loop_of(line)

    def refused(made, at):
        loop.restart()
        asked = ([0.0, 0.0], [0.25], made[0], forward)
        return loop.step(*asked, at=at, spans=made[1]).reason

    for make in sources.values():
        assert not refused(make(0.25, dt), 0.25)
        assert "moment of this pose, 0.75 s of the clock; it was made for 0.25 s" in refused(
            make(0.25, dt), 0.75
        )
        assert f"expected intervals of {dt!r} s" in refused(make(0.25, dt / 2), 0.25)
    for made in ((0, 1), pj.problem.Span((0, 1), dt), pj.problem.Span((0, 1), dt, np.nan)):
        assert "moment" in refused(([WALL], [made]), 0.25)
    # its robot decides once more at the same moment
    made = sources["reserved"](0.5, dt)
    assert not refused(made, 0.5)
    other.step(np.add(first.asked.pose.place, [0.5, 0.125]), [0.25], [], forward, at=0.5)
    assert other.under_way is not first
    assert "made for number 0 of a robot that has left that since" in refused(made, 0.5)


def test_the_uncertainty_of_the_start_is_one_number_or_one_per_axis(line):
    """The wall is across x: only the half width along x keeps the robot farther from it."""
    far = {}
    for start in (0.05, (0.05, 0.05), (0.05, 0.0), (0.0, 0.05)):
        loop = loop_of(line, uncertainty=pj.Uncertainty(start=start))
        far[start] = loop.step([0.0, 0.0], [0.25], [WALL], forward).committed.k[0]
    assert far[0.05] == far[0.05, 0.05] == far[0.05, 0.0] < far[0.0, 0.05] - 0.03
    with pytest.raises(InputError, match="one half width, or 2, one per axis"):
        loop_of(line, uncertainty=pj.Uncertainty(start=(0.1, 0.1, 0.1)))


@pytest.mark.parametrize("uncertainty", [None, pj.Uncertainty(start=0.02)])
def test_what_a_system_declares_to_be_measured_is_given_at_every_step(line, uncertainty):
    declared = pj.drive.Loop(
        told(line, given=(1,)), 0.1, leave=0.5, uncertainty=uncertainty, effort=PATIENT
    )
    said = loop_of(line, uncertainty=uncertainty)
    steps = [loop.step([0.0, 0.0], [0.25], [WALL], forward) for loop in (declared, said)]
    assert declared.given == (1,) and all(step.new for step in steps), steps[0].reason
    assert np.array_equal(steps[0].committed.k, steps[1].committed.k)


def test_without_a_safe_one_the_manoeuvre_under_way_goes_on(line):
    loop = loop_of(line)
    none = loop.step([0.45, 0.0], [0.25], [WALL], forward)
    assert not none.new and none.committed is None and "none of 256" in none.reason
    first = loop.step([0.0, 0.0], [0.25], [WALL], forward, at=1.0)
    there = first.committed.k
    again = loop.step(there, [0.25], [pj.box(there, there)], forward, at=2.0)
    assert first.new and not again.new and again.committed is first.committed
    disliked = afresh(loop, [0.0, 0.0], [0.25], [WALL], lambda seen: np.full(len(seen.k), np.nan))
    assert not disliked.new and "none of 0" in disliked.reason


@pytest.mark.parametrize(
    ("pose", "given", "words"),
    [
        ([np.nan, 0.0], [0.25], "at"),
        ([0.0], [0.25], "at: expected x, y"),
        ([0.0, 0.0], [1.25], "within K, -1 to 1; got 1.25"),
        ([0.0, 0.0], [np.inf], "given"),
        ([10**400, 0.0], [0.25], "at: expected numbers"),
        ([0.0, 0.0], [10**400], "given: expected numbers"),
    ],
)
def test_what_is_measured_wrongly_changes_nothing(line, pose, given, words):
    loop = loop_of(line)
    first = loop.step([0.0, 0.0], [0.25], [], forward)
    step = loop.step(pose, given, [], forward)
    assert not step.new and step.committed is first.committed and words in step.reason


def test_who_is_late_commits_to_nothing(line):
    loop = loop_of(line, effort=pj.drive.Effort(deadline=1e-9))
    step = loop.step([0.0, 0.0], [0.25], [WALL], forward)
    assert not step.new and step.committed is None and "within 1e-09 s" in step.reason


def test_a_loop_reads_the_clock_that_it_is_given(line):
    """One that stands still lets everybody be in time."""
    loop = loop_of(line, effort=pj.drive.Effort(deadline=1e-9), clock=lambda: 0.0)
    assert loop.step([0.0, 0.0], [0.25], [], forward).new


def test_nothing_compiles_after_the_first_step_whatever_is_around(line):
    loop = loop_of(line)
    rng = np.random.default_rng(0)

    def drive():
        for n in (0, 1, 9, 100):
            around = [pj.box(c - 0.01, c + 0.01) for c in rng.uniform(-2, 2, (n, 2))]
            spans = [pj.problem.Span((i % 4, 3), line.time.dt, 0.0) for i in range(n)]
            for made in (None, spans):
                afresh(loop, [0.0, 0.0], [rng.uniform(-1, 1)], around, forward, spans=made)
        for turned in (0.0, 0.1):
            angle = turned + np.pi / 4 * np.arange(8)
            octagon = pj.hpolytope(np.stack([np.cos(angle), np.sin(angle)], axis=1), np.ones(8))
            loop.step([2.0, 0.0], [0.0], [octagon], forward)

    assert compiled_by(drive) == 0


@pytest.mark.parametrize("widths", [(0.0, 0.2), (0.2, 0.0)])
def test_where_bins_meet_all_of_them_have_to_allow_it(widths):
    tubes = [uniform_tube(4, e) for e in widths]
    both = [np.concatenate(parts) for parts in zip(*tubes, strict=True)]
    line = line_model(4, rests=True)
    model = model_of(line.net, line.domain, *both, [[-1, 1], [-1, 0, 1]])
    loop = loop_of(model)
    far = [afresh(loop, [0, 0], [x], [WALL], forward).committed.k[0] for x in (-0.1, 0, 0.1)]
    assert far[1] == min(far) < max(far) - 0.1


def test_of_the_first_safe_ones_one_with_room_is_taken(line):
    """The best liked one grazes the wall."""
    given = np.array([[0.33], [0.3], [0.2], [0.1], [0.0]])
    room = {"effort": pj.drive.Effort(room=0.1, deadline=300.0), "candidates": given}
    step = loop_of(line, **room).step([0, 0], [0.25], [WALL], forward)
    assert step.committed.k[0] == 0.2 and step.committed.clearance >= 0.1
    far = room | {"effort": pj.drive.Effort(room=0.5, deadline=300.0)}  # none has so much
    step = loop_of(line, **far).step([0, 0], [0.25], [WALL], forward)
    assert step.committed.k[0] == 0.0


def test_after_so_many_looks_no_candidate_is_judged(line):
    """All of them touch the wall, which takes a look each; the sentence says who was left out."""
    effort = pj.drive.Effort(candidates=256, looks=100, deadline=300.0)
    step = loop_of(line, effort=effort).step([0.45, 0.0], [0.25], [WALL], forward)
    assert "none of 100 candidates is safe; 156 of 256 were not looked at" in step.reason
    assert "takes more than 100 as effort.looks" in step.reason
    assert not step.new and step.committed is None
    short = loop_of(line, effort=effort)
    short = short.step([0.45, 0.0], [0.25], [WALL], forward, explain=False).reason
    assert step.reason.startswith(short) and len(step.reason) > len(short)


def test_who_was_never_looked_at_is_counted_and_the_setting_named(line):
    effort = pj.drive.Effort(candidates=1024, judged=256, looks=9999, deadline=300.0)
    loop = loop_of(line, effort=effort)
    step = loop.step([0.45, 0.0], [0.25], [WALL], forward)
    assert "none of 256 candidates is safe; 768 of 1,024 were not looked at" in step.reason
    assert "takes more than 256 as effort.judged" in step.reason
    few = loop.step([0.45, 0.0], [0.25], [WALL], lambda seen: np.where(seen.k[:, 0] > 0, 0, np.nan))
    assert "of 512 were not looked at" in few.reason and "; 512 were left out by" in few.reason
    late = loop_of(line, effort=pj.drive.Effort(deadline=1e-9))
    step = late.step([0.45, 0.0], [0.25], [WALL], forward)
    assert "effort.deadline; 64 of 1,024 candidates were looked at" in step.reason


def test_a_step_with_a_goal_is_proved_to_end_there(line):
    loop, goal = loop_of(line), from_box(pj.box([0.3, -1.0, -9.0], [0.4, 1.0, 9.0]))
    step = afresh(loop, [0.1, 0.0], [0.25], [], forward, goal=goal)
    # from 0.1, give or take 0.01: the farthest that is sure to end before 0.4
    every = np.sort(even_candidates(line, (1,), 256)[:, 0])
    assert step.new and step.committed.proved()
    assert step.committed.k[0] == every[every <= 0.29][-1]
    beyond = from_box(pj.box([0.3, -1.0, -9.0], [0.315, 1.0, 9.0]))  # narrower than the tube
    step = afresh(loop, [0.1, 0.0], [0.25], [], forward, goal=beyond)
    assert not step.new and "goal" in step.reason


def test_a_model_that_does_not_rest_is_refused_and_what_it_moves_is_told(line):
    with pytest.raises(
        InputError, match=r"end at rest; at k = .* moves by 0.25 m in its last 0.25"
    ):
        loop_of(line_model(4, 0.01))
    assert loop_of(line_model(4, 0.125)).step([0.0, 0.0], [0.25], [], forward).new
    with pytest.raises(InputError, match=r"0\.01 m more than its tube allows at rest"):
        loop_of(line_model(4, 0.12))
    with pytest.raises(InputError, match="end at rest"):
        loop_of(line_model(4, 0.2, final=0.04))


def test_where_the_robot_is_changes_nothing(line):
    far = np.array([100.0, -70.0])
    wall = pj.box(WALL.lo + far, WALL.hi + far)
    for asked, most in (
        ({}, 0.34),
        ({"end": from_box(pj.box([-0.2, -0.4, -2], [0.2, 0.4, 2]))}, 0.19),
    ):
        loop = loop_of(line, **asked)
        here = loop.step([0.0, 0.0], [0.25], [WALL], forward).committed
        there = afresh(loop, far, [0.25], [wall], forward).committed
        assert there.k.tolist() == here.k.tolist() and most - 0.02 < here.k[0] <= most
        assert there.clearance == pytest.approx(here.clearance, abs=1e-9)
        assert there.proved()


def test_more_uncertainty_never_goes_farther(line):
    uncertainties = [
        None,
        pj.Uncertainty(start=0.0),
        pj.Uncertainty(start=0.05),
        pj.Uncertainty(start=0.1),
    ]
    steps = [
        loop_of(line, uncertainty=d).step([0, 0], [0.25], [WALL], forward) for d in uncertainties
    ]
    far = [step.committed.k[0] for step in steps]
    assert far[0] == far[1] > far[2] + 0.03 > far[3] + 0.06


@pytest.mark.slow  # compiles for a robot of three points
def test_where_a_manoeuvre_may_end_holds_for_every_heading_of_the_uncertainty():
    """A run to x = k_0 ends within 0.3 of the axis wherever within 0.2 rad the heading is."""
    model = told(line_model(4, rests=True), rotation=(TURNS,))
    end = from_box(pj.box([-2.0, -0.1, -9.0], [2.0, 0.1, 9.0]))
    options = {"end": end, "given": (1,)}
    far = []
    for uncertainty in (None, pj.Uncertainty(heading=0.2)):
        loop = loop_of(model, uncertainty=uncertainty, **options)
        committed = loop.step([0.3, 0.1, 0.5], [0.0], [], forward).committed
        far.append(committed.k[0])
        assert committed.proved()
        read = episode_of(json.loads(json.dumps(episode_part([committed]))), "test")
        assert read.copies == (1 if uncertainty is None else 3)  # pictures say that it is spread
    assert far[0] > 0.99 and 0.45 < far[1] <= 0.1 / np.sin(0.2)


def test_a_caller_may_say_why_the_manoeuvre_under_way_goes_on(line):
    loop = loop_of(line)
    assert loop.go_on("the lidar failed").committed is None
    first = loop.step([0.0, 0.0], [0.25], [], forward)
    step = loop.go_on("the lidar failed")
    assert step.committed is first.committed and not step.new and step.reason == "the lidar failed"


def test_a_certificate_is_accepted_and_one_of_another_world_is_not():
    model, _ = toy_case(0)
    model = resting(told(model, rotation=(TURNS,)))
    loop = loop_of(model, given=(0,), uncertainty=pj.Uncertainty(start=0.01))
    around = [pj.box([1.5, 1.5], [1.6, 1.7]), pj.box([-3.0, -3.0], [-2.0, -2.0])]
    committed = loop.step(
        [0.2, 0.1, 0.5], [0.1], around, lambda seen: seen.path[:, -1, 0]
    ).committed
    assert committed is not None and committed.proved()
    file = json.loads(json.dumps(committed.certificate()))
    assert checker.check_answer(file).samples == 1
    said, where, k = checker.check_answer(file).said  # no obstacle rests on anything
    assert k == "what is measured of its k was so at its begin: k0 = 0.1"
    assert where.startswith("Here: all plans start at (0.2, 0.1) m with heading 0.5 rad.")
    assert said.startswith("Safe means here: safe for every start within ±0.01 m of the one")
    asked = committed.asked
    wide = from_box(pj.box([-0.05, -0.05], [1.0, 1.0]))  # over the start
    other = asked.problem.replace(obstacles=(wide, *asked.problem.obstacles[1:]))
    assert not replace(committed, asked=replace(asked, problem=other)).proved()


@pytest.mark.parametrize("eps", [0, 0.05])
def test_what_poses_may_be_off_with_some_probability_is_a_premise(line, eps):
    loop = loop_of(line, uncertainty=pj.Uncertainty(start=0.01, sensing_eps=eps))
    stays = lambda seen: seen.k[:, 0] ** 2  # noqa: E731
    steps = [loop.step([0.0, 0.0], [0.0], [], stays, at=at) for at in (0, 1)]
    for driven, words in (
        (steps[:1], "is off by more"),
        (steps, "; for all 2 manoeuvres at most 0.1"),
    ):
        part = episode_part([step.committed for step in driven])
        told = {name: value for name, _, value in part["premises"]}
        assert told.get("errors allowed for", "").endswith(words) == bool(eps)
        # a certificate and the sentence of a loop say so, too
        said = "at most 0.05 each time that what is measured is off by more"
        one = driven[0].committed
        assert (said in one.loop) == (said in str(one.certificate()["meta"])) == bool(eps)


def test_a_certificate_names_directions_of_what_is_near_alone(line):
    """A corner that no side of its box keeps away, with the errors: 5 mm less than the body."""
    near = pj.box([0.105, 0.105], [0.5, 0.5])
    far = [pj.box([i, 2.0], [i + 0.5, 3.0]) for i in range(30)]
    loop = loop_of(line, candidates=np.zeros((1, 1)))
    committed = loop.step([0.0, 0.0], [0.0], [*far, near], forward).committed
    path = np.zeros((5, 2))
    assert scene_along(committed.asked, committed.k, path).apart.kept.tolist() == [30]
    assert committed.proved()


def test_the_outlook_is_what_the_network_says_turned_into_the_world():
    model, _ = toy_case(0)
    model = told(model, rotation=(TURNS,))
    k = even_candidates(model, (0,), 100)
    seen = outlook(model, pose_of([1.0, 2.0, 0.3], model), k, 2)
    offsets, q = trajectories(model.net, model.layout, k)
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    np.testing.assert_allclose(seen.path, offsets[..., :2] @ turn.T + [1.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(seen.heading, q[:, 0] + 0.3, atol=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"leave": 0.0}, "a time to leave"),
        ({"leave": 99.0}, "a time to leave"),
        ({"given": ("speed",)}, "each once"),
        ({"given": (0, 0)}, "each once"),
        ({"given": (0, 1)}, "at least one parameter to choose"),
        ({"candidates": np.array([[2.0]])}, "all of them within K"),
        ({"candidates": np.zeros((0, 1))}, "at least one"),
        ({"uncertainty": pj.Uncertainty(k={0: 0.1})}, "start, heading, obstacles and sensing_eps"),
        ({"uncertainty": pj.Uncertainty(goal=0.1)}, "start, heading, obstacles and sensing_eps"),
        ({"end": from_box(pj.box([-1, -1], [1, 1]))}, "end: expected a set over 3 coordinates"),
        ({"given": 0}, "given: expected a list of parameters; got 0"),
        ({"uncertainty": 0.1}, "uncertainty: expected Uncertainty or None; got 0.1"),
        ({"effort": 0.1}, "effort: expected Effort or None; got 0.1"),
        ({"thinking": 3}, "thinking: expected Thinking or None; got 3"),
        ({"end": 3}, "end: expected HPolytope or None; got 3"),
        ({"clock": 3}, "clock: expected Callable or None; got 3"),
        ({"end": pj.types.HPolytope(np.eye(3), np.full(3, np.nan))}, "finite numbers; got 3 NaN"),
        (
            {"body": pj.types.Body((Part((0,), Disc(-0.1)),))},
            "radius: expected a number >= 0; got -0.1",
        ),
        ({"body": pj.types.Body(())}, "body: expected at least one part"),
    ],
)
def test_loops_that_make_no_sense_are_refused(line, options, words):
    with pytest.raises(InputError, match=words):
        loop_of(line, **options)


@pytest.mark.parametrize(("declared", "given"), [((1,), ()), ((0,), (1,))])
def test_what_is_measured_is_never_chosen(line, declared, given):
    with pytest.raises(InputError, match="What is measured is not chosen"):
        loop_of(told(line, given=declared), given=given)


def test_what_runs_did_not_measure_is_not_given_where_they_are_all_that_is_known(line):
    of_runs = {"kind": "pac", "eps": Fraction(1, 100), "delta": Fraction(1, 1000), "n": 688}
    model = line.replace(claim=derived(line.claim, **of_runs))
    with pytest.raises(InputError, match="does not declare k1"):
        loop_of(model)
    assert loop_of(told(model, given=(1,))).given == (1,)


def test_an_effort_of_nothing_is_refused():
    for one in (
        {"candidates": 0},
        {"candidates": 1.5},
        {"judged": 2.5},
        {"looks": "a"},
        {"deadline": None},
        {"deadline": "0.1"},
        {"deadline": np.nan},
        {"room": "a"},
        {"room": "0.3"},
    ):
        with pytest.raises(InputError, match=r"Effort: \w+: expected"):
            pj.drive.Effort(**one)


def test_a_simulation_may_wait_without_end_and_ask_for_all_room_there_is(line):
    effort = pj.drive.Effort(candidates=256, deadline=np.inf, room=np.inf)
    assert loop_of(line, effort=effort).step([0.0, 0.0], [0.25], [WALL], forward).new


def test_a_measurement_of_thousands_of_digits_ends_in_the_manoeuvre_under_way(line):
    loop = loop_of(line)
    one = loop.step([0.0, 0.0], [0.25], [WALL], forward).committed
    for at in (10**400, 10**5000):
        step = loop.step([0.0, 0.0], [0.25], [WALL], forward, at=at)
        assert step.committed is one and "at: expected numbers" in step.reason


def test_obstacles_that_are_no_list_end_in_the_manoeuvre_under_way(line):
    loop = loop_of(line)
    first = loop.step([0.0, 0.0], [0.25], [], forward, at=0.0).committed
    for wrong in (None, WALL):
        step = loop.step(0.5 * first.k, [0.25], wrong, forward)
        assert step.committed is first and not step.new
        assert step.reason.startswith("obstacles: expected a list, an entry for each; got ")
    step = loop.step(0.5 * first.k, [0.25], [WALL], forward, spans=3)
    assert step.committed is first and step.reason.startswith("spans: expected a list")


def test_a_clock_that_does_not_go_forward_changes_nothing(line):
    loop = loop_of(line)
    first = loop.step([0.0, 0.0], [0.25], [], forward, at=3.0).committed
    for at, words in ((3.0, "after 3 s"), (2.0, "got 2 s"), (np.nan, "at: expected finite")):
        step = loop.step([0.0, 0.0], [0.25], [], forward, at=at)
        assert not step.new and step.committed is first and words in step.reason
    assert loop.step(0.5 * first.k, [0.25], [], forward).committed.begin == 3.5
    loop.restart()
    again = loop.step([0.0, 0.0], [0.25], [], forward, drift=0.25).committed
    assert again.begin == 0 and again.drift == 0.25


def test_the_reason_names_the_obstacle_and_what_would_help(line):
    """To 0.40 m with a radius of 0.10 m and an error of 0.01 m before a wall at 0.45 m."""
    loop = loop_of(line, candidates=np.array([[0.5], [0.4]]))
    steps: list = []
    assert compiled_by(lambda: steps.append(loop.step([0.0, 0.0], [0.25], [WALL], forward))) == 0
    said = steps[0].reason
    assert "none of 2 candidates is safe. The nearest plan of those tried lacks 6.1 cm" in said
    assert (
        "to obstacle 0 at" in said and "takes 1.1 cm of it: without errors it lacks 5.1 cm" in said
    )
    assert said.split("What would help: ")[1].startswith("that obstacle farther away by 6.1 cm")


def test_a_manoeuvre_that_was_replaced_begins_no_episode(line):
    loop = loop_of(line)
    first = loop.step([0.0, 0.0], [0.25], [], forward).committed
    second = loop.step(first.k / 2, [0.25], [], forward).committed
    assert second.number == 1
    for _ in range(2):
        with pytest.raises(InputError, match="restart: expected what this loop began last"):
            loop.restart(first)
        loop.restart()
    loop.restart(second)
    assert loop.under_way is second


@pytest.mark.parametrize("fitted", [False, True])
def test_on_an_edge_between_bins_all_that_is_committed_to_is_proved(fitted):
    """One bin errs along x, the other along y: each was clear of a post, which no line parts from
    both, and so was what was committed to; the checker rejected its file. [T28]
    """
    time, share = pj.learning.time_grid(0.25, 1.0, 0.25), np.array([0.5, 1.0, 1.0, 1.0])
    ways = np.kron(share[:, None], np.eye(2))
    net = pj.learning.relu_network([np.c_[np.zeros(8), ways]], [np.zeros(8)])
    half = np.stack([np.tile([0.2, 0.01], (4, 1)), np.tile([0.01, 0.2], (4, 1))])
    tube = pj.learning.tube([[-1, 0, 1], [-1, 1], [-1, 1]], half, half[:, -1])
    if fitted:
        sides = np.array([[1.0, 0.0], [0.0, 1.0], [0.8, 0.6], [-0.6, 0.8]])
        around = np.abs(half[..., None, :] * sides).sum(axis=-1)[:, :, None]
        shape = (2, 4, 1, 4, 2)
        during = faces(np.broadcast_to(sides, shape), np.zeros(shape[:-1]), around)
        at_end = faces(np.broadcast_to(np.eye(2), (2, 2, 2)), np.zeros((2, 2)), half[:, -1])
        tube = fitted_tube(tube.edges, during, at_end)
    claim = pj.learning.declared_claim(tube, "this test", net, time, given=(0,))
    model = pj.learning.trajectory_model(net, claim)
    loop = loop_of(model, body=0.0, given=(0,), candidates=[[0.0, 0.0], [0.3, -0.1]])
    step = loop.step([0.0, 0.0], [0.0], [pj.box([0.05, 0.05], [1.0, 1.0])], forward)
    assert not step.new
    rng, new = np.random.default_rng(0), 0
    for _ in range(30):
        corners = rng.normal(size=(3, 2)) * 0.3 + rng.normal(size=2) * 0.4
        step = afresh(loop, [0.0, 0.0], [0.0], pj.problem.convex_pieces(corners), forward)
        new += step.new
        assert not step.new or step.committed.proved()
    assert 3 < new < 27
    # the end must be in a goal with the errors of all of them, too
    for given, half in ((-0.001, [1.0, 0.1]), (0.001, [0.1, 1.0])):
        goal = pj.box([-x for x in half], half)
        news = [
            afresh(loop, [0.0, 0.0], [x], [], forward, goal=goal).new for x in (given, 0.0, -given)
        ]
        assert news == [True, False, False]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"gone": 3}, "gone: expected a FreeSpace, or its `gone`; got 3"),
        ({"least": "much"}, "least: expected numbers"),
        ({"least": np.nan}, "least: expected finite numbers"),
        ({"prefer": None}, "prefer: expected a function of an Outlook; got None"),
        ({"prefer": lambda seen: np.zeros(len(seen.k)) * 1j}, "prefer: expected 256 numbers"),
        ({"prefer": lambda seen: ["a"] * len(seen.k)}, "prefer: expected 256 numbers"),
        ({"prefer": lambda seen: np.zeros(3)}, r"prefer: expected 256 numbers; got shape \(3,\)"),
    ],
)
def test_what_is_no_argument_is_refused_at_once(line, wrong, words):
    """Not in the step that has to stop."""
    asked = {"obstacles": [WALL], "prefer": forward} | wrong
    with pytest.raises(InputError, match=words):
        loop_of(line).step([0.0, 0.0], [0.25], **asked)


def test_all_of_a_free_space_may_be_told_as_gone(line):
    shapely = pytest.importorskip("shapely")
    free = pj.problem.free_place([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]])
    free = replace(free, gone=shapely.box(-4, -4, 4, 4))
    loop = loop_of(line)
    loop.step([0.0, 0.0], [0.25], [WALL], forward, gone=free)
    for gone in (free, free.gone):
        step = loop.step([0.0, 0.0], [9.0], [WALL], forward, gone=gone)
        assert not step.new and "given: expected" in step.reason
        assert "may lead where it is no longer known to be free" in step.reason
        assert "no longer known to be free" in loop.go_on("no scan", gone).reason


def test_any_clearance_or_none_is_enough(line):
    for least, new in ((-np.inf, True), (np.inf, False)):
        assert loop_of(line).step([0.0, 0.0], [0.25], [WALL], forward, least=least).new is new
    step = loop_of(line).step([0.0, 0.0], [0.25], [WALL], forward, least=99.1249)
    assert "is safe with 99.1249 m of clearance" in step.reason  # not 99: some may have that


def test_sentences_tell_the_numbers_apart_that_they_compare(line):
    loop, begin = loop_of(line), 1_795_720_000.0

    def why(given=0.0, obstacles=(WALL,), at=begin + 0.5, **more):
        asked = [0.0, 0.0], [given], obstacles, lambda seen: np.abs(seen.k[:, 0]), at
        return loop.step(*asked, **more).reason

    assert why(at=begin) == ""

    assert "after 1795720000 s, when" in (said := why(at=begin - 5)) and "got 1795719995 s" in said
    assert "within K, -1 to 1; got 1.0000000000000002" in why(np.nextafter(1.0, 2.0))
    obstacles, spans = pj.problem.moving(WALL, [0.1, 0.0], (0, 3), line.time.dt, at=begin + 1.5)
    told_for = "1795720000.5 s of the clock; it was made for 1795720001.5 s"
    assert told_for in why(obstacles=obstacles, spans=spans)
    with pytest.raises(InputError, match=r"from 1795720000 s on, .* and 1795719900 s"):
        pj.drive.reserved(loop.under_way, begin - 100.0, line.time)
    for asked in ((None, begin, line.time), (loop.under_way, begin, None)):
        with pytest.raises(InputError, match=r"reserved \w+: expected \w+; got None"):
            pj.drive.reserved(*asked)
