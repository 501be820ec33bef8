"""A safe polytope of a body of several points: its rows against the conditions of the definition,
point by point and interval by interval.
"""

import numpy as np
import pytest
from toy_bodies import points_model, points_problem

from parc_jax.common.sets.box import box
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.network.predict import by_point
from parc_jax.problem.problem import goal_of_points
from parc_jax.safe_set.corridors.build import admit, build, nothing_built
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.polytopes import cut_around
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

SHOWN = 6  # polytopes that are compared
NEAR = 400  # plans about the inner point of each


def built(n_p: int, fitted: bool, seed: int):
    """(model, scene, polytopes) of a goal of two points."""
    rng = np.random.default_rng(seed)
    model = points_model(rng, n_p=n_p, m=4, size=0.005, fitted=fitted)
    near, wide = box([-0.6] * n_p, [0.6] * n_p), box([-0.9] * n_p, [0.9] * n_p)
    goal = goal_of_points(model.points, {"c0": near, "c2": wide}, box([-9.0], [9.0]))
    problem = points_problem(rng, model).replace(goal=goal)
    scene = scene_of(problem, model)
    seen = draw(scene, rng, 600).safe
    building = build(scene, nothing_built(model.tube, seen), rng)
    building, kept = admit(building, seen)
    seen = seen.at(kept)
    return model, scene, cut_around(scene, building.corridors, building.counts, seen)[:SHOWN]


def room(model, scene, corridor, path, bin: int) -> float:
    """Least of w . p - support - (reach of the errors against w) over a corridor."""
    places, errors, out = by_point(path, model.n_points), model.tube.errors, []
    threshold = corridor.threshold(model.tube.during(bin))
    for o, t in np.argwhere(scene.obstacles.active):
        w = corridor.w[o, t]
        for slot, i in enumerate(scene.obstacles.points[o]):
            lost = corridor.support[o, t] + at(errors, (bin, t, i)).support(-w)
            assert threshold[o, t, slot] == pytest.approx(lost, abs=1e-12)
            out += [w @ places[s, i] - lost for s in (t, t + 1)]
    return min(out)


@pytest.mark.night
@pytest.mark.soundness
@pytest.mark.parametrize(
    ("n_p", "fitted", "seed"),
    [(2, True, 1), (3, False, 3)],
)
def test_the_rows_are_the_conditions_written_by_hand(n_p, fitted, seed):
    model, scene, polytopes = built(n_p, fitted, seed)
    rng = np.random.default_rng(0)
    inside = 0
    for polytope in polytopes:
        inner = np.concatenate([polytope.p0, polytope.k])
        spread = 10 ** rng.uniform(-3, 0, (NEAR, 1))
        plans = np.concatenate([inner[None], inner + spread * rng.normal(size=(NEAR, len(inner)))])
        e = verdicts(scene, plans[:, :n_p], plans[:, n_p:])
        cell = (e.pattern == polytope.pattern).all(axis=1) & (e.bin == polytope.bin)
        bins = np.full(len(plans), polytope.bin)
        paths = zip(e.path, bins, strict=True)
        along = np.array([room(model, scene, polytope.corridor, *x) for x in paths])
        kept = Corridors(model.tube, [polytope.corridor]).kept(e.path, bins)[:, 0]
        clear = np.abs(along) > 1e-5  # the quick look is in float32
        assert (kept == (along > 0))[clear].all() and not kept[along < -1e-12].any()
        rows = (polytope.halfspaces.b - plans @ polytope.halfspaces.A.T).min(axis=1)
        by_hand = np.minimum(np.minimum(e.goal, e.start), along)
        assert (by_hand[rows > 1e-9] > 0).all() and cell[rows > 1e-9].all()
        assert (rows[cell & (by_hand > 1e-9)] > -1e-9).all()
        inside += int((rows > 0).sum())
    assert inside > SHOWN and len(polytopes) == SHOWN
