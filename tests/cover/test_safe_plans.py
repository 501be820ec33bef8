"""Plans that satisfy corridors: samples, best plans and risk, and the polytopes cut from them."""

import functools
from dataclasses import replace

import jax
import numpy as np
import pytest
from scipy.stats import binom, kstest
from toy_models import line_model, toy_case

from parc_jax.answer.answer import answer_data
from parc_jax.answer.risk import density_of_k
from parc_jax.app.files.answer_file import load_answer
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.corridors.safe_plans import SafePlans
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.settings import Settings

KEY = jax.random.key(5)


@functools.cache
def answer():
    """Of a toy with two blocks."""
    model, problem = toy_case(4)
    settings = Settings(samples=5, target=0.05, budget_s=300)
    return Planner(model).solve(problem, jax.random.key(0), settings)


def with_few(n):
    """The plans of its last corridors only."""
    model, scene = answer().model, answer().scene
    few = answer()._corridors.all[-n:]
    return SafePlans(scene, type(answer()._corridors)(model.tube, few), None)


def test_every_sample_is_safe_by_a_corridor_of_the_answer():
    few = with_few(1)
    x = few.sample(np.random.default_rng(0), 300)
    assert x.shape == (300, 4) and few.contains(x[:, :2], x[:, 2:]).all()
    assert answer().contains(x[:, :2], x[:, 2:]).all()
    others = answer().sample(KEY, 2000)
    assert 0 < few.contains(others[:, :2], others[:, 2:]).mean() < 0.9  # one does not hold all


@pytest.mark.slow  # compiles a climb
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_an_objective_that_is_finite_nowhere_has_no_best_plan(value):
    with pytest.raises(InputError, match="best: expected an objective that is finite"):
        answer().best(lambda p0, k: value + 0 * k[0])


@pytest.mark.slow  # as well
def test_where_no_obstacle_is_the_best_plan_by_clearance_is_refused_for_that():
    problem = reach_avoid(box([-0.5, -0.5, -9], [0.5, 0.5, 9]), [], 0.1)
    free = Planner(line_model(4, 0.0)).solve(problem, jax.random.key(0), Settings(samples=5))
    with pytest.raises(InputError, match=r"best: expected .* it is; there is no obstacle\."):
        free.best()


def test_samples_are_uniform_where_everything_is_safe():
    """Straight lines without obstacles: k is uniform on K, the end uniform in the goal's box."""
    problem = reach_avoid(box([-0.5, -0.5, -9], [0.5, 0.5, 9]), [], 0.1)
    free = Planner(line_model(4, 0.0)).solve(
        problem, jax.random.key(0), Settings(samples=5, target=0.1, budget_s=300)
    )
    x = free.sample(KEY, 2000)
    lo, hi = free.model.domain.lo, free.model.domain.hi
    for axis in range(2):
        u = (x[:, 2 + axis] - lo[axis]) / (hi[axis] - lo[axis])
        assert kstest(u, "uniform").pvalue > 1e-4
    assert 1 <= density_of_k(free) <= 1.03
    assert free.share_of_k() == pytest.approx(0.001 ** (1 / 20_000), abs=1e-8)


def test_the_share_of_k_does_not_ask_all_k_for_the_ends_of_few_corridors():
    """Every k has its start, each an end of its own; the end of the one corridor gave 2 %."""
    start = box([-0.25, -0.25], [0.25, 0.25])
    problem = reach_avoid(box([-2, -2, -9], [2, 2, 9]), [], 0.1, start=start)
    free = Planner(line_model(4, 0.0)).solve(problem, jax.random.key(0), Settings(samples=5))
    assert len(free.corridors) < 3 and 0.99 < free.share_of_k() < 1


def test_samples_from_corridors_are_those_of_the_safe_set():
    """Where corridors hold nearly all of it, their samples have the law of uniform safe draws."""
    fresh = draw(answer().scene, np.random.default_rng(7), 60_000).safe
    x = answer().sample(KEY, 4000)
    for axis in range(2):
        edges = np.quantile(fresh.k[:, axis], np.linspace(0, 1, 9)[1:-1])
        counts = np.bincount(np.digitize(x[:, 2 + axis], edges), minlength=8)
        assert (np.abs(counts / len(x) - 1 / 8) < 0.05 + 4 * np.sqrt(0.11 / len(x))).all()


def test_polytopes_are_a_view_that_is_proved_and_counted(rng, tmp_path):
    cut = answer().polytopes(KEY, 4000)
    assert len(cut) and cut.proved and cut.refused == 0
    fresh = draw(answer().scene, rng, 30_000).safe
    inside = int(cut.contains(fresh.p0, fresh.k).sum())
    assert cut.coverage.at_least > 0.5
    assert binom.cdf(inside, len(fresh.k), cut.coverage.at_least) > 1e-6
    assert len(cut.sets) == len(cut.volumes) == len(cut.project((0, 1))) == len(list(cut))
    assert f"every (p0, k) in the {len(cut):,} safe polytopes" in answer().details(cut)
    again = load_answer(answer().save(tmp_path / "answer.json", cut))
    assert len(answer_data(answer(), cut)["sets"]) == len(cut)
    assert again.details().startswith(answer().details()) and "polytope" not in again.details()
    with pytest.raises(InputError, match="expected polytopes of this answer"):
        again.save(tmp_path / "again.json", cut)
    with pytest.raises(InputError, match="expected polytopes of this answer"):
        again.details(cut)


def test_polytopes_of_an_unproved_answer_are_unproved():
    bare = replace(answer(), cover=answer().cover._replace(proved=False))
    assert not bare.polytopes(KEY, 30).proved
