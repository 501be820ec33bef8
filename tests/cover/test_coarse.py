"""The coarse test of bodies of several points agrees with plain loops, in the plane and space."""

import itertools

import numpy as np
import pytest
from toy_bodies import points_model, points_problem

from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.mark.parametrize("n_p", [2, 3])
def test_the_coarse_test_agrees_with_plain_loops(n_p):
    rng = np.random.default_rng(n_p)
    model = points_model(rng, n_p=n_p, m=4, bins=(3, 1), size=0.1)
    scene = scene_of(points_problem(rng, model, 3), model)
    tube, points = model.tube, scene.obstacles.points
    shape = scene.obstacles.active.shape
    none = np.zeros(0)
    chosen = [
        Corridor(
            rng.normal(size=(*shape, n_p)), rng.normal(size=shape) - 2.5, None, points, *2 * [none]
        )
        for _ in range(5)
    ]
    n = 300
    path = 0.3 * rng.normal(size=(n, model.time.n_steps + 1, model.n_c))
    bins = rng.integers(0, tube.n_bins, n)
    margin, found = np.full((n, len(chosen)), np.inf), Corridors(tube, chosen)
    for c, one in enumerate(chosen):
        for o, t in itertools.product(range(shape[0]), found._knots):
            for i in points[o]:
                own = np.s_[i * n_p : (i + 1) * n_p]
                along = path[:, t, own] @ one.w[o, t] - one.support[o, t]
                lost = tube.interval[bins, t, own] @ np.abs(one.w[o, t])
                margin[:, c] = np.minimum(margin[:, c], along - lost)
    found = found.coarse(path, bins)
    clear = np.abs(margin) > 1e-4  # the coarse test is in float32
    assert clear.mean() > 0.99 and 0.05 < found.mean() < 0.95
    np.testing.assert_array_equal(found[clear], (margin > 0)[clear])
