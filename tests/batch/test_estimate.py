"""Estimated clearances of bodies of several points: never more than the exact ones, nearly as much
in the plane, and rough looks that keep the best.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_bodies import points_model, points_problem

from parc_jax.common.arrays import x64
from parc_jax.learning.network.predict import moved_to, trajectories
from parc_jax.safe_set.batch.estimate import along_fan, estimate_clearance, estimate_roughly
from parc_jax.safe_set.verdict.pointwise import clearance
from parc_jax.safe_set.verdict.scene import scene_of

ROUNDING = 1e-5  # [m] of float32


def asked(rng, n_p, fitted, T=12):
    """A scene, paths (c, T + 1, n_c), what errors take from them, and their exact clearances."""
    model = points_model(rng, n_p=n_p, m=4, T=T, fitted=fitted)
    problem = points_problem(rng, model)
    spans = [(0, T - 1), (5, 7)][: len(problem.obstacles)]
    scene = scene_of(problem.replace(spans=tuple(spans)), model)
    k = rng.uniform(-1, 1, (200, 2))
    p0 = rng.uniform(-2, 2, (200, n_p))
    path = moved_to(p0, trajectories(model.net, model.layout, k)[0])
    bins = model.tube.bin_of(k)
    taken = along_fan(model.tube).of(jnp.asarray(bins))
    with x64():
        errors = jax.tree.map(jnp.asarray, model.tube.during(bins))
        exact = jax.vmap(lambda p, e: clearance(scene, p, e))(jnp.asarray(path), errors)
    return scene.obstacles, jnp.asarray(path.swapaxes(1, 2), jnp.float32), taken, np.asarray(exact)


@pytest.mark.night
@pytest.mark.parametrize("fitted", [False, True])
@pytest.mark.parametrize(("n_p", "lost"), [(2, 0.05), (3, 0.25)])
def test_an_estimate_is_no_more_than_the_clearance_and_nearly_as_much(rng, n_p, lost, fitted):
    pairs, path, taken, exact = asked(rng, n_p, fitted)
    found = np.asarray(estimate_clearance(pairs, path, taken))
    assert (found <= exact + ROUNDING)[exact > 0].all()
    assert (found <= ROUNDING)[exact <= 0].all()
    assert 20 < (exact > 0).sum() < 200
    assert (found >= exact - lost)[exact > 0].mean() > 0.9
    assert np.median((exact - found)[exact > 0]) < 0.4 * lost


@pytest.mark.slow
@pytest.mark.parametrize("fitted", [False, True])
def test_a_rough_look_keeps_the_best(rng, fitted):
    """Of every four knots one: the best twelve of 64 hold a plan that is nearly the best."""
    pairs, path, taken, exact = asked(rng, 2, fitted)
    rough = np.asarray(estimate_roughly(pairs, path, taken))
    for some in np.split(np.arange(192), 3):
        kept = some[np.argsort(-rough[some])[:12]]
        assert exact[kept].max() >= exact[some].max() - 0.02
    without = np.asarray(estimate_roughly(pairs.replace(active=0 * pairs.active > 0), path, taken))
    assert np.isinf(without).all()


@pytest.mark.parametrize("fitted", [False, True])
def test_a_rough_look_is_traced_in_a_search(rng, fitted):
    """A batch ended in a TracerArrayConversionError: of several points, under a tube of boxes."""
    model = points_model(rng, fitted=fitted)
    obstacles = scene_of(points_problem(rng, model), model).obstacles
    path = jnp.zeros((3, model.n_c, model.time.n_steps + 1), jnp.float32)

    def look(path, bins):
        return estimate_roughly(obstacles, path, along_fan(model.tube).of(bins))

    assert jax.eval_shape(look, path, jnp.zeros(3, int)).shape == (3,)


def test_what_faces_take_along_the_fan_is_worked_out_once(rng):
    tube = points_model(rng, m=3, T=5, fitted=True).tube
    table = along_fan(tube).lost
    assert table is along_fan(tube).lost and table.dtype == np.float32
    angle = 2 * np.pi * 7 / 24
    w = np.array([np.cos(angle), np.sin(angle)])
    wanted = tube.errors.support(-w)  # (n_bins, T, n_points)
    np.testing.assert_allclose(table[7], wanted.swapaxes(1, 2), rtol=1e-5, atol=1e-7)
    assert along_fan(points_model(rng, m=3).tube).lost is None
