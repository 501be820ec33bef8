"""Questions under uncertainty of start, goal and obstacles, against the truth at corners and inside
of the uncertainty, in exact arithmetic.
"""

import json
from fractions import Fraction

import jax
import numpy as np
import pytest
from exact_oracle import exact_safe
from toy_bodies import points_model
from toy_models import anchored_plans, line_model, toy_case
from uncertain import NEARLY, corners_and_inside

import parc_jax as pj
from parc_jax import checker
from parc_jax.answer.answer import answer_data
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.common.sets.rational import exact_support, rational_vertices
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.network.predict import Layout
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import moved_tube, query, robust_scene
from parc_jax.problem.robust.realisations import OF_MORE
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.proof.certificate.write import question_parts
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

KEY = jax.random.PRNGKey(0)
SMALL = Settings(samples=12, target=0.2, budget_s=300)
TRIANGLE = hpolytope([[1.0, 1.0], [-1.0, 2.0], [0.0, -1.0]], [0.03, 0.02, 0.01])
SQUARE = box([-0.02, -0.02], [0.02, 0.02])
UNCERTAINTY = Uncertainty(start=[0.03, 0.02], goal=[0.02, 0.01, 0.03], obstacles=[TRIANGLE, SQUARE])
OF_RUNS = "All plans start with the heading of the model's runs."


def test_robust_models_that_are_kept_are_of_the_model_that_is_asked():
    """Whose tube is wider is not asked with the tube of another, whatever was kept."""
    kept: dict = {}
    for e in (0.01, 0.02):
        model, problem = line_model(4, e), toy_case(0)[1]
        asked = problem.replace(uncertainty=Uncertainty(start=0.05))
        robust = query(asked, model).nominal(kept).model
        assert np.allclose(robust.tube.interval, e + 0.05)


def in_triangle(rng) -> np.ndarray:
    """A corner of the triangle, or a point inside."""
    vertices = np.array(rational_vertices(TRIANGLE), float)
    weights = np.eye(3)[rng.integers(3)] if rng.random() < 0.5 else rng.dirichlet(np.ones(3))
    middle = vertices.mean(axis=0)
    return middle + (weights @ vertices - middle) * NEARLY


def truth(rng, problem):
    """One possible truth behind a scene that is seen with UNCERTAINTY, and how far the start is
    off."""
    moves = [in_triangle(rng), 0.02 * corners_and_inside(rng, 2)]
    obstacles = tuple(
        o.replace(b=o.b + o.A @ move) for o, move in zip(problem.obstacles, moves, strict=True)
    )
    goal = problem.goal
    goal = goal.replace(
        b=goal.b + goal.A @ (UNCERTAINTY.of_goal(2, 1) * corners_and_inside(rng, 3))
    )
    asked = problem.replace(goal=goal, obstacles=obstacles, uncertainty=None)
    return asked, UNCERTAINTY.shifts(2) * corners_and_inside(rng, 2)


def withstands(rng, problem, model, p0, k, draws: int) -> bool:
    for _ in range(draws):
        asked, off = truth(rng, problem)
        if not exact_safe(asked, model, p0 + off, k):
            return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 4])
def test_plans_withstand_the_uncertainty_and_no_more_is_given_up_than_has_to_be(number, rng):
    model, problem = toy_case(number, start=True)
    asked = query(problem.replace(uncertainty=UNCERTAINTY), model).nominal()
    p0, k = anchored_plans(rng, model, 300)
    safe = verdicts(scene_of(asked.problem, asked.model), p0, k).safe
    before = verdicts(scene_of(problem, model), p0, k).safe
    assert (before | ~safe).all() and 0 < safe.sum() < before.sum()
    for i in np.flatnonzero(safe)[:8]:
        assert withstands(rng, problem, model, p0[i], k[i], 4)
    # plain verdicts of a scene grown by less are safe for all of them; of the lost ones most fail
    lost = np.flatnonzero(before & ~safe)[:10]
    kept = sum(withstands(rng, problem, model, p0[i], k[i], 20) for i in lost)
    assert kept <= len(lost) / 2


@pytest.mark.slow
def test_the_answer_is_proved_and_says_what_it_withstands(rng):
    model, problem = toy_case(0)
    uncertainty = Uncertainty(
        start=[0.03, 0.02], goal=[0.02, 0.01, 0.03], obstacles=SQUARE, sensing_eps=0.001
    )
    robust = Planner(model).solve(problem.replace(uncertainty=uncertainty), KEY, SMALL)
    assert robust.cover.proved and robust.cover.refused == 0
    assert len(robust.samples) and len(robust.corridors)
    text = robust.details()
    assert "every start within ±0.03, ±0.02 m" in text and "probability at most 0.001" in text
    inside = robust.sample(KEY, 40)
    offs = np.array([uncertainty.shifts(2) * corners_and_inside(rng, 2) for _ in inside])
    scene = scene_of(problem, model)
    assert verdicts(scene, inside[:, :2] + offs, inside[:, 2:]).safe.all()


def test_the_boxes_of_doubt_of_the_plain_question_say_the_same():
    """Another proof of every sample: the checker proves its box of doubt about the question as it
    was asked.
    """
    model, problem = toy_case(0, start=True)
    uncertainty = Uncertainty(start=[0.03, 0.02])
    robust = Planner(model).solve(problem.replace(uncertainty=uncertainty), KEY, SMALL)
    context = checker.Context(*question_parts(problem, model))
    assert len(robust.certificates) > 5
    for part in robust.certificates:
        room = {"p0": ["0.03", "0.02"], "k": ["0", "0"]}
        checker.check_doubt(context, part | {"room": room})
        with pytest.raises(checker.Rejected):
            checker.check_doubt(context, part | {"room": {"p0": ["0.9", "0.9"], "k": ["0", "0"]}})


@pytest.mark.slow
def test_no_uncertainty_is_the_answer_of_today_bit_for_bit():
    model, problem = toy_case(1)
    nothing = problem.replace(
        uncertainty=Uncertainty(start=0.0, goal=[0.0, 0.0, 0.0], k=[0.0, 0.0])
    )
    fixed = SMALL.replace(budget_s=300, target=0.3)
    one, other = (answer_data(Planner(model).solve(p, KEY, fixed)) for p in (problem, nothing))
    assert one == other


def test_more_uncertainty_never_adds_plans(rng):
    model, problem = toy_case(0, start=True)
    p0, k = anchored_plans(rng, model, 600)
    before = np.ones(600, bool)
    counts = []
    for size in (0.0, 0.5, 1.0, 2.0):
        square = box([-0.02 * size] * 2, [0.02 * size] * 2)
        uncertainty = Uncertainty(start=0.02 * size, goal=0.01 * size, obstacles=square)
        asked = query(problem.replace(uncertainty=uncertainty), model).nominal()
        safe = verdicts(scene_of(asked.problem, asked.model), p0, k).safe
        assert (before | ~safe).all()
        before = safe
        counts.append(int(safe.sum()))
    assert counts[0] > counts[1] > counts[3]


@pytest.mark.night
def test_a_batch_under_uncertainty_answers_as_its_problems_would(rng):
    model, problem = toy_case(0)
    uncertainties = [Uncertainty(start=0.02, goal=0.01), Uncertainty(start=0.02, obstacles=SQUARE)]
    asked = [problem.replace(uncertainty=d) for d in uncertainties]
    batch = Planner(model).solve_batch(asked, KEY, Settings.fast(), draws=512)
    assert batch.found.all()
    for row, uncertainty in enumerate(uncertainties):
        plans = batch.plans[row]
        off = uncertainty.shifts(2) * np.array([corners_and_inside(rng, 2) for _ in plans])
        assert verdicts(scene_of(problem, model), plans[:, :2] + off, plans[:, 2:]).safe.all()
    with pytest.raises(InputError, match="problem 1 is under another one than problem 0"):
        other = [asked[0], problem.replace(uncertainty=Uncertainty(start=0.03))]
        Planner(model).solve_batch(other, KEY)


def test_what_cannot_be_asked_is_refused():
    model, problem = toy_case(0)
    with pytest.raises(
        InputError, match="less uncertainty of start and goal than the goal is wide"
    ):
        Planner(model).solve(
            problem.replace(uncertainty=Uncertainty(start=0.3, goal=0.3)), KEY, SMALL
        )
    with pytest.raises(InputError, match="one half width, or 2, one per axis, or with q; got 4"):
        Planner(model).solve(problem.replace(uncertainty=Uncertainty(goal=[0.1] * 4)), KEY, SMALL)
    with pytest.raises(InputError, match="scene: expected a nominal problem"):
        scene_of(problem.replace(uncertainty=UNCERTAINTY), model)


def test_an_answer_under_uncertainty_can_be_kept(tmp_path):
    model, problem = toy_case(0)
    answer = Planner(model).solve(problem.replace(uncertainty=Uncertainty(start=0.02)), KEY, SMALL)
    again = pj.load_answer(answer.save(tmp_path / "answer.json"))
    assert (
        again.details().startswith(answer.details())
        and again.scene.nominal.uncertainty == answer.scene.nominal.uncertainty
    )
    assert (again.samples == answer.samples).all()
    report = checker.check_answer(json.loads((tmp_path / "answer.json").read_text()))
    assert report.said == [answer.scene.nominal.uncertainty.meaning, OF_RUNS]


def test_the_start_set_shrinks_and_the_goal_by_what_points_do_together():
    """Two points that move alike: what asks for their distance shrinks by nothing."""
    goal = hpolytope([[1.0, 0, 1.0, 0], [-1.0, 0, 1.0, 0], [0, 1.0, 0, 0]], [4.0, 1.0, 3.0])
    problem = pj.reach_avoid(goal, [], 0.1, start=box([0.0, 0.0], [1.0, 2.0]))
    asked = robust_scene(
        problem, Uncertainty(start=[0.25, 0.5], goal=[0.125, 0.0]), Layout(4, 2, 2)
    )
    assert asked.goal.b.tolist() == [4 - 0.75, 1.0, 2.5]
    assert asked.start.b.tolist() == [0.75, 1.5, -0.25, -0.5]


def test_slanted_tubes_hold_a_moved_start(rng):
    model = points_model(rng, fitted=True)
    wide = moved_tube(model.tube, np.array([0.03, 0.01]))
    w = rng.normal(size=(50, 2))
    before, after = (at(t.errors, (0, 1, 2, None)).support(w) for t in (model.tube, wide))
    assert (after >= before + np.abs(w) @ [0.03, 0.01] - 1e-12).all()


def test_faces_that_fit_and_move_with_the_start_hold_more_than_all_of_it(rng):
    """A face that no error touches lets more in once it has moved."""
    asked = pj.reach_avoid(box([-9.0] * 9, [9.0] * 9), [box([50.0, 0.0], [51.0, 1.0])], 0.1)
    asked = asked.replace(uncertainty=Uncertainty(start=[0.03, 0.01]))
    told = query(asked, points_model(rng, fitted=True)).nominal().uncertainty
    assert "cannot show to withstand" in told.meaning


def test_a_measured_value_where_bins_meet_has_the_wider_error_along_each_axis():
    """Errors (0.1, 0.5) on one side of 1.5, (0.5, 0.1) on the other: at 1.5 the box of both stands
    for either, and so "no plan" is none that is shown to be safe.
    """
    net = pj.learning.relu_network([np.array([[1.0, 0.0], [0.0, 0.0]])], [np.zeros(2)])
    during, end = np.array([[[0.1, 0.5]], [[0.5, 0.1]]]), np.array([[0.05, 0.05]] * 2)
    tube = pj.learning.tube([[0.0, 4.0], [1.0, 1.5, 2.0]], during, end)
    time = pj.learning.time_grid(1.0, 1.0, 1.0)
    claim = pj.learning.declared_claim(tube, "this test says so", net, time)
    model = pj.learning.trajectory_model(net, claim)
    corner = pj.hpolytope([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]], [-2.75, 3.5, 3.5])
    goal, start = pj.box([1.9, -0.1], [2.1, 0.1]), pj.box([-0.01, -0.01], [0.01, 0.01])
    key, soon = jax.random.key(0), pj.Settings(samples=1, target=0.1)

    def asked(load):
        known = pj.Uncertainty(given={1: load})
        problem = pj.reach_avoid(goal, [corner], 0.0, start, uncertainty=known)
        return pj.Planner(model).solve(problem, key, soon)

    assert asked(1.4).status.found
    none = asked(1.5)
    assert none.scene.nominal.uncertainty.more and OF_MORE in none.details()


def test_a_tube_that_is_wider_at_its_end_than_before_holds_more_where_it_moves():
    """What the last interval does not let in at the end, it lets in once it has grown."""
    model, problem = toy_case(0)
    asked = problem.replace(uncertainty=Uncertainty(start=0.02))
    for share, said in ((1.0, False), (3.0, True)):
        final = np.full(model.tube.final.shape, share * model.tube.interval[:, -1].min())
        tube = pj.learning.tube(model.tube.edges, model.tube.interval, final)
        claim = pj.learning.declared_claim(tube, "a test", model.net, model.time)
        told = query(asked, pj.learning.trajectory_model(model.net, claim)).nominal().uncertainty
        assert ("cannot show to withstand" in told.meaning) == said


def test_obstacles_that_may_be_moved_are_sums_that_hold_all_of_it_and_hardly_more(rng):
    """Boxes, slanted rectangles, wedges with a needless row: many at once, against exact sums."""
    half = np.array([0.01, 0.25])
    square = np.concatenate([np.eye(2), -np.eye(2)])
    obstacles = [from_box(box([i, 0.3], [i + 0.1, 0.7])) for i in range(3)]
    for angle in rng.uniform(0, 2 * np.pi, 6):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        obstacles.append(hpolytope(square @ turn, rng.uniform(0.5, 2, 4)))
    obstacles.append(hpolytope([*square, [1.0, 1.0]], [1.0, 1.0, 1.0, 1.0, 9.0]))
    problem = reach_avoid(box([-9.0] * 3, [9.0] * 3), obstacles, 0.1)
    moved = robust_scene(problem, Uncertainty(start=half), Layout(4, 2, 1), whole=True).obstacles
    for before, after in zip(obstacles, moved, strict=True):
        for w in np.concatenate([after.A, rng.normal(size=(20, 2))]):
            exact = [Fraction(float(x)) for x in w]
            inside = exact_support(rational_vertices(before), w)
            whole = inside + sum(abs(a) * Fraction(h) for a, h in zip(exact, half, strict=True))
            outside = exact_support(rational_vertices(after), w)
            assert whole <= outside <= whole + Fraction(1, 10**11)
