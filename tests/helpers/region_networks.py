"""Networks for the tests of regions: random ones, degenerate ones, and those that others trained
and counted.
"""

from itertools import pairwise

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import relu_network


def unit_box(n):
    return box(-np.ones(n), np.ones(n))


def random_network(n, widths, seed=0, out=2, integer=0, bias=True):
    """Gaussian weights, or integers in [-integer, integer]."""
    rng, sizes = np.random.default_rng(seed), [n, *widths, out]

    def draw(*shape):
        return (
            rng.integers(-integer, integer + 1, shape).astype(float)
            if integer
            else rng.normal(size=shape)
        )

    weights = [draw(b, a) for a, b in pairwise(sizes)]
    return relu_network(weights, [draw(b) * bias for b in sizes[1:]])


def degenerate_networks(n, widths, seed=0):
    """(name, network) with one special first-layer neuron each; the rest is random. widths[0]
    >= 2.
    """
    base = random_network(n, widths, seed)

    def changed(edit):
        weights, biases = [W.copy() for W in base.weights], [b.copy() for b in base.biases]
        edit(weights, biases)
        return relu_network(weights, biases)

    def constant(value):
        def edit(W, b):
            W[0][0], b[0][0] = 0.0, value

        return edit

    def multiple(c):
        def edit(W, b):
            W[0][1], b[0][1] = c * W[0][0], c * b[0][0]

        return edit

    def rescaled(c):
        def edit(W, b):
            W[0][0], b[0][0], W[1][:, 0] = W[0][0] * c, b[0][0] * c, W[1][:, 0] / c

        return edit

    def parallel(gap):
        def edit(W, b):
            W[0][1], b[0][1] = W[0][0], b[0][0] + gap

        return edit

    def through_corner(W, b):
        b[0][0] = -W[0][0].sum()

    def on_the_box(sign):
        def edit(W, b):
            W[0][0] = np.eye(n)[0] * sign
            b[0][0] = -1.0

        return edit

    def bundle(W, b):
        b[0][:] = -W[0] @ np.full(n, 0.25)

    edits = {
        "constant positive": constant(1.0),
        "constant negative": constant(-1.0),
        "zero": constant(0.0),
        "duplicate": multiple(1.0),
        "opposite": multiple(-1.0),
        "multiple that rounds": multiple(3.0),
        "multiple 1e7": multiple(1e7),
        "multiple -1e-7": multiple(-1e-7),
        "rescaled 1e7": rescaled(1e7),
        "rescaled 1e-7": rescaled(1e-7),
        "parallel at 2^-40": parallel(2.0**-40),
        "parallel at one ulp": parallel(2.0**-52),
        "through a corner": through_corner,
        "on the box from inside": on_the_box(1.0),
        "on the box, opposite": on_the_box(-1.0),
        "all through one point": bundle,
    }
    return [(name, changed(edit)) for name, edit in edits.items()]


def reference_network(shared_data, name):
    """(network, domain, number of regions found elsewhere)."""
    with np.load(shared_data / "nets" / f"{name}.npz") as z:
        layers = sum(key.startswith("W") for key in z.files)
        net = relu_network([z[f"W{i}"] for i in range(layers)], [z[f"b{i}"] for i in range(layers)])
        return net, box(z["lo"], z["hi"]), int(z["regions"])


def outputs(net, k):
    """Plain forward pass (m, n) -> (m, n_out)."""
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        k = np.maximum(k @ W.T + b, 0.0)
    return k @ net.weights[-1].T + net.biases[-1]
