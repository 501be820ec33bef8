"""Refitting the last layer to the largest errors."""

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.network.fit import fit_tail
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import time_grid


def skewed(rng, n=400):
    """Runs with one-sided noise: y = k + noise in [0, 1] with mean 1/4, so the middle of its range
    is 1/4 higher.
    """
    k = rng.uniform(-1, 1, (n, 1))
    y = k + rng.uniform(0, 1, (n, 1)) ** 3
    p = np.concatenate([np.zeros((n, 1, 1)), y[:, :, None]], axis=1)
    time = time_grid(dt=1.0, t_f=1.0, dt_record=1.0)
    domain = box([-1], [1])
    law = law_spec("skewed", domain)
    return RolloutBatch(np.arange(n), k, p, np.zeros((n, 0)), domain, time, law), y


def test_prediction_moves_from_the_mean_to_the_middle_of_the_range(rng):
    data, y = skewed(rng)
    mean = relu_network([np.array([[1.0]])], [np.array([0.25])])
    worst = [np.abs(y - data.k - fit_tail(mean, data, p).biases[-1]).max() for p in (2, 8, 32)]
    assert (
        worst[0] > worst[1] > worst[2] and worst[2] < 0.53
    )  # 0.5 is the best any prediction can do
    assert np.abs(y - data.k - 0.25).max() > 0.7


def test_power_two_is_least_squares(rng):
    data, y = skewed(rng)
    out = fit_tail(relu_network([np.array([[0.0]])], [np.array([0.0])]), data, 2.0)
    expected = np.linalg.lstsq(
        np.concatenate([data.k, np.ones_like(data.k)], axis=1), y, rcond=None
    )[0]
    np.testing.assert_allclose(
        [out.weights[-1][0, 0], out.biases[-1][0]], expected[:, 0], rtol=1e-6
    )


def test_hidden_layers_stay_and_a_perfect_fit_is_kept(rng):
    data, _ = skewed(rng)
    net = relu_network(
        [np.array([[1.0], [-1.0]]), np.array([[0.7, -0.7]])], [np.zeros(2), np.zeros(1)]
    )
    out = fit_tail(net, data)
    np.testing.assert_array_equal(out.weights[0], net.weights[0])
    p = data.p.copy()
    p[:, 1, 0] = np.maximum(data.k[:, 0], 0) * 0.7 + np.maximum(-data.k[:, 0], 0) * -0.7
    data = data.replace(p=p)
    assert fit_tail(net, data).hash == net.hash
