"""The first safe plans: judged as every plan is, uniform over the safe set, in one call that moves
nothing.
"""

from dataclasses import replace

import jax
import numpy as np
import pytest
from compilations import compiled_by
from scipy.stats import ks_2samp
from toy_bodies import points_model, points_problem
from toy_models import line_model, random_polygon, rectangle, toy_case

from parc_jax.common.arrays import x64
from parc_jax.common.backend import ACCELERATOR, CPU
from parc_jax.common.sets.box import box
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.safe_set.corridors import first as first_module
from parc_jax.safe_set.corridors.first import MOST, first_draw, first_safe, placed
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import pruned_scene, scene_of

KEYS = [jax.random.PRNGKey(seed) for seed in range(40)]


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
@pytest.mark.parametrize("question", [crowd, turning])
def test_in_turn_and_side_by_side_find_the_same_plans(question):
    ways = [replace(how, round=64, rounds=1) for how in (CPU, ACCELERATOR)]
    model, problem = question()
    asked = placed(pruned_scene(NominalProblem(problem, model)))
    (device,) = asked.scene.count.devices()
    found = []
    for key in KEYS[:8]:
        for n in (4, MOST):
            with x64():
                both = [
                    first_module._first_safe(
                        asked, key, first_module._number(n, device), MOST, how
                    )[0]
                    for how in ways
                ]
            turn, side = jax.device_get(both)
            found.append(int(turn.count))
            for name in ("count", "judged", "reaching"):
                assert getattr(turn, name) == getattr(side, name)
            valid = slice(found[-1])
            np.testing.assert_array_equal(turn.plans[valid], side.plans[valid])
            np.testing.assert_allclose(turn.clearance[valid], side.clearance[valid], atol=1e-12)
    assert max(found) > 4


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
def test_one_obstacle_more_compiles_nothing_and_nothing_moves_but_the_key():
    model, problem = crowd(n=2)
    planner = Planner(model)
    prepared = planner.prepare(problem)
    assert len(prepared.first(KEYS[0]).plans) == 1
    block = rectangle(np.random.default_rng(1), np.array([0.5, 0.5]), 0.1)
    other = planner.prepare(problem.replace(obstacles=(*problem.obstacles, block), spans=()))
    assert compiled_by(lambda: other.first(KEYS[1])) == 0
    with jax.transfer_guard("disallow"):
        assert len(prepared.first(KEYS[2]).plans) == 1
        with pytest.raises(Exception, match=r"[Dd]isallowed"):  # the guard is at work here
            jax.jit(lambda x: x)(np.ones(2))


@pytest.mark.night
def test_what_cannot_be_found_ends_and_a_goal_without_ends_is_not_drawn_from():
    model = line_model(4, 0.0)
    wall = box([-9.0, -9.0], [9.0, 9.0])
    none = scene_of(reach_avoid(box([0, 0, -9], [1, 1, 9]), [wall], 0.1), model)
    first = first_safe(none, KEYS[0], 2)[0]
    assert first.count == 0 < first.judged
    model = line_model(4, 2.0)
    narrow = scene_of(reach_avoid(box([0, 0, -9], [1, 1, 9]), [], 0.1), model)
    assert first_safe(narrow, KEYS[0], 2)[0].judged == 0


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
