"""Batches of corridors around plans that wait: every batch leaves fewer, and ends."""

import numpy as np
import pytest
from toy_models import toy_case

from parc_jax.safe_set.corridors import build as stage
from parc_jax.safe_set.corridors.build import admit, build, greedy, nothing_built
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.sampling import draw, no_points
from parc_jax.safe_set.verdict.scene import scene_of


def begin(model, plans):
    """Nothing built, and all plans asked."""
    return admit(nothing_built(model.tube, no_points(model)), plans)


@pytest.mark.night
def test_plans_that_no_short_direction_separates_are_given_up(rng, monkeypatch):
    model, problem = toy_case(4)
    scene = scene_of(problem, model)

    def nowhere(scene, choice):
        shape = choice.direction.shape[1:]
        one = Corridor(
            np.ones((*shape, 2)), np.full(shape, 1e3), None, scene.obstacles.points, None, None
        )
        return [one] * len(choice.direction)

    monkeypatch.setattr(stage, "_spelled_out", nowhere)
    building, kept = begin(model, draw(scene, rng, 2000).safe)
    assert not kept.any()
    while waiting := len(building.waiting.k):
        building = build(scene, building, rng)
        assert len(building.waiting.k) < waiting  # an endless search would be the price of hope
    assert len(building.corridors) == 0


@pytest.mark.slow
def test_every_batch_leaves_fewer_plans_and_changes_nothing_before_it(rng):
    model, problem = toy_case(8)
    scene = scene_of(problem, model)
    plans = draw(scene, rng, 4000).safe
    building, kept = begin(model, plans)
    assert not kept.any() and len(building.waiting.k) == len(plans.k)
    after = build(scene, building, rng, few=True)
    assert len(building.corridors) == 0 and len(building.waiting.k) == len(plans.k)
    assert 0 < len(after.corridors) <= stage.CALL and len(after.waiting.k) < len(plans.k)
    again, kept = admit(after, plans)
    assert kept.sum() == again.counts.sum() > 0 and after.counts.sum() == 0
    assert len(again.waiting.k) == len(after.waiting.k) + (~kept).sum()


def test_where_no_plan_waits_nothing_is_built(rng):
    model, problem = toy_case(4)
    building = nothing_built(model.tube, no_points(model))
    assert build(scene_of(problem, model), building, rng) is building


def test_greedy_takes_the_column_that_adds_most():
    kept = np.array([[1, 0, 1], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]], bool)
    assert list(greedy(kept)) == [0, 1, 2] and list(greedy(kept, worth=0.5)) == [0]
    assert list(greedy(kept[:0])) == [] and list(greedy(kept[:, :0])) == []
