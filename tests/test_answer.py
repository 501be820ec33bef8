"""What an answer says of plans drawn from it, against answers whose true values are known."""

import copy

import jax
import numpy as np
import pytest
from scipy.stats import binom
from toy_models import line_model

from parc_jax.planner import Planner
from parc_jax.problem import reach_avoid
from parc_jax.sets.box import box
from parc_jax.settings import Settings


@pytest.fixture(scope="module")
def answer():
    """Everything is safe: one cell, no obstacle, and one polytope that is all of it."""
    problem = reach_avoid(box([-0.5, -0.5, -9], [0.5, 0.5, 9]), [], 0.1)
    return Planner(line_model(4, 0.0)).solve(
        problem, jax.random.key(0), Settings(n_samples=5, target=0.1, budget_s=300, polytopes=True)
    )


def covering(answer, at_least):
    """The same answer, whose polytopes are only known to cover this share of the safe set."""
    partial = copy.copy(answer)
    coverage = answer.coverage._replace(share=at_least, at_least=at_least)
    partial._cover = answer._cover._replace(coverage=coverage)
    return partial


def test_the_density_of_a_whole_answer_is_close_to_one(answer):
    """Per unit of k the union offers the same box of end points, so k of `sample` is uniform."""
    assert len(answer.polytopes) == 1 and answer.coverage.at_least > 0.99
    assert 1 <= answer.density <= 1.03


@pytest.mark.parametrize("share", [0.5, 0.1])
def test_the_density_pays_for_what_the_polytopes_do_not_cover(answer, share):
    """Polytopes that hold a share s of this safe set may be a slice of K of that share: then k of
    `sample` is 1 / s times as dense as uniform.
    """
    assert 1 / share <= covering(answer, share).density <= 1.03 / share


def test_without_measured_coverage_no_density_is_stated(answer):
    assert np.isinf(covering(answer, 0.0).density)


def test_membership_asks_for_goal_and_start_too(answer):
    """Without obstacles every plan keeps to every corridor: only goal and start can refuse it."""
    k = answer.samples[:1, 2:]
    hit, missed = answer.samples[:1, :2], answer.samples[:1, :2] + 5.0
    assert answer.keeps(hit, k).all() and answer.contains(hit, k).all()
    assert not answer.keeps(missed, k).any() and not answer.contains(missed, k).any()


def test_the_volume_interval_is_clopper_pearson(answer):
    counted = copy.copy(answer)
    counted._cover = answer._cover._replace(drawn=1000, safe=300)
    estimate, low, high = np.array(counted.volume(0.99)) / answer._cover.volume
    assert estimate == pytest.approx(0.3)
    assert binom.sf(299, 1000, low) == pytest.approx(0.005, rel=1e-6)  # 300 or more
    assert binom.cdf(300, 1000, high) == pytest.approx(0.005, rel=1e-6)


def test_the_share_of_k_is_a_lower_bound(answer):
    """All of K is hit, by 20,000 draws: the share is at least the thousandth's 20,000th root."""
    assert answer.share_of_k == pytest.approx(0.001 ** (1 / 20_000), abs=1e-8)
