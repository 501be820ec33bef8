"""Region counts and volumes that are known without computing."""

from math import comb

import numpy as np
import pytest
from region_networks import unit_box

from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import enumerate_regions


def one_layer(W, b):
    return relu_network([W, np.ones((1, len(b)))], [b, np.zeros(1)])


def test_absolute_values_have_one_region_per_orthant():
    for n in (1, 2, 3, 4):
        W = np.concatenate([np.eye(n), -np.eye(n)])
        table = enumerate_regions(one_layer(W, np.zeros(2 * n)), unit_box(n))
        assert table.count == 2**n
        np.testing.assert_array_equal(table.volumes, 1.0)
        assert (
            table.patterns[:, :n] ^ table.patterns[:, n:]
        ).all()  # |x_i| = relu(x_i) + relu(-x_i): exactly one is on


@pytest.mark.parametrize(("n", "neurons"), [(1, 7), (2, 12), (3, 9), (4, 8), (5, 7), (6, 7)])
def test_generic_arrangement_with_all_crossings_inside(n, neurons):
    """1 + m + C(m, 2) + ... + C(m, n) cells for m hyperplanes in general position."""
    rng = np.random.default_rng(n)
    W, b = rng.normal(size=(neurons, n)), 0.1 * rng.normal(size=neurons)
    wide = box(np.full(n, -1e4), np.full(n, 1e4))
    table = enumerate_regions(one_layer(W, b), wide)
    assert table.count == sum(comb(neurons, k) for k in range(n + 1))
    assert table.proof.gap <= 1e-12


def test_a_layer_that_folds_space_twice():
    """Tents: k layers of |x| - 1/2 folds give 2^k pieces."""
    fold = np.array([[1.0], [-1.0]])
    weights, biases = [fold], [np.zeros(2)]
    for level in range(1, 5):
        weights.append(fold @ np.ones((1, 2)))
        biases.append(np.array([-1.0, 1.0]) * 0.5**level)
    weights.append(np.ones((1, 2)))
    biases.append(np.zeros(1))
    table = enumerate_regions(relu_network(weights, biases), unit_box(1))
    assert table.count == 2**5
    np.testing.assert_allclose(table.volumes, 2 / 2**5, rtol=1e-15)
