"""The static rounding bound holds for every evaluation, and would not without each of its parts.
[T10]
"""

from fractions import Fraction as F

import jax
import numpy as np
import pytest
from toy_models import random_network

from parc_jax.common.sets.box import box
from parc_jax.learning.network import rounding
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.network.rounding import rounding_bound

UNIT_BOX = box([-1, -1], [1, 1])


def exact(net, k):
    h = [F(float(v)) for v in k]
    for depth, (W, b) in enumerate(zip(net.weights, net.biases, strict=True)):
        rows = zip(W.tolist(), b.tolist(), strict=True)
        h = [sum((F(w) * x for w, x in zip(row, h, strict=True)), F(c)) for row, c in rows]
        h = [max(x, F(0)) for x in h] if depth < len(net.weights) - 1 else h
    return h


def cancelling(rng, size=1e8):
    """Outputs near 1 as differences of numbers near `size`: rounding is large compared with the
    value.
    """
    net = random_network(rng, 2, (6, 6))
    W = [w.copy() for w in net.weights]
    b = [c.copy() for c in net.biases]
    b[1] = b[1] + size
    W[2] = np.concatenate([W[2][:, :3], -W[2][:, :3]], axis=1)
    return relu_network(W, b)


def worst_ratio(net, rng, one_by_one, count=40):
    """Largest |computed - exact| / bound over random inputs, corners of the box included, by one
    program and `one_by_one`; also checks magnitudes.
    """
    bound = rounding_bound(net, UNIT_BOX)
    k = np.concatenate([rng.uniform(-1, 1, (count, 2)), [[-1, -1], [-1, 1], [1, 1], [0, 0]]])
    compiled = np.asarray(jax.jit(jax.vmap(net))(k))
    one = np.array([np.asarray(one_by_one(x)) for x in k[:8]])
    worst = 0.0
    for i, x in enumerate(k):
        truth = exact(net, x)
        for got in (compiled[i], *([one[i]] if i < 8 else [])):
            error = [abs(F(float(v)) - t) for v, t in zip(got, truth, strict=True)]
            worst = max(
                worst, *(float(e / F(b)) for e, b in zip(error, bound.error.tolist(), strict=True))
            )
        assert all(abs(t) <= F(m) for t, m in zip(truth, bound.magnitude.tolist(), strict=True))
        assert (np.abs(compiled[i]) <= bound.magnitude).all()
    return worst


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_bound_holds_for_random_and_for_cancelling_networks(seed):
    rng = np.random.default_rng(seed)
    for net in (random_network(rng, 3, (6, 5)), cancelling(rng)):
        assert worst_ratio(net, rng, one_by_one=net) <= 1  # op by op


def test_errors_of_earlier_layers_are_carried_on():
    """A long sum of equal numbers rounds the same way again and again; a layer of one neuron that
    follows it adds next to nothing of its own, and must still answer for all of it.
    """
    many = 4096
    W = [np.full((many, 1), 0.1), np.full((1, many), 1.0), np.ones((1, 1))]
    net = relu_network(W, [np.zeros(many), np.zeros(1), np.zeros(1)])
    bound = rounding_bound(net, box([-1.0], [1.0]))
    added = np.add.accumulate(np.full(many, 0.1))[-1]  # one after the other, the worst order
    error = abs(F(float(added)) - many * F(0.1))
    own = 3 * rounding.UNIT * bound.magnitude[0]
    assert own < error <= F(float(bound.error[0]))


def test_bound_grows_with_the_domain_and_is_small_for_small_networks():
    rng = np.random.default_rng(3)
    net = random_network(rng, 3, (6, 5))
    small, large = (rounding_bound(net, box([-s, -s], [s, s])) for s in (1, 10))
    assert (large.error >= small.error).all() and (large.magnitude >= small.magnitude).all()
    assert small.error.max() < 1e-12
    shifted = rounding_bound(net, box([99, 99], [101, 101]))
    assert (shifted.error > small.error).all()
