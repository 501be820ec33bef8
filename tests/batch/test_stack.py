"""A batch without what no plan comes near: smaller scenes, no more programs, the same verdicts."""

import jax
import numpy as np
import pytest
from toy_models import random_model, random_polygon, random_problem

from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.batch.search import FEW, stack_problems
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

KEY = jax.random.PRNGKey(3)


def crowded(rng, model, n_near: int, n_far: int) -> Problem:
    """So many obstacles about the paths, and so many where no plan comes."""
    problem = random_problem(rng, model, n_near)
    sides = rng.choice([-1, 1], (n_far, 2))
    far = [random_polygon(rng, 40.0 * side + rng.normal(size=2), 0.5) for side in sides]
    return problem.replace(
        obstacles=(*problem.obstacles, *far), spans=(*problem.all_spans, *([None] * n_far))
    )


def test_what_no_plan_comes_near_is_not_stacked():
    rng = np.random.default_rng(0)
    model = random_model(rng, bins=(2, 1))
    problems = [crowded(rng, model, n, 15 - n) for n in (1, 2, 3)]
    stacked = stack_problems(problems, model)
    assert sorted(np.concatenate([c.rows for c in stacked])) == [0, 1, 2]
    assert {c.scenes.obstacles.active.shape[1] for c in stacked} == {4}  # and not 1, 2 and 4, or 16
    few = [random_problem(rng, model, FEW) for _ in range(2)]
    assert np.isinf(np.concatenate([c.scenes.beyond for c in stack_problems(few, model)])).all()


@pytest.mark.slow
def test_plans_keep_their_clearance_from_all_obstacles():
    rng = np.random.default_rng(1)
    model = random_model(rng, bins=(2, 2))
    problems = [crowded(rng, model, 2, n) for n in (3, 5, 30)]
    answer = Planner(model).solve_batch(problems, KEY, Settings(samples=4, proof=True), draws=2048)
    assert answer.proved.sum() >= 2
    for row in np.flatnonzero(answer.found):
        plans = answer.plans[row][answer.clearance[row] > 0]
        seen = verdicts(scene_of(problems[row], model), plans[:, :2], plans[:, 2:])
        assert seen.safe.all()
        told = answer.clearance[row][: len(plans)]
        np.testing.assert_allclose(told, np.asarray(seen.clearance), atol=1e-9)
