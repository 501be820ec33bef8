"""Batches of corridors around plans that wait: the direction that adds most is taken, and none is
made where no plan waits.
"""

import numpy as np
from toy_models import toy_case

from parc_jax.safe_set.corridors.build import build, greedy, nothing_built
from parc_jax.safe_set.corridors.sampling import no_points
from parc_jax.safe_set.verdict.scene import scene_of


def test_where_no_plan_waits_nothing_is_built(rng):
    model, problem = toy_case(4)
    building = nothing_built(model.tube, no_points(model))
    assert build(scene_of(problem, model), building, rng) is building


def test_greedy_takes_the_column_that_adds_most():
    kept = np.array([[1, 0, 1], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]], bool)
    assert list(greedy(kept)) == [0, 1, 2] and list(greedy(kept, worth=0.5)) == [0]
    assert list(greedy(kept[:0])) == [] and list(greedy(kept[:, :0])) == []
