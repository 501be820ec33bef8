"""Every degenerate family against plain rational arithmetic: the same regions, the same
vertices.
"""

import numpy as np
import pytest
from exact_regions import exact_regions
from region_networks import degenerate_networks, random_network, unit_box

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import enumerate_regions

pytestmark = pytest.mark.soundness
SHAPES = [(1, [4, 3]), (2, [3, 2]), (2, [2, 2, 2]), (3, [2, 2])]


def assert_same_regions(net, domain):
    rows = from_box(domain)
    expected = exact_regions(net, rows.A, rows.b)
    table = enumerate_regions(net, domain)
    found = {tuple(pattern.tolist()): i for i, pattern in enumerate(table.patterns)}
    assert set(found) == set(expected)
    for pattern, vertices in expected.items():
        ours = table.region_vertices(found[pattern])
        exact = np.array([[float(x) for x in v] for v in vertices])
        assert len(ours) == len(exact)
        distance = np.abs(ours[:, None] - exact[None]).max(axis=2)
        assert distance.min(axis=0).max() <= 1e-12 and distance.min(axis=1).max() <= 1e-12
    return table


@pytest.mark.parametrize(("n", "widths"), SHAPES)
def test_one_special_neuron(n, widths):
    for _, net in degenerate_networks(n, widths, seed=n):
        assert_same_regions(net, unit_box(n))


@pytest.mark.parametrize(("n", "widths"), SHAPES)
def test_integer_weights_meet_everywhere(n, widths):
    exact = 0
    for seed in range(2):
        for bias in (True, False):
            net = random_network(n, widths, seed, integer=2, bias=bias)
            exact += assert_same_regions(net, unit_box(n)).proof.n_exact
    assert exact > 0 or n == 1  # floats alone could not have decided these


def test_a_deep_neuron_that_copies_one_of_the_first_layer():
    """relu(relu(z)), relu(-relu(z)) and relu(relu(z) - relu(z)): zero on whole regions, or the same
    hinge again.
    """
    W0 = np.array([[1.0, 0.3], [-0.2, 0.9]])
    W1 = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 0.0], [0.5, 0.5]])
    net = relu_network([W0, W1, np.ones((1, 4))], [np.array([0.1, -0.2]), np.zeros(4), np.zeros(1)])
    assert_same_regions(net, unit_box(2))


def test_dead_layer_feeds_its_bias_forward():
    """Every neuron of a layer is off: the next layer is constant, positive and active [A7]."""
    W0, b0 = np.eye(2), np.full(2, -5.0)
    net = relu_network([W0, np.eye(2), np.ones((1, 2))], [b0, np.array([0.5, -0.5]), np.zeros(1)])
    table = assert_same_regions(net, unit_box(2))
    assert table.patterns.tolist() == [[False, False, True, False]]
    assert table.maps()[1][0] == 0.5


def test_sliver_between_two_nearly_equal_neurons_is_kept():
    """A region 2^-40 wide exists, is found, and has the volume it should have [A9]."""
    W = np.array([[1.0, 0.5], [1.0, 0.5]])
    net = relu_network([W, np.ones((1, 2))], [np.array([0.0, 2.0**-40]), np.zeros(1)])
    table = assert_same_regions(net, unit_box(2))
    assert table.count == 3
    assert table.volumes.min() == pytest.approx(2.0 * 2.0**-40, rel=1e-3)


def test_axes_of_very_different_units():
    """No threshold decides a sign: at any scale of the axes the regions are the same [A8]."""
    net = random_network(2, [4, 3], seed=5)
    scale = np.array([1e-9, 1e8])
    stretched = relu_network([net.weights[0] / scale, *net.weights[1:]], net.biases)
    table = enumerate_regions(stretched, box(-scale, scale))
    assert table.count == enumerate_regions(net, unit_box(2)).count


@pytest.mark.night
@pytest.mark.parametrize("seed", range(40))
def test_random_degenerate_networks(seed):
    rng = np.random.default_rng(seed)
    for _ in range(6):
        n = int(rng.integers(1, 5))
        widths = [int(v) for v in rng.integers(1, {1: 6, 2: 5, 3: 4, 4: 3}[n], rng.integers(1, 4))]
        net = random_network(n, widths, int(rng.integers(1 << 30)), integer=int(rng.integers(1, 4)))
        nudge = 2.0 ** -rng.integers(30, 60) * rng.integers(2)
        net = relu_network(
            [W + nudge * np.sign(W) * np.arange(W.shape[0])[:, None] for W in net.weights],
            net.biases,
        )
        assert_same_regions(
            net, box(-rng.integers(1, 4, n).astype(float), rng.integers(1, 4, n).astype(float))
        )
