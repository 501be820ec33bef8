"""Facets that obstacles share: the gaps are those of the inequality, pair by pair."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_bodies import points_model, points_problem

from parc_jax.common.arrays import x64
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.network.predict import by_point
from parc_jax.safe_set.verdict.scene import scene_of
from parc_jax.safe_set.verdict.screen import facets_of

pytestmark = pytest.mark.slow


def case(fitted: bool, n_p: int = 2):
    rng = np.random.default_rng([n_p, fitted])
    model = points_model(rng, n_p=n_p, m=4, size=0.05, fitted=fitted)
    problem = points_problem(rng, model, 3)
    return model, problem, scene_of(problem, model), rng


@pytest.mark.parametrize("n_p", [2, 3])
@pytest.mark.parametrize("fitted", [False, True])
def test_gaps_are_those_of_the_inequality(fitted, n_p):
    model, _, scene, rng = case(fitted, n_p)
    table, tube = scene.directions, model.tube
    facets = facets_of(scene)
    assert facets.number.max() < facets.number.size - 1  # boxes share normals
    path = rng.normal(size=(model.time.n_steps + 1, model.n_c))
    slack = 1e-3
    arrays = scene.replace(slack=np.float64(slack)).tabled
    assert len(table.multipliers) > arrays.alike.kinds  # and are looked at together

    def told(path, bin):
        nothing = jnp.full((len(table.w), model.time.n_steps), jnp.nan)
        look = lambda o, gap, gaps: gaps.at[o].set(gap)  # noqa: E731
        return facets.look(path, bin, arrays, look, nothing)

    told = jax.jit(told)
    for bin in range(tube.n_bins):
        with x64():
            found = np.asarray(told(path, bin))
        places, errors = by_point(path, model.n_points), tube.during(bin)
        for o in range(len(table.multipliers)):
            best = np.full(model.time.n_steps, -np.inf)
            for d in range(table.n_facets):
                w = table.w[o, d]
                room = np.full(model.time.n_steps, np.inf)
                for i in np.unique(scene.obstacles.points[o]):
                    along = places[:, i] @ w
                    lost = at(errors, np.s_[:, i]).support(-w[None])
                    room = np.minimum(room, np.minimum(along[:-1], along[1:]) - lost)
                best = np.maximum(best, room - table.support[o, d] - slack * np.abs(w).sum())
            np.testing.assert_allclose(found[o], best, rtol=0, atol=1e-12)
