"""Polytopes for corridors that a query built without any: cut around fresh plans, and counted on
other ones.
"""

import math

import jax
import numpy as np

from parc_jax.common.keys import generator
from parc_jax.safe_set.corridors.build import Building
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.place import Place
from parc_jax.safe_set.corridors.polytope import SafePolytope
from parc_jax.safe_set.corridors.polytopes import Polytopes, cut_around
from parc_jax.safe_set.corridors.sampling import Points, no_points
from parc_jax.safe_set.corridors.search import draw_safe_plans
from parc_jax.safe_set.corridors.stopping import Coverage, Limit, nothing_covered, stopping_rule
from parc_jax.safe_set.verdict.scene import Scene

COUNTED = 6000  # fresh safe plans that say what the polytopes hold


def cut_later(
    scene: Scene,
    key: jax.Array,
    corridors: Corridors,
    within: Place | None,
    n: int,
    confidence: float,
) -> tuple[list[SafePolytope], Coverage]:
    """Polytopes around n safe plans, and the share of the model's safe set inside them: one look at
    plans that nothing was cut from. [T31]
    """
    building = Building(corridors, np.zeros(len(corridors), int), no_points(scene.model))

    def safe_plans(number: int, n: int) -> Points:
        own = jax.random.fold_in(key, number)
        found = draw_safe_plans(scene, own, generator(own), n, confidence, Limit(math.inf), within)
        return found.points

    seen = safe_plans(0, n)
    if not len(corridors) or not len(seen.k):
        return [], nothing_covered(confidence)
    building = building.counting(corridors.first(seen.path, seen.bin))
    polytopes = Polytopes(cut_around(building, seen, 0.0))
    fresh = safe_plans(1, COUNTED)
    inside = polytopes.first(fresh, building) >= 0
    look = stopping_rule(0.5, confidence).after(inside)  # whatever the target: nothing stops here
    return polytopes.spelled_out(scene, building), look.coverage
