"""Polytopes are corridors in cells, and hold the plans they were cut around."""

import numpy as np
import pytest
from toy_models import toy_case

from parc_jax.safe_set.corridors.build import admit, build, nothing_built
from parc_jax.safe_set.corridors.polytopes import Polytopes, cut_around
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.mark.slow
def test_polytopes_hold_the_plans_they_were_cut_around(rng):
    model, problem = toy_case(8)
    scene = scene_of(problem, model)
    seen = draw(scene, rng, 6000).safe
    building = nothing_built(model.tube, seen)
    none = Polytopes()
    assert (none.first(seen, building) == -1).all() and cut_around(building, seen, 0.0) == []
    while len(building.waiting.k):
        building = build(scene, building, rng)
    polytopes = none.with_more(cut_around(building, seen, 0.0))
    building, kept = admit(building, seen)
    inside = polytopes.first(seen, building) >= 0
    assert kept.mean() > 0.95 and (inside == kept).all() and len(none) == 0
    for polytope in polytopes.spelled_out(scene, building):
        inner = np.concatenate([polytope.p0, polytope.k])
        assert (polytope.halfspaces.A @ inner < polytope.halfspaces.b).all()
    assert cut_around(building, seen.at(slice(0, 0)), 0.0) == []
