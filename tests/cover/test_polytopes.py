"""Polytopes are corridors in cells, and hold the plans they were cut around."""

import numpy as np
import pytest
from toy_models import toy_case

from parc_jax.safe_set.corridors.build import admit, build, nothing_built
from parc_jax.safe_set.corridors.polytopes import Polytopes, cut_around
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.corridors.stopping import nothing_covered
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.mark.slow
def test_polytopes_hold_the_plans_they_were_cut_around(rng):
    model, problem = toy_case(8)
    scene = scene_of(problem, model)
    seen = draw(scene, rng, 6000).safe
    building = nothing_built(model.tube, seen)
    counts = np.zeros(0, int)
    assert cut_around(scene, building.corridors, counts, seen) == []
    while len(building.waiting.k):
        building = build(scene, building, rng)
    building, kept = admit(building, seen)
    cut = cut_around(scene, building.corridors, building.counts, seen)
    inside = Polytopes(scene, cut, nothing_covered(0.99)).has(seen)
    assert kept.mean() > 0.95 and (inside == kept).all()
    for polytope in cut:
        inner = np.concatenate([polytope.p0, polytope.k])
        assert (polytope.halfspaces.A @ inner < polytope.halfspaces.b).all()
    assert cut_around(scene, building.corridors, building.counts, seen.at(slice(0, 0))) == []
