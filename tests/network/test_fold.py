"""Folding the normalisation: the network on raw units is the normalised one, and a wrong fold is
refused.
"""

import itertools

import jax
import numpy as np
import pytest

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.learning.network import relu as folding
from parc_jax.learning.network.relu import Normalisation, fold


def normalisation(rng):
    return Normalisation(
        rng.normal(size=2) * 10, rng.uniform(0.1, 5, 2), rng.normal(size=4), rng.uniform(0.01, 9, 4)
    )


def layers(rng, hidden=(5, 3)):
    widths = [2, *hidden, 4]
    return (
        [rng.normal(size=(n, m)) for m, n in itertools.pairwise(widths)],
        [rng.normal(size=n) for n in widths[1:]],
    )


@pytest.mark.parametrize("hidden", [(5, 3), (4,), ()])
def test_folded_network_equals_the_normalised_one(rng, hidden):
    W, b = layers(rng, hidden)
    norm = normalisation(rng)
    net = fold(W, b, norm)
    k = norm.x_mean + norm.x_scale * rng.uniform(-3, 3, (100, 2))
    h = norm.inputs(k)
    for i, (w, c) in enumerate(zip(W, b, strict=True)):
        h = h @ w.T + c
        h = np.maximum(h, 0) if i < len(W) - 1 else h
    got = np.asarray(jax.jit(jax.vmap(net))(k))
    np.testing.assert_allclose(norm.outputs(got), h, atol=1e-9)
    assert all(w.dtype == np.float64 for w in net.weights)


def test_inputs_are_not_changed_in_place(rng):
    W, b = layers(rng)
    copies = [w.copy() for w in W], [c.copy() for c in b]
    fold(W, b, normalisation(rng))
    for now, before in zip((*W, *b), (*copies[0], *copies[1]), strict=True):
        np.testing.assert_array_equal(now, before)


def test_a_fold_that_loses_a_scaling_is_refused(rng, monkeypatch):
    W, b = layers(rng)
    right = folding.relu_network
    monkeypatch.setattr(folding, "relu_network", lambda W, b: right([W[0] * 1.001, *W[1:]], b))
    with pytest.raises(SoundnessError, match="differ"):
        fold(W, b, normalisation(rng))


def test_statistics_share_one_scale_in_the_workspace(rng):
    k, y = rng.normal(size=(500, 2)), rng.normal(size=(500, 5)) * [1, 2, 3, 4, 5]
    y[:, 4] = 7.0  # a goal state that never changes
    norm = Normalisation.of(k, y, n_p_outputs=4)
    assert len(set(norm.y_scale[:4])) == 1 and norm.y_scale[4] == 1.0
    np.testing.assert_allclose(norm.inputs(k).std(axis=0), 1)


def test_a_parameter_that_does_not_vary_is_refused(rng):
    k = rng.normal(size=(50, 2))
    k[:, 1] = 3.0
    with pytest.raises(InputError, match="axis 1 is constant"):
        Normalisation.of(k, rng.normal(size=(50, 4)), 4)
