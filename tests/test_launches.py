"""What an accelerator would be asked for: programs, operations and host arrays of every public
call, against a budget. Nobody needs one to notice that a call asks for more.
"""

from pathlib import Path

import jax
import numpy as np
import pytest
from launches import Launches, counting, launches_of, operations_in

import parc_jax as pj
from sims.drift_parking import problem

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent
KEY = jax.random.PRNGKey(0)
FAST = pj.Settings.fast()
COVER = pj.Settings(target=0.05, samples=5, budget_s=300.0, proof=False)
# measured, and a tenth more: programs run, operations launched, host arrays given. Loops whose
# length depends on values, those over obstacles too, count once. A new scene moves its arrays in
# one program. Who keeps to which corridor is asked in calls so small that their arrays stay in
# cache: twice the size is 8 programs less and, with five points, a tenth slower. A cover draws
# 16,000 plans for a look, and looks for directions exactly: on a processor both save time, in
# launches they cost (163, 36,000, 860 before)
BUDGETS = {
    "first": Launches(2, 640, 0),
    "solve": Launches(3, 660, 23),
    "solve_batch": Launches(9, 1850, 115),
    "contains": Launches(4, 125, 42),
    "cover": Launches(283, 241_000, 2_050),
}


@pytest.fixture(scope="module")
def calls():
    model = pj.load(ROOT / "data" / "drift_4x8.npz")
    asked = problem(body="disc")
    planner = pj.Planner(model)
    prepared = planner.prepare(asked)
    answers = {}

    def cover():
        answers["cover"] = planner.solve(asked, KEY, COVER)

    def contains():
        answer = answers["cover"]
        answer.contains(answer.samples[:, :2], answer.samples[:, 2:])

    with counting():
        yield {
            "first": lambda: prepared.first(KEY),
            "solve": lambda: planner.solve(asked, KEY, FAST),
            "solve_batch": lambda: planner.solve_batch([asked] * 16, KEY, FAST),
            "cover": cover,
            "contains": contains,
        }


@pytest.mark.parametrize("name", ["first", "solve", "solve_batch"])
def test_a_call_launches_no_more_than_its_budget(calls, name):
    seen = launches_of(calls[name])
    assert all(np.array(seen) <= np.array(BUDGETS[name])), seen


@pytest.mark.night
@pytest.mark.parametrize("name", ["cover", "contains"])
def test_a_cover_launches_no_more_than_its_budget(calls, name):
    if name == "contains":
        calls["cover"]()
    seen = launches_of(calls[name])
    assert all(np.array(seen) <= np.array(BUDGETS[name])), seen


def test_operations_are_those_after_fusion_and_loops_count_as_often_as_they_run():
    def of(f):
        return operations_in(jax.jit(f).lower(np.ones((4, 4), np.float32)).compile().as_text())

    def times(n):
        return lambda x: jax.lax.fori_loop(0, n, lambda _, c: c @ c, x)

    assert of(lambda x: x + 1) == of(lambda x: x * 2 + x - 1) == 1
    each = of(times(8)) - of(times(7))
    assert each >= 1 and of(times(50)) - of(times(8)) == 42 * each
    either = of(lambda x: jax.lax.cond(x.sum() > 0, times(50), lambda x: x, x))
    assert of(times(50)) <= either <= of(times(50)) + 20


def test_host_arrays_are_counted(calls):
    add = jax.jit(lambda x, y: x + y)
    on_device = jax.device_put(np.ones(3, np.float32))
    moved = launches_of(lambda: add(np.ones(3, np.float32), on_device))
    assert moved == Launches(1, 1, 1)
