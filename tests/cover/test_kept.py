"""Answers without polytopes: samples, best plans and risk from the corridors alone, against answers
that cut them.
"""

import functools
from dataclasses import replace

import jax
import numpy as np
import pytest
from scipy.stats import binom, kstest
from toy_models import line_model, toy_case

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.corridors.kept import KeptPlans
from parc_jax.safe_set.corridors.later import cut_later
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.settings import Settings

KEY = jax.random.key(5)


@functools.cache
def answer(polytopes=False):
    """Of a toy with two blocks."""
    model, problem = toy_case(4)
    settings = Settings(samples=5, target=0.05, budget_s=300, polytopes=polytopes)
    return Planner(model).solve(problem, jax.random.key(0), settings)


def with_few(n):
    """The plans of its last corridors only."""
    model, scene = answer().model, answer().scene
    few = answer()._corridors.all[-n:]
    return KeptPlans(scene, type(answer()._corridors)(model.tube, few), None)


def test_every_sample_is_safe_by_a_corridor_of_the_answer():
    few = with_few(1)
    x = few.sample(np.random.default_rng(0), 300)
    assert x.shape == (300, 4) and few.contains(x[:, :2], x[:, 2:]).all()
    assert answer().contains(x[:, :2], x[:, 2:], of="corridors").all()
    others = answer().sample(KEY, 2000)
    assert 0 < few.contains(others[:, :2], others[:, 2:]).mean() < 0.9  # one does not hold all


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
    assert 1 <= free.density <= 1.03 and not free.polytopes
    assert free.share_of_k() == pytest.approx(0.001 ** (1 / 20_000), abs=1e-8)


def test_samples_from_corridors_are_those_of_the_safe_set():
    """Where corridors hold nearly all of it, their samples have the law of uniform safe draws."""
    fresh = draw(answer().scene, np.random.default_rng(7), 60_000).safe
    x = answer().sample(KEY, 4000)
    for axis in range(2):
        edges = np.quantile(fresh.k[:, axis], np.linspace(0, 1, 9)[1:-1])
        counts = np.bincount(np.digitize(x[:, 2 + axis], edges), minlength=8)
        assert (np.abs(counts / len(x) - 1 / 8) < 0.05 + 4 * np.sqrt(0.11 / len(x))).all()


@pytest.mark.slow
def test_the_best_plan_needs_no_polytopes():
    plan, value = answer().best("clearance")
    assert answer().contains(plan[None, :2], plan[None, 2:], of="corridors").all()
    assert value >= 0.97 * answer(True).best("clearance")[1]
    c = np.array([0.0, 0.0, 1.0, 0.0])
    assert answer().best(c)[1] >= answer(True).best(c)[1] - 0.05


def test_polytopes_are_cut_later_and_proved(rng):
    later = answer().with_polytopes(KEY, 4000)
    assert later.polytopes and later.proved and later.refused == 0
    assert not answer().polytopes and answer().coverage.at_least == 0
    fresh = draw(answer().scene, rng, 30_000).safe
    inside = int(later.contains(fresh.p0, fresh.k).sum())
    assert later.coverage.at_least > 0.5
    assert binom.cdf(inside, len(fresh.k), later.coverage.at_least) > 1e-6
    assert len(later.to_json()["sets"]) == len(later.polytopes)
    assert len(later.safe_sets()) == len(later.volumes()) == len(later.project((0, 1)))


@pytest.mark.slow
def test_what_later_polytopes_hold_is_told_by_fresh_plans():
    """Cut around three plans, which they all hold, they hold far from everything."""
    scene, corridors = answer().scene, answer()._corridors
    few, coverage = cut_later(scene, KEY, corridors, None, 3, 0.99)
    assert few and coverage.fresh_safe > 3000 and coverage.fresh_uncovered > 0


@pytest.mark.slow
def test_geometry_is_cut_on_first_use_and_refused_where_it_explodes(monkeypatch):
    one = replace(answer())
    assert len(one.safe_sets()) == len(one.volumes()) > 0 and not one.polytopes
    monkeypatch.setattr("parc_jax.answer.answer.SPREAD_OUT", 3)
    wide = replace(answer())
    with pytest.raises(InputError, match="at most 3 dimensions"):
        wide.project((0, 1))


@pytest.mark.night
def test_without_corridors_there_is_nothing_to_sample():
    none = Planner(answer().model).solve(
        answer().problem, jax.random.key(0), Settings(samples=5, samples_only=True)
    )
    assert len(none.samples) and none.share_of_k() == 0 and np.isinf(none.density)
    with pytest.raises(InputError, match="corridors or safe polytopes"):
        none.sample(KEY, 3)
