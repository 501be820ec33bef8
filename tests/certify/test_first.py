"""A first look: safe plans without polytopes, and nothing loaded that they do not need."""

import subprocess
import sys

import jax
import numpy as np
from toy_models import line_model, toy_case

from parc_jax.certify.draws import HOPELESS
from parc_jax.certify.evaluate import evaluate
from parc_jax.planner import Planner
from parc_jax.problem import reach_avoid
from parc_jax.sets.box import box

MODEL, PROBLEM = toy_case(4)


def test_samples_come_proved_and_without_polytopes():
    first, again = (Planner(MODEL).solve(PROBLEM, jax.random.PRNGKey(3), n_samples=600, budget_s=0.0) for _ in "ab")
    assert first.found and len(first.samples) == 600 and not first.pieces and first.timings["first_piece_s"] is None
    assert first.level == "exact-proved" and first.refused == 0 and first.coverage.at_least == 0.0
    np.testing.assert_array_equal(first.samples, again.samples)
    seen = evaluate(MODEL, first.scene, first.samples[:, : MODEL.n_p], first.samples[:, MODEL.n_p :])
    assert seen.safe.all() and 0 < first.safe_share < 1


def test_where_nothing_is_safe_the_look_ends():
    blocks = [box([2, 0.295], [5, 2.3]), box([2, -2.3], [5, -0.295])]  # a gap narrower than the tube needs
    problem = reach_avoid(box([3.0, -0.5, -1.0], [4.0, 0.5, 1.0]), blocks, 0.25)
    answer = Planner(line_model(e=0.05)).solve(problem, jax.random.key(0), budget_s=0.0, no_plan_budget_s=0.0)
    assert not answer.found and answer.counts["safe"] == 0 and answer.counts["drawn"] >= HOPELESS


def test_a_query_of_a_saved_model_loads_no_simulator_and_no_solver():
    heavy = {"mujoco", "brax", "optax", "clarabel", "scipy.stats", "scipy.spatial", "scipy.optimize", "matplotlib"}
    code = f"import sys, parc_jax.model, parc_jax.planner; print(sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
