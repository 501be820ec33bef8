"""Movers with tubes of their own: windows of tracks, their obstacles hold all of a tube, and what
is measured wrongly is one sentence with the stop in hand. [T43]
"""

import jax
import numpy as np
import pytest
from toy_movers import GRID, straight

import parc_jax as pj
from parc_jax.common.spelling import rounded_up
from parc_jax.learning.bound.tube import tube
from parc_jax.statement import about_obstacles

ROBOT = pj.learning.time_grid(0.1, 1.0, 0.1)
STEP = 0.1


def walks(n: int, seed: int = 0, seconds: float = 8.0) -> list:
    """Tracks that turn now and then, logged every 0.05 s."""
    draw, found = np.random.default_rng(seed), []
    for _ in range(n):
        times = np.arange(0.0, seconds, 0.05)
        turns = np.where(draw.uniform(size=len(times)) < 0.01, draw.uniform(-1, 1, len(times)), 0)
        heading, speed = draw.uniform(-3, 3) + np.cumsum(turns), draw.uniform(0.3, 1.2)
        steps = 0.05 * speed * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        found.append((times, np.cumsum(steps, axis=0)))
    return found


def names(n: int, first: int = 0) -> list[str]:
    return [f"mover {first + i}" for i in range(n)]


def mover(heading: float, speed: float = 1.0, at: float = 0.0) -> pj.problem.Mover:
    ways = speed * STEP * np.array([np.cos(heading), np.sin(heading)])
    places = np.array([2.0, -1.0]) + np.arange(-2, 1)[:, None] * ways
    return pj.problem.see_mover(at + STEP * np.arange(-2, 1), places, STEP)


def test_windows_are_told_in_the_frame_of_the_mover():
    times = np.arange(0.0, 6.0, 0.1)
    line = np.array([3.0, 1.0]) + times[:, None] * np.array([0.0, -0.8])
    runs = pj.problem.mover_runs([(times, line)], GRID, of=["a"], step=STEP, most=1.5, every=0.5)
    assert runs.n == 10 and len(set(runs.groups)) == 1
    np.testing.assert_allclose(runs.k, np.tile([0.8, 0.0], (10, 1)), atol=1e-9)
    t = GRID.dt_record * np.arange(GRID.n_record + 1)
    np.testing.assert_allclose(runs.p, np.stack([[0.8 * t, 0 * t]] * 10).swapaxes(1, 2), atol=1e-9)


@pytest.mark.soundness
@pytest.mark.parametrize("how", [{"every": 0.1}, {"rng": np.random.default_rng(0)}])
def test_only_what_was_observed_is_a_run(how):
    """Who walks in a circle is as far from where a window began at the end of each."""
    times = np.arange(0.0, 2.001, 0.02)
    circle = np.stack([np.cos(times), np.sin(times)], axis=1)
    about = {"step": STEP, "most": 1.5, **how}
    runs = pj.problem.mover_runs([(times, circle)] * 20, GRID, of=names(20), **about)
    far = np.linalg.norm(runs.p[:, -1], axis=1)
    np.testing.assert_allclose(far, 2 * np.sin(GRID.t_f / 2), atol=1e-3)
    assert "one of 1.2 s within each track" in runs.law.describe()
    short = [(times, circle), (times[:65], circle[:65])]
    with pytest.raises(pj.InputError, match=r"track 1: expected at least 1.4 s .* it has 1.28 s"):
        pj.problem.mover_runs(short, GRID, of=names(2), **about)


def test_of_each_track_one_window_bounds_and_all_of_them_teach():
    about = {"step": STEP, "most": 1.5}
    train = pj.problem.mover_runs(walks(12), GRID, of=names(12), every=0.5, **about)
    of = names(60, 12) + names(1, 12) * 10  # one was lost and found again ten times
    held = pj.problem.mover_runs(walks(70, 1), GRID, of=of, rng=np.random.default_rng(0), **about)
    assert held.n == 70 and len(set(held.groups)) == 60 and train.n > 100
    asked = {"hidden": (4,), "seeds": 1, "steps": 50, "eps": 0.2, "delta": 0.05, "discard": 1}
    model = pj.learn(train, jax.random.PRNGKey(0), holdout=held, quiet=True, **asked)
    assert model.claim.n == 60 and float(model.claim.eps) <= 0.2
    told = pj.problem.mover_obstacles(model, [mover(0.3), mover(2.0)], 0.3, ROBOT, 0.0).said
    eps = model.claim.eps
    assert f"at most {rounded_up(eps)} from a moment of a track" in told
    assert f"any of which leaves with at most {rounded_up(2 * eps)}. Movers" in told
    # all that the claim of the tracks says of itself: how surely, of how many, of which law
    assert "against 2 movers, any" in told and "Movers within 0.3 m, until the last" in told
    assert "with confidence 0.95 over 60 recordings each leaves its tube" in told
    # a mover is a unit of it: all tracks alike are those of the few who have most of them
    assert f"of its law, {model.claim.quantifier}, each mover alike, then any of its tracks" in told
    assert "each track alike" not in told
    tracks = [x.replace(groups=None) for x in (train, held)]
    model = pj.learn(tracks[0], jax.random.PRNGKey(0), holdout=tracks[1], quiet=True, **asked)
    alone = pj.problem.mover_obstacles(model, [mover(0.3)], 0.3, ROBOT, 0.0).said
    assert "with confidence 0.95 over 70 runs each" in alone and "each track alike how" in alone
    assert "with a window around it alike, between logged places, too; of several, and" in told
    assert "add up, if they ignore the robot" in told and "Assumes: IID, " in told
    # errors of the places seen, other than those of the tracks, leave its tube far more often
    assert "places were measured as those of the tracks were, errors included, in a frame" in told
    # who stands has no heading of their own: 110 of 400 left in a frame that was turned by 90 deg
    axis = "in a frame with the same x axis, along which who stands is taken to head. Of whoever"
    stands = pj.problem.see_mover([0.0, STEP, 2 * STEP], [[1.0, 1.0]] * 3, STEP)
    assert stands.heading == 0.0 and (stands.k == 0.0).all() and axis in told


@pytest.mark.soundness
def test_windows_that_were_not_drawn_evenly_bound_no_moment_of_a_track():
    """All at the beginnings of tracks, say: that is no law of each of their moments alike."""
    about = {"step": STEP, "most": 1.5}
    train = pj.problem.mover_runs(walks(12), GRID, of=names(12), every=0.5, **about)
    first, drawn = (
        pj.problem.mover_runs(walks(60, 1), GRID, of=names(60, 12), **how, **about)
        for how in ({"every": 9.0}, {"rng": np.random.default_rng(0)})
    )
    assert first.n == drawn.n == 60 and first.law != drawn.law
    asked = {"hidden": (4,), "seeds": 1, "steps": 50, "eps": 0.2, "delta": 0.05, "discard": 1}
    model = pj.learn(train, jax.random.PRNGKey(0), holdout=first, quiet=True, **asked)
    with pytest.raises(pj.InputError, match=r"from a moment drawn evenly; .* every 9 s.*rng="):
        pj.problem.mover_obstacles(model, [mover(0.3)], 0.3, ROBOT, 0.0)
    with pytest.raises(pj.InputError, match=r"window is one of .* every 9 s.*drawn evenly"):
        pj.monitor(model.claim, model.net).observe(drawn)


@pytest.mark.soundness
@pytest.mark.parametrize(("heading", "age", "every"), [(0.0, 0.0, 1), (2.3, 0.13, 3)])
def test_obstacles_hold_all_of_a_tube_grown_by_the_mover(heading, age, every):
    wide, radius, speed, model = 0.05, 0.4, 1.3, straight()
    walker = mover(heading, speed, at=5.0 - age)
    told = pj.problem.mover_obstacles(model, [walker], radius, ROBOT, 5.0, every=every)
    assert told.until == 1.0 and told.spans[-1][1] == 9
    assert [t for a, b in told.spans for t in range(a, b + 1)] == list(range(10))
    draw = np.random.default_rng(0)
    along = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-along[1], along[0]])
    for part, (first, last) in zip(told.obstacles, told.spans, strict=True):
        times = age + draw.uniform(0.1 * first, 0.1 * (last + 1), 200)
        off = wide * draw.choice([-1.0, 1.0], (200, 2))
        middle = np.array([2.0, -1.0]) + (speed * times + off[:, 0])[:, None] * along
        rim = draw.normal(size=(200, 2))
        rim *= radius / np.linalg.norm(rim, axis=1, keepdims=True)
        assert ((middle + off[:, 1:] * left + rim) @ part.A.T <= part.b).all()


def test_the_moment_until_which_it_holds_is_not_told_later():
    made = pj.learning.time_grid(0.35171, 1.05513, 0.35171)
    told = pj.problem.mover_obstacles(straight(), [mover(0.0)], 0.4, made, 0.0)
    assert told.until == pytest.approx(1.05513) and told.said.startswith(
        "Until 1.05 s after the pose"
    )


def test_until_a_moment_nobody_is_an_obstacle_later():
    told = pj.problem.mover_obstacles(straight(), [mover(0.0)], 0.4, ROBOT, 0.0, until=0.35)
    assert told.until == pytest.approx(0.4) and told.spans[-1][1] == 3
    assert told.said.startswith("Until 0.4 s after the pose at 0 s, against 1 mover. Movers")
    because = "DECLARED, not shown here: that no run leaves the tube, because this test declares it"
    assert f"each stays in its tube ({because}), if they ignore the robot" in told.said
    asked = pj.reach_avoid(pj.box([-1, -1], [1, 1]), told.obstacles, 0.1, spans=told.spans)
    law = told.said.partition("1 mover. ")[2]
    assert f"Of at most 1 at a time: {law}" in about_obstacles(asked, ROBOT)
    assert "of a plan that begins at 0.0 s of a clock alone, until 0.4 s of it at least: of" in (
        about_obstacles(asked, ROBOT)
    )


def test_of_what_is_told_of_from_a_later_moment_on_no_end_is_told_alone():
    """ "until 0.3 s of it at least", of which nothing was said of the first 0.1 s."""
    early = ", until 0.3 s of it at least: of it nothing is said later."
    for first, until in ((0, early), (1, ": of it nothing is said at other times.")):
        asked = among([pj.problem.Span((first, 2))])
        assert f"of a plan alone{until}" in about_obstacles(asked, ROBOT)


def among(spans):
    """A question with an obstacle far off for each span."""
    goal, post = pj.box([-1, -1], [1, 1]), pj.box([5, 5], [6, 6])
    return pj.reach_avoid(goal, [post] * len(spans), 0.1, spans=spans)


@pytest.mark.parametrize("pairs", [[(1, 3)], [(5, 9)], [(1, 2), (3, 9)], [(9, 9)]])
def test_a_name_that_its_own_spans_belie_tells_of_nothing(pairs):
    """Of a "bus from 42" that is told of from 5 on nothing was said before: it was nowhere."""
    for name in ("cart from 3", "bus from 42"):
        spans = [pj.problem.Span(pair, mover=name) for pair in pairs]
        part = any(span[0] >= 3 for span in spans) and name == "cart from 3"
        assert among(spans).told_for(10) == 0
        assert [x.told_from for x in spans] == [3 * (x[0] >= 3) * (name[0] == "c") for x in spans]
        assert ("before interval" in about_obstacles(among(spans), ROBOT)) == part
    # one that is told of before, too, and all the time
    whole = [pj.problem.Span(pair, mover="cart from 3") for pair in ((0, 2), (3, 9))]
    assert among(whole).told_for(10) == 10 and among(whole[1:]).told_for(10) == 10


def test_of_a_path_that_bends_the_later_part_is_not_said_to_be_untold():
    """Two calls of `moving`: "nothing is said of them later", of which the second one told."""
    block, bends = pj.box([2, 2], [3, 3]), (([1, 0], (0, 1)), ([0, 1], (2, 9)))
    told = [pj.problem.moving(block, v, when, 0.1) for v, when in bends]
    asked = pj.reach_avoid(
        pj.box([-1, -1], [1, 1]),
        [part for parts, _ in told for part in parts],
        0.1,
        spans=[span for _, spans in told for span in spans],
    )
    words = "alone, until 0.2 s of it at least: of some nothing is said later. Of at most"
    assert words in about_obstacles(asked, ROBOT)


def test_each_sentence_about_an_obstacle_has_a_subject_and_a_full_stop():
    """ "Of at most 1 at a time: As told Before interval 2 of a plan, ..., it is nowhere"."""
    nowhere = "What is in the way is, before interval 2 of a plan, counted from 0, nowhere or told"
    for said, words in (("", ""), ("As told", "As told. "), ("By {0.5} m.", "By 0.5 m. ")):
        asked = among([pj.problem.Span((2, 9), said=said, mover="cart from 2")])
        text = f"Of at most 1 at a time: {words}{nowhere} of apart."
        assert about_obstacles(asked, ROBOT).endswith(f" {text}")
    both = about_obstacles(among([pj.problem.Span((0, 1), said=x) for x in ("A", "B.")]), ROBOT)
    assert both.endswith("Of at most 1 at a time: A. Of at most 1 at a time: B.")


def test_the_reason_of_a_declared_tube_is_told_whole():
    model = straight()
    why = "measured in one hall, on dry floor, of adults alone"
    named = model.labels._asdict()
    claim = pj.learning.declared_claim(model.tube, why, model.net, GRID, labels=named)
    declared = pj.learning.trajectory_model(model.net, claim)
    told = pj.problem.mover_obstacles(declared, [mover(0.0)], 0.4, ROBOT, 0.0)
    assert f"because {why}), if they ignore" in told.said
    assert all(f"because {why}), if they ignore" in span.said for span in told.spans)


def test_tracks_with_gaps_and_jumps_are_refused():
    times = np.arange(0.0, 6.0, 0.1)
    line = np.outer(times, [0.5, 0.0])
    about = {"of": ["a"], "step": STEP, "most": 1.5, "every": 0.5}
    twice = np.where(times == times[7], times[6], times)
    with pytest.raises(pj.InputError, match="track 0: expected at least two increasing times"):
        pj.problem.mover_runs([(twice, line)], GRID, **about)
    jumps = line + np.where(times > 3.0, 4.0, 0.0)[:, None]
    with pytest.raises(pj.InputError, match=r"it jumps with 56\.9"):
        pj.problem.mover_runs([(times, jumps)], GRID, **about)
    lost = np.delete(np.arange(len(times)), [20, 21])
    with pytest.raises(
        pj.InputError, match=r"track 0: expected .* 0.1 s apart at most.* gap of 0.3 s"
    ):
        pj.problem.mover_runs([(times[lost], line[lost])], GRID, **about)
    bridged = pj.problem.mover_runs([(times[lost], line[lost])], GRID, bridge=0.3, **about)
    assert "straight between places, 0.3 s apart at most" in bridged.law.describe()
    with pytest.raises(pj.InputError, match=r"these are 0.3 and 0.1 s apart"):
        pj.problem.see_mover([0.0, 0.3, 0.4], line[:3], STEP)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"until": np.nan}, "until: expected finite numbers"),
        ({"until": np.inf}, "until: expected finite numbers"),
        ({"every": 1.5}, "every: expected a whole number >= 1; got 1.5"),
        ({"radius": "wide"}, "radius: expected numbers"),
        ({"time": None}, "time: expected TimeGrid; got None"),
        ({"until": 9.0}, "until within the manoeuvre, .*; got 0.4 and 9.0"),
    ],
)
def test_what_is_no_argument_of_movers_is_refused(wrong, words):
    with pytest.raises(pj.InputError, match=f"mover_obstacles.* {words}"):
        pj.problem.mover_obstacles(
            straight(), [mover(0.0)], **{"radius": 0.4, "time": ROBOT, "at": 0.0} | wrong
        )


@pytest.mark.parametrize(
    "wrong", [{"step": None}, {"most": "fast"}, {"bridge": "x"}, {"time": 3}, {"tracks": [3]}]
)
def test_what_is_no_argument_of_runs_of_movers_is_one_sentence(wrong):
    asked = {"tracks": walks(1), "time": GRID, "of": ["a"], "step": STEP, "most": 1.5, "every": 0.5}
    with pytest.raises(pj.InputError, match="mover_runs: expected tracks of times and places"):
        pj.problem.mover_runs(**asked | wrong)


def test_runs_of_movers_need_tracks_and_time_between_windows():
    times = np.arange(0.0, 6.0, 0.1)
    track = times, np.outer(times, [0.5, 0.0])
    for wrong in (
        {"tracks": [], "of": []},
        {"tracks": None},
        {"of": None},
        {"every": 0.0},
        {"every": -1.0},
        {"every": None},
        {"every": None, "rng": 3},
        {"every": "a"},
    ):
        asked = {"tracks": [track], "of": names(1), "every": 0.5} | wrong
        with pytest.raises(pj.InputError, match=r"mover_runs.*: expected (tracks, one of|numbers)"):
            pj.problem.mover_runs(asked.pop("tracks"), GRID, step=STEP, most=1.5, **asked)


@pytest.mark.parametrize("at", [-0.5, 7.0])
def test_a_pose_from_the_future_or_by_another_clock_is_refused(at):
    with pytest.raises(pj.InputError, match="by one clock; this one was seen"):
        pj.problem.mover_obstacles(straight(), [mover(0.0)], 0.4, ROBOT, at)


def test_of_nobody_nothing_is_said():
    """ "against 0 movers, any of which leaves with at most 0"."""
    said = pj.problem.mover_obstacles(straight(), [], 0.4, ROBOT, 0.0).said
    assert "against nobody, as none was measured. Movers within" in said
    assert "Of whoever is not among them nothing is said." in said


def test_who_is_not_of_the_law_is_refused():
    with pytest.raises(pj.InputError, match=r"up to 2 m/s, .*; this one goes 3 m/s"):
        pj.problem.mover_obstacles(straight(), [mover(0.0, 3.0)], 0.4, ROBOT, 0.0)


def test_who_is_of_a_bin_without_a_claim_is_refused():
    """ "polytope b: expected finite numbers; got 8 NaN"."""
    model, wide = straight(), np.array([0.05, np.inf])
    edges = [[0.0, 1.0, 2.0], [-3.15, 3.15]]
    held = tube(edges, np.tile(wide[:, None, None], (12, 2)), np.tile(wide[:, None], 2))
    named = model.labels._asdict()
    claim = pj.learning.declared_claim(held, "slow ones alone", model.net, GRID, labels=named)
    slow = pj.learning.trajectory_model(model.net, claim)
    assert pj.problem.mover_obstacles(slow, [mover(0.0, 0.9)], 0.4, ROBOT, 0.0).obstacles
    for speed in (1.0, 1.5):  # 1.0: on the edge, of both bins
        with pytest.raises(pj.InputError, match=rf"a bin of K with a claim; .* goes {speed:g} m/s"):
            pj.problem.mover_obstacles(slow, [mover(0.0, speed)], 0.4, ROBOT, 0.0)


def test_pieces_of_a_track_are_no_more_movers_than_it():
    whole, about = walks(5), {"step": STEP, "most": 1.5, "rng": np.random.default_rng(0)}
    cut = [(t[i : i + 40], x[i : i + 40]) for t, x in whole for i in range(0, 160, 40)]
    with pytest.raises(pj.InputError, match=r"the mover of each of 20 tracks; got .* and 5 in of"):
        pj.problem.mover_runs(cut, GRID, of=names(5), **about)
    runs = pj.problem.mover_runs(cut, GRID, of=np.repeat(names(5), 4), **about)
    assert runs.n == 20 and len(set(runs.groups)) == 5


def test_a_model_of_other_steps_or_of_a_robot_is_refused():
    seen = pj.problem.see_mover(0.6 * np.arange(3), np.outer(np.arange(3), [0.5, 0.0]), 0.6)
    with pytest.raises(pj.InputError, match=r"for steps of 0.6 s.*k = speed over 0.1 s"):
        pj.problem.mover_obstacles(straight(), [seen], 0.4, ROBOT, 1.2)
    robot = straight().with_labels({"k": ("speed [m/s]", "turning [rad]")})
    with pytest.raises(pj.InputError, match=r"expected a model of `mover_runs`.*turning"):
        pj.problem.mover_obstacles(robot, [mover(0.0)], 0.4, ROBOT, 0.0)


def test_a_claim_of_another_network_is_none_of_movers():
    """Its tube was told as theirs; and a tested set's, which runs may leave."""
    model = straight()
    slow = pj.learning.relu_network([0.9 * model.net.weights[0]], [np.zeros(24)])
    with pytest.raises(pj.InputError, match="expected the network"):
        pj.problem.mover_obstacles(model.replace(net=slow), [mover(0.0)], 0.4, ROBOT, 0.0)
