"""The float filter: its bounds hold against rational arithmetic."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from region_networks import degenerate_networks, random_network, unit_box

from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import enumerate_regions, signs

pytestmark = pytest.mark.soundness


@pytest.fixture
def watched(monkeypatch):
    """Ratios error / bound of pre-activations and of vertices, sampled at every cut."""
    ratios, rng, original = (
        {"value": [], "point": []},
        np.random.default_rng(0),
        signs.SignOracle.codes,
    )

    def codes(self, j):
        lattice, column, n_rows = self.lattice, self.first_column + j, len(self.exact.rows)
        values = lattice.z.view[:, j].copy()
        found, slack = original(self, j)
        for v in rng.choice(len(values), min(2, len(values)), replace=False):
            plus, zero = lattice.bits.at(int(v), column)
            on = np.zeros(self.exact.first_neuron[-1], bool)
            on[: max(column - n_rows, 0)] = plus[n_rows:]
            columns = np.flatnonzero(zero)
            point, q = self.exact.vertex(
                columns[columns < n_rows], columns[columns >= n_rows] - n_rows, on
            )
            exact, scale = self.exact.values(self.layer, point, q, on)
            error = abs(Fraction(values[v]) - Fraction(exact[j], scale))
            ratios["value"].append(float(error / Fraction(slack.threshold[v])) if error else 0.0)
            away = [
                Fraction(x) - Fraction(p, q) for x, p in zip(lattice.x.data[v], point, strict=True)
            ]
            distance = float(sum(d * d for d in away)) ** 0.5
            ratios["point"].append(distance / lattice.rho.data[v] if distance else 0.0)
            assert found[v] == (1 if exact[j] > 0 else 2 if exact[j] < 0 else 0)
        return found, slack

    monkeypatch.setattr(signs.SignOracle, "codes", codes)
    return ratios


def nasty_network(rng, n):
    """Rows and biases over twelve orders of magnitude, and a nearly equal pair of neurons in every
    layer.
    """
    sizes = [n, *rng.integers(2, 5, 3), 1]
    weights, biases = [], []
    for a, b in pairwise(sizes):
        W = rng.normal(size=(b, a)) * 10.0 ** rng.integers(-6, 7, (b, 1))
        beta = rng.normal(size=b) * 10.0 ** rng.integers(-6, 7, b)
        if b > 1:
            W[1], beta[1] = W[0] * (1 + 2.0 ** -rng.integers(20, 50) * rng.normal(size=a)), beta[0]
        weights.append(W)
        biases.append(beta)
    return relu_network(weights, biases)


def test_bounds_hold(watched):
    for n, widths in [(1, [6, 6]), (2, [12, 12, 12]), (3, [8, 8]), (4, [6, 6])]:
        enumerate_regions(random_network(n, widths, seed=n), unit_box(n))
    for _, net in degenerate_networks(2, [4, 3], seed=1):
        enumerate_regions(net, unit_box(2))
    rng = np.random.default_rng(1)
    for _ in range(20):
        n = int(rng.integers(1, 4))
        width = rng.uniform(0.1, 1, n) * 10.0 ** rng.integers(-5, 5, n)
        enumerate_regions(nasty_network(rng, n), box(-width, width))
    assert len(watched["value"]) > 600
    assert max(watched["value"]) <= 0.5 and max(watched["point"]) <= 0.5
    assert max(watched["value"]) > 1e-4  # not so loose that the filter is useless
