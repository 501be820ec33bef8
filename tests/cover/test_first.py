"""The first safe plans: judged as every plan is, uniform over the safe set."""

import jax
import numpy as np
import pytest
from scipy.stats import ks_2samp
from toy_bodies import points_model, points_problem
from toy_models import line_model, random_polygon, toy_case

from parc_jax import method
from parc_jax.common.keys import key_of
from parc_jax.common.sets.box import box
from parc_jax.common.status import Status
from parc_jax.method import FirstProved
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.certificate.prove import prove
from parc_jax.safe_set.corridors.first import MOST, first_draw
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

KEYS = [jax.random.PRNGKey(seed) for seed in range(40)]
PROVED = Settings.fast().replace(samples=1, proof=True, method=FirstProved())


def crowd(number: int = 8, n: int = 6):
    """A model and obstacles about the paths, so many that the last ones count."""
    model, problem = toy_case(number)
    rng = np.random.default_rng(number)
    more = [random_polygon(rng, rng.uniform(-0.8, 0.8, 2), 0.1) for _ in range(n - 2)]
    return model, problem.replace(obstacles=(*problem.obstacles, *more), spans=())


def turning():
    rng = np.random.default_rng(3)
    model = points_model(rng, fitted=True)
    return model, points_problem(rng, model)


def test_where_no_end_fits_into_the_goal_the_exact_engine_answers():
    """It ended in a ValueError about shapes, and an older answer.json stayed."""
    wide, goal = line_model(4, 0.6), box([-0.5, -0.5, -9], [0.5, 0.5, 9])
    found = Planner(wide).solve(reach_avoid(goal, [], 0.1), KEYS[0], PROVED)
    assert not found.status.found


@pytest.mark.parametrize(
    "question",
    [
        toy_case,
        pytest.param(crowd, marks=pytest.mark.night),
        pytest.param(turning, marks=pytest.mark.slow),
    ],
)
def test_every_plan_is_judged_as_all_plans_are(question):
    model, problem = question(8) if question is not turning else question()
    scene = scene_of(problem, model)
    seen = 0
    for key in KEYS[:12]:
        one = first_draw(scene, key, 4).safe
        e = verdicts(scene, one.p0, one.k)
        assert e.safe.all()
        np.testing.assert_array_equal(e.bin, one.bin)
        np.testing.assert_array_equal(e.pattern, one.pattern)
        np.testing.assert_allclose(e.path, one.path, rtol=0, atol=1e-12)
        seen += len(one.k)
    assert seen > 30


@pytest.mark.night
def test_plans_are_uniform_over_the_safe_set_and_their_counts_those_of_draws():
    model, problem = crowd()
    scene = scene_of(problem, model)
    ones = [first_draw(scene, key, MOST) for key in KEYS]
    mine = np.concatenate([np.concatenate([d.safe.p0, d.safe.k], axis=1) for d in ones])
    whole = draw(scene, np.random.default_rng(0), 20_000)
    theirs = np.concatenate([whole.safe.p0, whole.safe.k], axis=1)
    assert len(mine) > 300
    for axis in range(mine.shape[1]):
        assert ks_2samp(mine[:, axis], theirs[:, axis]).pvalue > 1e-4
    drawn, reaching = (sum(getattr(d, name) for d in ones) for name in ("drawn", "reaching"))
    for part, share in ((reaching, whole.reaching), (len(mine), len(whole.safe.k))):
        expected = drawn * share / whole.drawn
        assert abs(part - expected) < 5 * np.sqrt(expected)
    assert ones[0].volume == pytest.approx(whole.volume)
    until_one = [first_draw(scene, key, 1) for key in KEYS]
    drawn = sum(d.drawn for d in until_one)  # nothing after the plan that was asked for
    expected = drawn * len(whole.safe.k) / whole.drawn
    assert abs(len(KEYS) - expected) < 5 * np.sqrt(expected)


@pytest.mark.slow
def test_a_prepared_question_answers_as_the_planner_does():
    model, problem = toy_case(8)
    planner = Planner(model)
    prepared = planner.prepare(problem)
    settings = Settings(samples=3, samples_only=True)
    ours, theirs = (
        prepared.solve(KEYS[0], settings),
        planner.solve(problem, KEYS[0], settings),
    )
    np.testing.assert_array_equal(ours.samples, theirs.samples)
    assert ours.cover.proved and len(ours.samples) == 3
    plans = prepared.first(KEYS[0], 3)
    assert {tuple(x) for x in plans.plans} == {tuple(x) for x in ours.samples}
    e = verdicts(prepared.scene, plans.plans[:, :2], plans.plans[:, 2:])
    np.testing.assert_allclose(plans.clearance, e.clearance, rtol=0, atol=1e-12)


@pytest.mark.night
def test_plans_from_one_place_start_there():
    model, problem = toy_case(8)
    anywhere = Planner(model).prepare(problem).first(KEYS[0]).plans[0]
    here = Planner(model).prepare(problem, at=anywhere[:2])
    plans = np.concatenate([here.first(key, 4).plans for key in KEYS[:6]])
    assert len(plans) and (plans[:, :2] == anywhere[:2]).all()
    e = verdicts(here.scene, plans[:, :2], plans[:, 2:])
    assert e.safe.all()


def test_among_no_obstacles_as_many_plans_come_as_are_asked_for():
    """Every clearance is infinite there, and ends no search."""
    question = Planner(line_model(e=0.01)).prepare(
        reach_avoid(box([0, -1, -9], [1, 1, 9]), [], 0.05)
    )
    plans = question.first(KEYS[0], MOST)
    assert len(plans.plans) == MOST and np.isinf(plans.clearance).all()
    assert repr(plans) == f"<FirstPlans: 16 safe of {plans.drawn} drawn under an assumed tube>"


def one_proved(question, seed: int, at=None):
    """A plan proved on the host: of its answer the verdict that every plan is judged by."""
    model, problem = question
    answer = Planner(model).solve(problem, key_of(seed), PROVED, at=at)
    assert answer.status is Status.PROVED and answer.samples.shape == (1, model.n_p + model.n_k)
    p0, k = np.split(answer.samples, [model.n_p], axis=1)
    e = verdicts(answer.scene, p0, k)
    assert e.safe.all()
    np.testing.assert_array_equal(e.pattern, answer.cover.points.pattern)
    np.testing.assert_allclose(e.path, answer.cover.points.path, rtol=0, atol=1e-12)
    return answer


@pytest.mark.parametrize("question", [toy_case, turning])
def test_a_plan_that_is_proved_on_the_host_is_safe_by_the_verdict(question):
    question = question(8) if question is not turning else question()
    answers = [one_proved(question, seed) for seed in range(6)]
    assert all(answer.share is None for answer in answers)  # nothing is counted
    assert len({tuple(answer.samples[0]) for answer in answers}) == 6
    start = answers[0].samples[0, :2]
    here = one_proved(question, 7, at=start)
    assert (here.samples[0, :2] == start).all() and here.share is None


def test_the_exact_checker_decides_which_plan_is_the_first(monkeypatch):
    """Also where floats call everything separated."""
    model, problem = toy_case(8)
    asked = []

    def judged(*question):
        asked.append(prove(*question))
        return asked[-1]

    monkeypatch.setattr(method, "prove", judged)
    everything = np.ones((1, model.time.n_steps), bool)
    monkeypatch.setattr(
        method, "separating", lambda scene, *_: [everything] * len(scene.directions.multipliers)
    )
    for seed in range(6):
        one_proved((model, problem), seed)
    verdict_of = [bool(accepted[0]) for accepted, *_ in asked]
    assert sum(verdict_of) == 6 < len(verdict_of)


def test_where_no_plan_is_proved_on_the_host_the_search_goes_on(monkeypatch):
    looked = []
    monkeypatch.setattr(method, "_first_proved", lambda *question: looked.append(question))
    answer = one_proved(toy_case(8), 0)
    assert len(looked) == method.ROUNDS and answer.share is not None
