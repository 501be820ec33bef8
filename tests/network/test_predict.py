"""Predictions: kernel and host function say the same, in the layout of the outputs, written
once.
"""

import re
from pathlib import Path

import jax
import numpy as np
import pytest
from toy_models import host_outputs, random_network

import parc_jax
from parc_jax.common.arrays import x64
from parc_jax.learning.network.predict import Layout, predict, trajectories
from parc_jax.learning.network.relu import outputs

T, N_P, N_Q = 4, 2, 1
LAYOUT = Layout(T, N_P)
compiled = jax.jit(predict, static_argnums=1)
ROOT = Path(parc_jax.__file__).parent


@pytest.fixture(scope="module")
def net():
    return random_network(np.random.default_rng(3), T)


@pytest.fixture(scope="module")
def k():
    return np.random.default_rng(4).uniform(-1, 1, (50, 2))


def test_a_prediction_is_the_network_time_major_from_the_start(net, k):
    with x64():
        offsets, q, pattern = compiled(net, LAYOUT, k[0])
    y = host_outputs(net, k[:1])[0]
    knots = np.concatenate([np.zeros((1, N_P)), y[: T * N_P].reshape(T, N_P)])
    np.testing.assert_allclose(offsets, knots, atol=1e-13)
    np.testing.assert_allclose(q, y[T * N_P :], atol=1e-13)
    h, expected = k[0], []
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        z = W @ h + b
        expected.append(z > 0)
        h = np.maximum(z, 0)
    np.testing.assert_array_equal(pattern, np.concatenate(expected))


def test_host_and_kernel_agree(net, k):
    offsets, q = trajectories(net, LAYOUT, k)
    np.testing.assert_allclose(outputs(net, k), host_outputs(net, k), atol=1e-13)
    np.testing.assert_allclose(outputs(net, k, slice(6, 8)), outputs(net, k)[:, 6:8], atol=1e-13)
    whole = jax.jit(lambda net, k: net(k))
    for row in range(5):
        with x64():
            one, one_q, _ = compiled(net, LAYOUT, k[row])
            direct = np.asarray(whole(net, k[row]))
        np.testing.assert_allclose(offsets[row], one, atol=1e-13)
        np.testing.assert_allclose(q[row], one_q, atol=1e-13)
        np.testing.assert_allclose(np.concatenate([one[1:].ravel(), one_q]), direct, atol=0)


def test_a_network_without_hidden_layers_has_an_empty_pattern():
    affine = random_network(np.random.default_rng(5), T, hidden=())
    with x64():
        assert compiled(affine, LAYOUT, np.zeros(2))[2].shape == (0,)


def test_the_forward_pass_is_written_once():
    again = re.compile(r"= (np|jnp)\.maximum\([^\n]*(@ W|matmul\(W)")
    found = {str(p.relative_to(ROOT)) for p in ROOT.rglob("*.py") if again.search(p.read_text())}
    assert found == {"learning/network/relu.py"}
