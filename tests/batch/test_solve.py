"""Batch queries: no scene knows its neighbours, every plan is judged like that of a single
query.
"""

import copy
import itertools
import pickle
from dataclasses import replace

import jax
import numpy as np
import pytest
from toy_models import line_model, random_model, random_problem, rectangle_problem

from parc_jax.common.backend import ACCELERATOR, CPU, spread
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.planner import Planner
from parc_jax.problem.body import Polygon
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import nominal_problems
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.batch import search as batch_run
from parc_jax.safe_set.batch.box_scenes import box_scenes, lay_out_boxes
from parc_jax.safe_set.batch.estimate import along_fan
from parc_jax.safe_set.batch.proposals import About, search
from parc_jax.safe_set.batch.search import passes, stack_problems
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.rounds import Best
from parc_jax.safe_set.verdict.scene import padded_to_class, scene_of

KEY = jax.random.PRNGKey(5)
S = 20


@pytest.fixture(scope="module")
def toy():
    """A planner, S problems of one size, some without a plan, and the answer to all of them at
    once.
    """
    rng = np.random.default_rng(2)
    model = random_model(rng, bins=(2, 2))
    problems = [rectangle_problem(rng, model) for _ in range(S)]
    turned = hpolytope([[1, 1], [-1, 1], [-1, -1], [1, -1]], [3] * 4)
    wall = reach_avoid(problems[0].goal, [turned] * 2, 0.08)  # an obstacle on all of the goal
    planner = Planner(model)
    problems[3] = problems[11] = wall
    return planner, problems, planner.solve_batch(problems, KEY, draws=512)


def same(a, b):
    np.testing.assert_array_equal(a.found, b.found)
    np.testing.assert_array_equal(a.plans, b.plans)
    np.testing.assert_array_equal(a.clearance, b.clearance)
    np.testing.assert_array_equal(a.draws, b.draws)


def rows(answer, index):
    return replace(
        answer,
        **{name: getattr(answer, name)[index] for name in ("found", "plans", "clearance", "draws")},
    )


@pytest.mark.soundness
def test_every_plan_passes_the_single_query_and_the_exact_checker(toy):
    planner, problems, answer = toy
    assert answer.found.any() and not answer.found.all() and not answer.found[[3, 11]].any()
    for i in np.flatnonzero(answer.found):
        plans = answer.plans[i][np.isfinite(answer.clearance[i])]
        e = verdicts(scene_of(problems[i], planner.model), plans[:, :2], plans[:, 2:])
        assert e.safe.all() and (answer.clearance[i][: len(plans)] <= e.clearance + 1e-9).all()
    few = list(np.flatnonzero(answer.found)[:2])
    proved = planner.solve_batch(
        [problems[i] for i in [*few, 3]],
        KEY,
        Settings.fast().replace(proof=True),
        numbers=[*few, 3],
        draws=512,
    )
    assert list(proved.proved) == [True, True, False]


def test_plans_of_a_batch_are_not_written_over(toy):
    """Moved in place they kept their status "exact-proved"."""
    _, _, answer = toy
    for one in (answer, copy.copy(answer), pickle.loads(pickle.dumps(answer))):
        for array in (one.found, one.plans, one.clearance, one.draws, one.best):
            with pytest.raises(ValueError, match="read-only"):
                array[:1] = 0


@pytest.mark.night
def test_a_plan_is_found_wherever_drawing_finds_one(toy):
    planner, problems, answer = toy
    drawn = [
        draw(scene_of(p, planner.model), np.random.default_rng(0), 2048).safe for p in problems
    ]
    assert (answer.found >= np.array([len(d.k) > 8 for d in drawn])).all()


def test_a_scene_alone_in_another_order_and_in_another_batch_gets_the_same_bits(toy):
    planner, problems, answer = toy
    order = np.random.default_rng(0).permutation(S)
    same(
        planner.solve_batch([problems[i] for i in order], KEY, numbers=order, draws=512),
        rows(answer, order),
    )
    for i in (0, 3, 7):
        same(planner.solve_batch([problems[i]], KEY, numbers=[i], draws=512), rows(answer, [i]))
    many = [problems[i % S] for i in range(300)]  # several compiled calls
    same(
        planner.solve_batch(many, KEY, numbers=np.arange(300) % S, draws=512),
        rows(answer, np.arange(300) % S),
    )
    renamed = planner.solve_batch([problems[0]], KEY, numbers=[1], draws=512)
    assert not np.array_equal(
        renamed.plans, answer.plans[:1]
    )  # the number does decide: the tests above can fail


@pytest.mark.slow
def test_vectorised_and_looped_scenes_get_the_same_verdicts(toy):
    planner, problems, _ = toy
    model, (size,) = planner.model, stack_problems(problems, planner.model)
    items = jax.device_get(
        batch_run.make_pool(model.net, model.tube, KEY, model.domain.lo, model.domain.hi, 256)
    )
    about = About(model.net, model.tube, along_fan(model.tube))
    order = np.arange(32, dtype=np.int32)
    shared = (about, items, np.asarray(KEY), order, np.int32(0), np.int32(4))
    best = Best(np.zeros((S, 2, 4)), np.full((S, 2), -np.inf))
    numbers = np.arange(S, dtype=np.uint32)
    (a, turns_a), (b, turns_b) = (
        spread(search, (size.scenes, numbers), best, shared, how=how)
        for how in (CPU, replace(ACCELERATOR, scenes=8))
    )
    np.testing.assert_array_equal(a.clearance > 0, b.clearance > 0)
    np.testing.assert_array_equal(turns_a, turns_b)
    np.testing.assert_allclose(a.plans, b.plans, atol=1e-9)
    assert 0 < (a.clearance[:, 0] > 0).sum() < S


@pytest.mark.parametrize(
    "body", [0.2, Polygon(np.array([[0.2, 0.0], [0.0, 0.25], [-0.2, 0.0], [0.05, -0.2]]))]
)
def test_arrays_of_boxes_are_laid_out_like_problems(body, rng):
    model = line_model(T=8, e=0.01)
    s, o = 6, 3
    lo, goal = rng.normal(size=(s, o, 2)), rng.normal(size=(s, 3))
    hi, present = lo + rng.uniform(0, 1, (s, o, 2)), rng.uniform(size=(s, o)) < 0.8
    present[0] = True
    spans = np.sort(rng.integers(0, 8, (s, o, 2)), axis=2)
    start = (goal[:, :2] - 1, goal[:, :2] + 1)
    boxes = box_scenes(
        model, goal, goal + 1, lo, hi, body, start=start, present=present, spans=spans
    )
    stacked = lay_out_boxes(boxes, model)
    for i in range(s):
        one, mine = (
            padded_to_class(scene_of(boxes.problem(i), model)),
            jax.tree.map(lambda x, i=i: x[i], stacked),
        )
        assert {span.dt for span in boxes.problem(i).spans} <= {model.time.dt}
        kept = np.flatnonzero(present[i])
        a, b = one.obstacles, mine.obstacles
        np.testing.assert_allclose(
            a.vertices[: len(kept)], b.vertices[kept], rtol=1e-15, atol=1e-15
        )
        np.testing.assert_array_equal(a.signs[: len(kept)], b.signs[kept])
        np.testing.assert_array_equal(a.active[: len(kept)], b.active[kept])
        assert not b.active[np.setdiff1d(np.arange(len(b.active)), kept)].any()
        np.testing.assert_array_equal(b.radius[kept], a.radius[: len(kept)])
        for name in ("goal_A", "goal_b", "start_A", "start_b", "z_lo", "z_hi", "k_lo", "k_hi"):
            np.testing.assert_array_equal(getattr(one, name), getattr(mine, name))
        assert mine.slack >= one.slack * (1 - 1e-9)


def test_arrays_of_boxes_take_no_uncertainty_but_their_problems_do():
    model, goal = line_model(T=8, e=0.01), np.zeros((2, 3))
    arrays = model, goal, goal + 1, np.full((1, 2), 3.0), np.full((1, 2), 4.0), 0.1
    with pytest.raises(TypeError, match="unexpected keyword argument 'uncertainty'"):
        box_scenes(*arrays, uncertainty=Uncertainty(start=0.25))
    boxes = box_scenes(*arrays)
    uncertain = [
        boxes.problem(i).replace(uncertainty=Uncertainty(start=0.25)) for i in range(len(boxes))
    ]
    asked = nominal_problems(uncertain, model, {})
    assert [one.problem.goal.b.tolist() for one in asked] == [
        [0.75, 0.75, 1.0, -0.25, -0.25, 0.0]
    ] * 2
    assert asked[0].model is not model


@pytest.mark.night
def test_sizes_and_kinds_mix_and_a_question_gets_one_answer_in_any_batch(rng):
    model = random_model(np.random.default_rng(3))
    planner = Planner(model)
    problems = [
        random_problem(rng, model, n, start=start)
        for n, start in ((1, False), (1, True), (3, True))
    ]
    answer = planner.solve_batch(problems, KEY, draws=256)
    assert [list(c.rows) for c in stack_problems(problems, model)] == [[0, 1], [2]]
    for i, p in enumerate(problems):
        same(planner.solve_batch([p], KEY, numbers=[i], draws=256), rows(answer, [i]))
    twice = planner.solve_batch(problems[:1] * 2, KEY, numbers=[0, 0], draws=256)
    same(twice, rows(answer, [0, 0]))


@pytest.mark.night
def test_a_small_start_and_a_wall_that_comes_later():
    planner = Planner(line_model(T=8))
    goal = box([0.9, -0.1, -2.0], [1.1, 0.1, 2.0])
    here = box([0.0, 0.0], [0.001, 0.001])
    wall = box(
        [0.4, -9], [0.6, 9]
    )  # the robot stands in it or crosses it between 3/8 and 5/8 of its way
    always, early, late = (
        reach_avoid(goal, [wall], 0.0, here, [span]) for span in (None, (0, 2), (6, 7))
    )
    answer = planner.solve_batch([always, early, late], KEY, draws=512)
    assert list(answer.found) == [False, True, True]
    assert (np.abs(answer.best[1:, :2]) <= 0.001).all()


@pytest.mark.slow
def test_warm_start_keeps_what_holds_and_repairs_what_moved(toy):
    planner, problems, answer = toy
    again = planner.solve_batch(problems, KEY, draws=512, warm=answer)
    full = np.isfinite(answer.clearance).all(axis=1)
    assert full.any() and (again.draws[full] == 0).all()
    # estimates choose which few are judged: the best of the earlier ones may miss by their error
    assert (again.clearance[full, 0] >= 0.98 * answer.clearance[full, 0]).all()
    nudged = [
        p.replace(goal=p.goal.replace(b=p.goal.b + p.goal.A @ np.array([0.05, 0.0, 0.0])))
        for p in problems
    ]
    moved = planner.solve_batch(nudged, KEY, draws=512, warm=answer)
    assert (moved.draws[full] == 0).mean() > 0.5 and moved.found[full].all()
    for i in np.flatnonzero(moved.found):
        p0, k = moved.best[i : i + 1, :2], moved.best[i : i + 1, 2:]
        assert verdicts(scene_of(nudged[i], planner.model), p0, k).safe.all()


@pytest.mark.slow
def test_corridors_for_the_chosen_ones(toy):
    planner, problems, answer = toy
    best = int(np.argmax(np.nan_to_num(answer.clearance[:, 0])))
    full = planner.solve_batch(
        [problems[best]],
        KEY,
        Settings(samples=4, target=0.3, budget_s=300, proof=False),
        whole=[0],
    ).answers[0]
    assert full.status.found and len(full.corridors)


def test_errors_say_what_to_do(toy):
    planner, problems, _ = toy
    wrong = reach_avoid(box([0, 0], [1, 1]), [], 0.1)
    with pytest.raises(InputError, match="problem 1 of the batch"):
        planner.solve_batch([problems[0], wrong], KEY)
    with pytest.raises(InputError, match="numbers"):
        planner.solve_batch(problems, KEY, numbers=[0.5] * S)
    with pytest.raises(InputError, match="warm"):
        planner.solve_batch(problems, KEY, warm=np.zeros((2, 4)))
    with pytest.raises(InputError, match="samples"):
        planner.solve_batch(problems, KEY, Settings.fast().replace(samples=0))
    with pytest.raises(InputError, match="scene 1"):
        box_scenes(
            planner.model,
            np.zeros((2, 3)),
            [[1, 1, 1], [0, 1, 1]],
            np.zeros((1, 2)),
            np.ones((1, 2)),
            0.1,
        )
    one = planner.model, np.zeros((1, 3)), np.ones((1, 3)), np.zeros((1, 2)), np.ones((1, 2)), 0.1
    # seconds were cut to intervals: a gate that is closed until 0.75 s was open after 0.25 s
    for wrong in ({"spans": [[[0.0, 0.75]]]}, {"present": [[0]]}, {"present": [["no"]]}):
        with pytest.raises(InputError, match="present as True and False, and spans in whole num"):
            box_scenes(*one, **wrong)
    free = (*one[:3], np.zeros((0, 2)), np.zeros((0, 2)), 0.1)  # NumPy has no type for no numbers
    assert box_scenes(*free, present=[[]], spans=np.zeros((1, 0, 2))).problem(0).obstacles == ()
    assert len(planner.solve_batch([], KEY).found) == 0


@pytest.mark.parametrize("rounds", [1, 3, 4, 64, 100])
def test_passes_cover_all_rounds_once_and_grow_fourfold(rounds):
    seen = list(passes(rounds))
    assert seen[0] == (0, 1) and seen[-1][1] == rounds
    for (_, last), (first, after) in itertools.pairwise(seen):
        assert last == first and after == min(4 * first, rounds)


@pytest.mark.parametrize("how", [CPU, ACCELERATOR])
@pytest.mark.parametrize("n", [1, 4, 10])
def test_every_scene_is_in_one_call_of_the_compiled_size(how, n):
    rows, start = np.arange(n), np.arange(n) * 10
    found = spread(
        lambda row, at, more: row + at + more, rows, start, 100, how=replace(how, scenes=4)
    )
    np.testing.assert_array_equal(found, 11 * np.arange(n) + 100)
