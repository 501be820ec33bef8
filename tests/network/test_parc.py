"""PARC's model: one affine map per time step, as a network without hidden layers."""

import numpy as np
import pytest
from gap_model import HI, LO, arcs

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.network.fit import fit_affine
from parc_jax.proof.regions.subdivide import enumerate_regions


def test_affine_data_is_recovered_exactly(rng):
    C, d, k = rng.normal(size=(7, 3)), rng.normal(size=7), rng.uniform(90, 110, (50, 3))
    net = fit_affine(k, k @ C.T + d)
    np.testing.assert_allclose(net.weights[0], C, atol=1e-10)
    np.testing.assert_allclose(net.biases[0], d, atol=1e-8)
    assert net.hidden == ()


def test_fit_is_the_least_squares_one(rng):
    k = rng.uniform(LO, HI, (200, 2))
    outputs = arcs(k, 5)
    net = fit_affine(k, outputs)
    residual = outputs - k @ net.weights[0].T - net.biases[0]
    np.testing.assert_allclose(
        np.c_[k, np.ones(200)].T @ residual, 0, atol=1e-9
    )  # normal equations


def test_it_passes_through_the_region_stage(rng):
    k = rng.uniform(LO, HI, (50, 2))
    table = enumerate_regions(fit_affine(k, arcs(k, 5)), box(LO, HI))
    assert table.count == 1 and table.patterns.shape == (1, 0)


def test_samples_that_do_not_determine_the_map_are_refused():
    with pytest.raises(InputError, match="vary in all 2 parameters"):
        fit_affine(np.ones((5, 2)), np.ones((5, 3)))
    with pytest.raises(InputError, match="rank 2"):
        fit_affine(np.eye(2), np.ones((2, 3)))


def test_it_is_too_coarse_for_the_parking_scene(shared_data):
    """A tube from 60 runs, scaled to hold on 40 fresh ones, ends wider than the goal, whose half
    width is 0.8 m.
    """
    data = np.load(shared_data / "drift_reference.npz")
    k, p = data["k"], data["p"][:, ::10]
    outputs = (p - p[:, :1])[:, 1:].reshape(len(k), -1)
    net = fit_affine(k[:60], outputs[:60])
    error = np.abs(k @ net.weights[0].T + net.biases[0] - outputs)
    shape = error[:60].max(axis=0) + 1e-3
    assert (shape * (error[60:] / shape).max())[-2:].max() > 0.8
