"""I am here: which k? Scenes seen from a pose, headings within an angle, sets in k alone."""

import json
import math
from dataclasses import replace
from fractions import Fraction

import jax
import numpy as np
import pytest
from toy_bodies import points_model, points_problem
from toy_models import anchored_plans, line_model, told, toy_case
from uncertain import corners_and_inside

import parc_jax as pj
from benchmarks.neuralparc import Published
from parc_jax import checker
from parc_jax.app.cli.scene import verdict
from parc_jax.common.errors import InputError
from parc_jax.learning.network.relu import outputs, relu_network
from parc_jax.learning.system import STAYS, TURNS, rotation_of
from parc_jax.planner import Planner
from parc_jax.problem.body import Polygon
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.robust.pose import from_here, pose_of
from parc_jax.problem.robust.realisations import misses_circle, turn_by
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.outline import require_fit
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

KEY = jax.random.PRNGKey(0)
SMALL = Settings(samples=8, target=0.3, budget_s=300)


def turned(model, angle: float, widths: bool = False):
    """The model of runs that start with another heading: offsets turned, an angle in q added. The
    tube is as it was, or (widths) the box around the turned one.
    """
    c, s = math.cos(angle), math.sin(angle)
    W, b = np.array(model.net.weights[-1]), np.array(model.net.biases[-1])
    n = model.layout.n_offsets
    R = np.array([[c, -s], [s, c]])
    W[:n] = np.einsum("pa,tac->tpc", R, W[:n].reshape(-1, 2, W.shape[1])).reshape(n, -1)
    b[:n] = np.einsum("pa,ta->tp", R, b[:n].reshape(-1, 2)).ravel()
    b[n:] += angle * np.array([word == TURNS for word in model.rotation])
    net = relu_network([*model.net.weights[:-1], W], [*model.net.biases[:-1], b])
    tube = model.tube
    if widths:
        across = np.abs(R)
        interval = np.einsum("pa,bta->btp", across, tube.interval)
        final = np.array(tube.final)
        final[:, :2] = final[:, :2] @ across.T
        tube = replace(tube, interval=interval, final=final)
    return told(model, net, tube)


def test_which_goal_states_turn_with_the_robot_is_told_also_by_a_file(tmp_path):
    """Two robots that differ in that word alone."""
    scene = reach_avoid(
        pj.box([0.2, -0.5, -1], [1, 0.5, 1]), [pj.box([0.4, 0.9], [0.6, 1.2])], 0.05
    )
    for word, of in ((TURNS, "heading"), (STAYS, "none")):
        model = told(line_model(4, 0.01), rotation=(word,)).with_labels({"q": ("heading [rad]",)})
        answer = Planner(model).solve(scene, KEY, SMALL, at=[0.0, 0.0, 0.1])
        said = f"turns with its heading, and of its goal states {of}, is declared by the system."
        assert said in answer.details() and said in answer.summary()
        assert said in answer.choose().details()
        told_by_file = answer.save(tmp_path / "answer.json").read_text()
        assert told_by_file.count(said) >= 2  # the statement, and what the checker prints of it


def test_a_robust_question_says_what_turns_and_which_goal_states_are_exact():
    """Of a place alone a heading is that of the runs; a goal of places leaves its states exact."""
    goal, wall = pj.box([-9.0] * 3, [9.0] * 3), pj.box([8.0, 8.0], [9.0, 9.0])
    of_runs = "within ±0.1 rad of that of the model's runs, each turned about its start"

    def said(word, at=None, **known):
        model = told(line_model(4, 0.01), rotation=(word,)).with_labels({"q": ("yaw [rad]",)})
        scene = reach_avoid(goal, [wall], 0.05, uncertainty=Uncertainty(**known))
        return query(scene, model, at).nominal().uncertainty.meaning

    for at in (None, [0.0, 0.0, 0.3]):
        own = "within ±0.1 rad of the one asked about." if at else f"{of_runs}, with its yaw."
        assert f"every heading {own}" in said(TURNS, at, heading=0.1)
    assert f"every heading {of_runs}." in said(STAYS, heading=0.1)
    exact = "every goal moved by up to ±0.02 m in place, its yaw exactly as told."
    assert exact in said(TURNS, goal=0.02)
    assert "every goal moved by up to ±0.02 m, ±0.02 m, ±0.1 rad." in said(
        TURNS, goal=[0.02, 0.02, 0.1]
    )


def test_copied_goal_states_are_named_by_their_execution(tmp_path):
    """A sentence about the robot names its own, whichever stand for all executions."""
    model = told(line_model(4, 0.01), rotation=(TURNS,)).with_labels({"q": ("yaw [rad]",)})
    goal, wall = pj.box([0.2, -0.5, -1], [1, 0.5, 1]), pj.box([0.4, 0.9], [0.6, 1.2])
    scene = reach_avoid(goal, [wall], 0.05, uncertainty=Uncertainty(k={0: 0.02}))
    answer = Planner(model).solve(scene, KEY, SMALL, at=[0.0, 0.0, 0.1])
    each = "yaw in execution 0 [rad]", "yaw in execution 1 [rad]"
    assert answer.model.labels.q == each
    own = "and of its goal states yaw, is declared by the system."
    for said in (answer.details(), answer.summary(), answer.save(tmp_path / "a.json").read_text()):
        assert own in said and "yaw 0" not in said


def test_errors_of_places_are_said_to_lie_along_the_axes_of_the_world(tmp_path):
    """Though all else is told in the robot's frame: a box across is one along for who faces +y."""
    model = told(line_model(4, 0.01), rotation=(TURNS,))
    scene = reach_avoid(pj.box([-0.5, 0.2, -9], [0.5, 1, 9]), [], 0.05)
    scene = scene.replace(uncertainty=Uncertainty(start=[0.2, 0.0], goal=0.01))
    said = "exactly as told, errors of place along the axes of the world, not of the robot"
    answer = Planner(model).solve(scene, KEY, SMALL, at=[0.0, 0.0, np.pi / 2])
    assert said in answer.details() and said in answer.summary()
    assert "For example: in the robot's frame, start at x = 0 m, y = 0 m" in verdict(answer, "a")
    report = checker.check_answer(json.loads(answer.save(tmp_path / "a.json").read_text()))
    assert any(said in line for line in report.said)
    for known in (scene.uncertainty, Uncertainty(heading=0.01)):  # no axes but the world's, or none
        at = [0.0, 0.0] if known.start else [0.0, 0.0, np.pi / 2]
        asked = query(scene.replace(uncertainty=known), model, at).nominal()
        assert "axes" not in asked.uncertainty.words


@pytest.mark.parametrize("angle", [1e-6, 0.003, 0.1, 0.5, 0.99])
def test_turns_are_mixtures_of_the_maps(angle):
    turn = turn_by(angle, (TURNS, STAYS))
    assert turn.of_q[0] > angle and turn.of_q[1] == 0 and math.sin(angle) <= turn.sine < 1
    corners = [(Fraction(m[0, 0]), Fraction(m[1, 0])) for m in turn.maps]
    for share in np.linspace(-1, 1, 41):
        point = [Fraction(math.cos(share * angle)), Fraction(math.sin(share * angle))]
        (ax, ay), (bx, by), (gx, gy) = corners
        area = (bx - ax) * (gy - ay) - (by - ay) * (gx - ax)
        one = ((point[0] - ax) * (gy - ay) - (point[1] - ay) * (gx - ax)) / area
        two = ((bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)) / area
        assert one >= 0 and two >= 0 and one + two <= 1
    assert float(corners[2][0]) < 1 / math.cos(angle) + 1e-2


def test_a_line_that_cuts_the_circle_is_no_side():
    a, b = Fraction(4, 5), Fraction(3, 5)
    assert misses_circle(a, b, 1 / a)
    assert not misses_circle(a, b, 1 / a - Fraction(1, 1000))
    assert not misses_circle(a, b - Fraction(1, 1000), 1 / a)


def test_a_scene_seen_from_a_pose_is_the_scene(rng):
    """With no errors a robot that turns is the model turned: the same verdicts, with both."""
    model, problem = toy_case(0)
    model = told(model, rotation=(TURNS,))
    still = replace(
        model.claim.tube, interval=model.claim.tube.interval * 0, final=model.claim.tube.final * 0
    )
    model = told(model, tube=still)
    heading = 0.7
    world = turned(model, heading)
    p0, k = anchored_plans(rng, world, 40)
    there = verdicts(scene_of(problem, world), p0, k)
    for i in range(0, 40, 4):
        seen = from_here(problem, model, pose_of([*p0[i], heading], model))
        here = verdicts(scene_of(seen, model), np.zeros((1, 2)), k[i : i + 1])
        assert here.clearance[0] == pytest.approx(there.clearance[i], abs=1e-9)
        assert here.clearance[0] <= there.clearance[i] + 1e-12
        assert here.goal[0] == pytest.approx(there.goal[i], abs=1e-9)
        assert here.safe[0] == there.safe[i]


@pytest.mark.slow
def test_plans_withstand_every_heading_within_the_angle(rng):
    model, problem = toy_case(4)
    model = told(model, rotation=(TURNS,))
    asked = query(
        problem.replace(uncertainty=Uncertainty(heading=0.05, start=0.01)), model
    ).nominal()
    p0, k = anchored_plans(rng, model, 400)
    safe = verdicts(scene_of(asked.problem, asked.model), p0, k).safe
    before = verdicts(scene_of(problem, model), p0, k).safe
    assert (before | ~safe).all() and 5 < safe.sum() < before.sum()
    every = np.ones(len(k), bool)
    for share in (-1, -0.5, 0, 0.3, 1):
        off = 0.01 * np.array([corners_and_inside(rng, 2) for _ in k])
        other = turned(model, 0.05 * share * (1 - 1e-12), widths=True)
        every &= verdicts(scene_of(problem, other), p0 + off, k).safe
    assert (every | ~safe).all() and safe.sum() > 0.6 * every.sum()


@pytest.mark.slow
def test_a_less_certain_heading_never_adds_plans(rng):
    """On these plans; an angle of zero is no uncertainty at all."""
    model, problem = toy_case(4)
    model = told(model, rotation=(TURNS,))
    p0, k = anchored_plans(rng, model, 400)
    none = query(problem.replace(uncertainty=Uncertainty(heading=0.0)), model).nominal()
    assert none.uncertainty is None and none.model is model
    assert np.array_equal(none.problem.goal.b, problem.goal.b)
    before = verdicts(scene_of(problem, model), p0, k).safe
    counts = [before.sum()]
    for angle in (0.01, 0.05, 0.1):
        asked = query(problem.replace(uncertainty=Uncertainty(heading=angle)), model).nominal()
        safe = verdicts(scene_of(asked.problem, asked.model), p0, k).safe
        assert (before | ~safe).all()
        before = safe
        counts.append(safe.sum())
    assert counts[0] > counts[1] > counts[3]


@pytest.mark.slow
def test_a_goal_of_named_points_is_one_of_their_copies(rng):
    """Its names are checked against the robot's own points, before there are copies."""
    model = told(points_model(rng), rotation=(STAYS,))
    problem = points_problem(rng, model, n_obstacles=0)
    uncertainty = Uncertainty(heading=0.02, k={0: 0.01})
    asked = [
        query(one.replace(uncertainty=uncertainty), model).nominal()
        for one in (problem, problem.replace(points=()))
    ]
    assert asked[0].problem.points == asked[0].model.points
    assert len(asked[0].model.points) == model.n_points * 2 * 3
    k = rng.uniform(-0.9, 0.9, (300, 2))
    end = model.layout.n_steps * model.n_c - model.n_p  # of the first point
    p0 = rng.uniform(-0.8, 0.8, (300, 2)) - outputs(model.net, k)[:, end : end + 2]
    named, bare = (verdicts(scene_of(q.problem, q.model), p0, k).safe for q in asked)
    assert (named == bare).all() and named.any() and not named.all()
    other = problem.replace(points=problem.points[::-1], uncertainty=uncertainty)
    with pytest.raises(InputError, match="goal: expected the reference points of this model, c0"):
        query(other, model).nominal()


@pytest.fixture(scope="module")
def asked():
    """A model with rotation, a problem, and a pose from which there are plans."""
    model, problem = toy_case(0)
    model = told(model, rotation=(TURNS,))
    free = Planner(model).solve(problem, KEY, SMALL.replace(samples=1, samples_only=True))
    at = [*free.samples[0, :2], 0.0]
    return model, problem, at


@pytest.fixture(scope="module")
def here(asked):
    """The same, and the answer."""
    model, problem, at = asked
    return *asked, Planner(model).solve(problem, KEY, SMALL, at=at)


@pytest.mark.slow
def test_answers_from_here_are_sets_in_k_alone(here, rng):
    model, problem, at, answer = here
    cut = answer.polytopes(KEY, 500)
    assert answer.status is pj.types.Status.PROVED and len(answer.samples) and len(cut)
    assert (answer.samples[:, :2] == 0).all()
    assert {one.n for one in cut.sets} == {2}
    drawn = np.concatenate([answer.sample(KEY, 25), cut.sample(KEY, 25)])
    assert (drawn[:, :2] == 0).all()
    starts = np.tile(at[:2], (50, 1))
    assert verdicts(scene_of(problem, model), starts, drawn[:, 2:]).safe.all()
    k = rng.uniform(-1, 1, (4000, 2))
    share = verdicts(scene_of(problem, model), np.tile(at[:2], (4000, 1)), k).safe.mean()
    estimate, low, high = answer.cover.safe_volume(0.9999)
    assert low / 4 - 0.02 < share < high / 4 + 0.02 and estimate > 0
    assert cut.volumes.max() <= high  # several may overlap
    assert 0 < answer.share_of_k() <= share + 0.02
    assert "with heading 0 rad" in answer.details()


@pytest.mark.slow
def test_answers_from_here_can_be_kept(here, tmp_path):
    answer = here[3]
    again = pj.load_answer(answer.save(tmp_path / "answer.json"))
    assert (
        again.details().startswith(answer.details()) and (again.scene.at == answer.scene.at).all()
    )
    assert again.scene.nominal.pose.heading == 0.0


def test_what_is_no_pose_is_refused(asked):
    model, problem, at = asked
    planner = Planner(model)
    with pytest.raises(InputError, match="at: expected x, y or x, y, heading; got 4 numbers"):
        planner.solve(problem, KEY, SMALL, at=[*at, 1.0])
    with pytest.raises(InputError, match=r"at heading: expected rad, at most 12.6; got 45. Is it"):
        planner.solve(problem, KEY, SMALL, at=[*at[:2], 45.0])
    plain_model = told(model, rotation=None)
    with pytest.raises(InputError, match="at: expected a planar system that declares rotation"):
        Planner(plain_model).solve(problem, KEY, SMALL, at=at)
    with pytest.raises(
        InputError, match="uncertainty heading: expected a planar system that declares"
    ):
        Planner(plain_model).solve(
            problem.replace(uncertainty=Uncertainty(heading=0.1)), KEY, SMALL
        )
    fenced = problem.replace(start=pj.hpolytope([[1.0, 0.0]], [at[0] - 1]))
    with pytest.raises(InputError, match="at: expected a place within the start set"):
        planner.solve(fenced, KEY, SMALL, at=at)
    flat = problem.replace(body=Polygon(np.zeros((1, 2))))
    sentence = "body: expected one that turns with this robot.*got a polygon, which never turns"
    for one in (flat, flat.replace(uncertainty=Uncertainty(heading=0.1))):
        for here in (None, at[:2], at):
            with pytest.raises(InputError, match=sentence):
                planner.solve(one, KEY, SMALL, at=here)
        with pytest.raises(InputError, match=sentence):
            require_fit(one, model)
    lo, hi = np.zeros((1, model.n_c + model.n_q)), np.ones((1, model.n_c + model.n_q))
    post = [[2.0, 2.0]], [[2.1, 2.1]]
    with pytest.raises(InputError, match=sentence):
        planner.solve_batch(pj.problem.box_scenes(model, lo, hi, *post, flat.body), KEY)
    require_fit(flat, plain_model)  # of one that declares no rotation, sentences tell it


@pytest.mark.night
def test_sets_of_one_parameter_are_intervals():
    """The straight robot from the origin with k_1 given reaches x in the goal for k_0 there."""
    model = line_model(T=4)
    goal = pj.box([0.2, -0.1, -1.0], [0.4, 0.1, 1.0])
    problem = reach_avoid(goal, [], 0.1, uncertainty=Uncertainty(given={1: 0.0}))
    answer = Planner(model).solve(problem, KEY, SMALL, at=[0.0, 0.0])
    (only,) = answer.polytopes(KEY, 200).sets
    assert only.n == 1 and np.allclose(sorted(only.b / only.A[:, 0]), [0.2, 0.4], atol=1e-9)


def test_rotation_is_declared_word_by_word():
    class Robot:
        name, n_p, n_q, rotation = "robot", 2, 2, (TURNS, STAYS)

    assert rotation_of(Robot()) == (TURNS, STAYS)
    for wrong in ((TURNS,), ("spins", STAYS), "turns"):
        Robot.rotation = wrong
        with pytest.raises(InputError, match="robot: expected rotation of a system in the plane"):
            rotation_of(Robot())
    Robot.rotation = None
    assert rotation_of(Robot()) is None


def test_a_model_keeps_what_its_system_declares(tmp_path):
    model = told(line_model(), rotation=(STAYS,))
    assert pj.load(model.save(tmp_path / "model.npz")).rotation == (STAYS,)
    assert pj.load(line_model().save(tmp_path / "other.npz")).rotation is None


def test_errors_turn_with_the_robot(rng):
    angle = 0.4
    turn = turn_by(angle, ())
    widths = rng.uniform(0, 1, (50, 2))
    errors = widths * rng.choice([-1, 1], (50, 2))
    for share in np.linspace(-1, 1, 9):
        c, s = math.cos(share * angle), math.sin(share * angle)
        assert (np.abs(errors @ np.array([[c, s], [-s, c]])) <= turn.widened(widths)).all()


def test_the_published_search_knows_no_place(asked):
    model, problem, at = asked
    with pytest.raises(InputError, match="at: expected the exact engine"):
        Planner(model).solve(problem, KEY, SMALL.replace(method=Published()), at=at)
