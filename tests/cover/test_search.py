"""A search as a whole: safe plans alone and corridors are proved; one that finds nothing ends."""

import jax
import numpy as np
import pytest
from scipy.stats import binom
from toy_bodies import points_model, points_problem
from toy_models import line_model, toy_case

from parc_jax.common.sets.box import box
from parc_jax.common.status import Status
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.corridors.sampling import HOPELESS, draw
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts

MODEL, PROBLEM = toy_case(4)


@pytest.mark.slow
def test_samples_come_proved_and_without_corridors():
    first, again = (
        Planner(MODEL).solve(
            PROBLEM, jax.random.PRNGKey(3), Settings(samples=600, samples_only=True)
        )
        for _ in "ab"
    )
    assert (
        first.status.found
        and len(first.samples) == 600
        and not first.corridors
        and first.cover.timings["first_corridor_s"] is None
    )
    assert (
        first.status is Status.PROVED
        and first.cover.refused == 0
        and first.coverage.at_least == 0.0
    )
    np.testing.assert_array_equal(first.samples, again.samples)
    seen = verdicts(first.scene, first.samples[:, : MODEL.n_p], first.samples[:, MODEL.n_p :])
    assert seen.safe.all() and 0 < first.share.at_least < first.share.at_most < 1


@pytest.mark.night
def test_where_nothing_is_safe_the_look_ends():
    blocks = [
        box([2, 0.295], [5, 2.3]),
        box([2, -2.3], [5, -0.295]),
    ]  # a gap narrower than the tube needs
    problem = reach_avoid(box([3.0, -0.5, -1.0], [4.0, 0.5, 1.0]), blocks, 0.25)
    answer = Planner(line_model(e=0.05)).solve(
        problem, jax.random.key(0), Settings(work=1e-3, samples_only=True)
    )
    assert not answer.status.found and answer.cover.safe == 0 and answer.cover.drawn >= HOPELESS


def test_corridors_are_certified(rng):
    model, problem = toy_case(4)
    settings = Settings(samples=5, target=0.02, budget_s=300)
    answer = Planner(model).solve(problem, jax.random.key(0), settings)
    assert answer.coverage.at_least >= 0.98
    assert 0 < answer.cover.timings["corridors_s"] <= answer.cover.timings["cover_s"]
    fresh = draw(answer.scene, rng, 40_000).safe
    inside = int(answer.contains(fresh.p0, fresh.k).sum())
    assert binom.cdf(inside, len(fresh.k), 0.98) > 1e-6


@pytest.mark.slow
def test_a_scene_without_obstacles_is_covered_under_fitted_faces():
    """Corridors around nothing have no thresholds to look up."""
    rng = np.random.default_rng(0)
    model = points_model(rng, fitted=True)
    problem = points_problem(rng, model, 0)
    answer = Planner(model).solve(problem, jax.random.PRNGKey(0), Settings(target=0.1, proof=False))
    assert len(answer.samples) and answer.corridors
