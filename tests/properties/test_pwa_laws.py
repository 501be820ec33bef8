"""Laws of the regions, for networks drawn by hypothesis: generic, integer (degenerate) and
bias-free ones.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from region_networks import outputs, patterns_of, random_network, unit_box

from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import enumerate_regions, march

pytestmark = pytest.mark.property
laws = settings(derandomize=True, deadline=None, max_examples=15, print_blob=True)
seeds = st.integers(0, 2**31 - 1)
integers = st.sampled_from([0, 0, 1, 2])


@st.composite
def networks(draw, dimensions=(1, 2, 3), layers=(1, 3), widths=(2, 5)):
    n = draw(st.sampled_from(dimensions))
    shape = draw(st.lists(st.integers(*widths), min_size=layers[0], max_size=layers[1]))
    return random_network(n, shape, draw(seeds), integer=draw(integers), bias=draw(st.booleans()))


def interior_points(table, rng, per_region=3):
    """(region number, point) pairs: random convex combinations of the vertices."""
    number = np.repeat(np.arange(table.count), per_region)
    points = []
    for i in number:
        v = table.region_vertices(i)
        points.append(rng.dirichlet(np.ones(len(v))) @ v)
    return number, np.array(points)


def same_volumes(first, second, tolerance=1e-12):
    np.testing.assert_allclose(
        np.sort(first.volumes), np.sort(second.volumes), rtol=1e-9, atol=tolerance
    )


@laws
@given(networks(), seeds)
def test_piece_equals_the_network_on_its_region(net, seed):
    table = enumerate_regions(net, unit_box(net.n_in))
    number, k = interior_points(table, np.random.default_rng(seed))
    ours = np.einsum("bij,bj->bi", table.C[number], k) + table.d[number]
    np.testing.assert_allclose(ours, outputs(net, k), atol=1e-11)


@laws
@given(networks(), seeds)
def test_different_regions_share_no_interior_point(net, seed):
    table = enumerate_regions(net, unit_box(net.n_in))
    number, k = interior_points(table, np.random.default_rng(seed), per_region=2)
    holds = np.add.reduceat(
        table.A @ k.T < table.b[:, None] - 1e-9, table.facet_offsets[:-1], axis=0
    )
    strictly_inside = holds == np.diff(table.facet_offsets)[:, None]  # (region, point)
    assert (strictly_inside.sum(axis=0) <= 1).all()
    claimed = strictly_inside.any(axis=0)
    np.testing.assert_array_equal(strictly_inside.argmax(axis=0)[claimed], number[claimed])
    np.testing.assert_array_equal(table.locate(k)[claimed], number[claimed])


@laws
@given(networks(), seeds)
def test_permuting_neurons_permutes_the_patterns(net, seed):
    rng = np.random.default_rng(seed)
    orders = [rng.permutation(width) for width in net.hidden]
    weights, biases, previous = [], [], np.arange(net.n_in)
    for W, b, order in zip(net.weights, net.biases, [*orders, np.arange(net.n_out)], strict=True):
        weights.append(W[order][:, previous])
        biases.append(b[order])
        previous = order
    table = enumerate_regions(net, unit_box(net.n_in))
    other = enumerate_regions(relu_network(weights, biases), unit_box(net.n_in))
    first = np.cumsum([0, *net.hidden[:-1]])
    permuted = np.concatenate([start + order for start, order in zip(first, orders, strict=True)])
    assert {p[permuted].tobytes() for p in table.patterns} == patterns_of(other)
    same_volumes(table, other)


@laws
@given(networks(), seeds, st.integers(-40, 40))
def test_scaling_a_neuron_by_a_power_of_two_and_undoing_it_changes_nothing(net, seed, m):
    rng = np.random.default_rng(seed)
    layer = int(rng.integers(len(net.hidden)))
    j = int(rng.integers(net.hidden[layer]))
    weights, biases = [W.copy() for W in net.weights], [b.copy() for b in net.biases]
    weights[layer][j], biases[layer][j] = weights[layer][j] * 2.0**m, biases[layer][j] * 2.0**m
    weights[layer + 1][:, j] *= 2.0**-m
    table = enumerate_regions(net, unit_box(net.n_in))
    other = enumerate_regions(relu_network(weights, biases), unit_box(net.n_in))
    np.testing.assert_array_equal(table.patterns, other.patterns)
    np.testing.assert_allclose(table.points, other.points, atol=1e-13)


@laws
@given(networks(), seeds, st.sampled_from([1.0, 0.5, -2.0]))
def test_duplicating_a_neuron_leaves_the_cells(net, seed, factor):
    """A copy (or a multiple, or the opposite) beside a neuron adds a column to the patterns, and no
    region.
    """
    rng = np.random.default_rng(seed)
    layer = int(rng.integers(len(net.hidden)))
    j = int(rng.integers(net.hidden[layer]))
    weights, biases = [W.copy() for W in net.weights], [b.copy() for b in net.biases]
    weights[layer] = np.vstack([weights[layer], factor * weights[layer][j]])
    biases[layer] = np.append(biases[layer], factor * biases[layer][j])
    weights[layer + 1] = np.column_stack([weights[layer + 1], np.zeros(len(biases[layer + 1]))])
    table = enumerate_regions(net, unit_box(net.n_in))
    other = enumerate_regions(relu_network(weights, biases), unit_box(net.n_in))
    assert other.count == table.count
    same_volumes(table, other)


@laws
@given(networks(), st.integers(0, 5))
def test_mirroring_an_axis_mirrors_the_cells(net, axis):
    mirror = np.ones(net.n_in)
    mirror[axis % net.n_in] = -1.0
    lo, hi = -np.ones(net.n_in), np.linspace(1.0, 1.5, net.n_in)
    table = enumerate_regions(net, box(lo, hi))
    ends = np.sort(np.array([lo * mirror, hi * mirror]), axis=0)
    other = enumerate_regions(
        relu_network([net.weights[0] * mirror, *net.weights[1:]], net.biases), box(*ends)
    )
    assert patterns_of(table) == patterns_of(other)
    same_volumes(table, other)


@laws
@given(networks(), seeds)
def test_cutting_the_domain_in_two_cuts_the_cells(net, seed):
    """Regions of the two halves, counted by pattern, are the regions of the whole."""
    n, split = net.n_in, float(np.random.default_rng(seed).uniform(-0.9, 0.9))
    lo, hi = -np.ones(n), np.ones(n)
    whole = enumerate_regions(net, box(lo, hi))
    left = enumerate_regions(net, box(lo, np.append(split, hi[1:])))
    right = enumerate_regions(net, box(np.append(split, lo[1:]), hi))
    volume = {}
    for table in (left, right):
        for pattern, size in zip(table.patterns, table.volumes, strict=True):
            volume[pattern.tobytes()] = volume.get(pattern.tobytes(), 0.0) + size
    assert set(volume) == patterns_of(whole)
    for pattern, size in zip(whole.patterns, whole.volumes, strict=True):
        assert abs(volume[pattern.tobytes()] - size) <= 1e-11


@settings(laws, max_examples=8)
@given(networks(dimensions=(1, 2, 3), layers=(1, 2), widths=(2, 4)), seeds)
def test_marching_finds_the_same_regions_from_any_seed(net, seed):
    start = np.random.default_rng(seed).uniform(-1, 1, net.n_in)
    marched = [region.pattern.tobytes() for region in march(net, unit_box(net.n_in), start)]
    assert len(marched) == len(set(marched))
    assert set(marched) == patterns_of(enumerate_regions(net, unit_box(net.n_in)))
