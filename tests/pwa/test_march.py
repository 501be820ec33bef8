"""Marching finds, one LP at a time, exactly the regions that subdivision finds all at once."""

from itertools import islice

import numpy as np
import pytest
from marching import march
from region_networks import (
    degenerate_networks,
    outputs,
    random_network,
    reference_network,
    unit_box,
)

from parc_jax.common.errors import InputError
from parc_jax.proof.regions import enumerate_regions

pytestmark = pytest.mark.soundness


def assert_march_equals_table(net, domain, seed):
    table, marched = enumerate_regions(net, domain), list(march(net, domain, seed))
    assert len(marched) == table.count
    number = {pattern.tobytes(): i for i, pattern in enumerate(table.patterns)}
    for region in marched:
        i = number[region.pattern.tobytes()]
        facets = slice(table.facet_offsets[i], table.facet_offsets[i + 1])
        labels = table.facet_label[table.facet_index[facets]]
        ours, theirs = np.argsort(labels), np.argsort(region.label)
        np.testing.assert_array_equal(labels[ours], region.label[theirs])
        behind = np.where(table.neighbours[facets] < 0, i, table.neighbours[facets])
        np.testing.assert_array_equal(table.patterns[behind][ours], region.neighbours[theirs])
        rows = np.column_stack([table.A[facets], table.b[facets]])[ours]
        rows /= np.linalg.norm(rows[:, :-1], axis=1, keepdims=True)
        other = np.column_stack([region.A, region.b])[theirs]
        other /= np.linalg.norm(other[:, :-1], axis=1, keepdims=True)
        np.testing.assert_allclose(rows, other, atol=1e-12)
    return table


@pytest.mark.night
def test_van_der_pol(shared_data):
    net, domain, count = reference_network(shared_data, "vanderpol_2_20_20")
    assert assert_march_equals_table(net, domain, domain.center).count == count


@pytest.mark.night
def test_boat(shared_data):
    net, domain, count = reference_network(shared_data, "neuralparc_boat_3_8x4")
    assert assert_march_equals_table(net, domain, domain.center).count == count


@pytest.mark.parametrize(("n", "widths"), [(1, [5, 4]), (2, [6, 4]), (3, [4, 3]), (4, [3, 2])])
def test_random_networks_from_several_seeds(n, widths):
    net, domain = random_network(n, widths, seed=n), unit_box(n)
    for seed in (domain.center, domain.lo, domain.hi):
        assert_march_equals_table(net, domain, seed)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "widths"), [(1, [4, 3]), (2, [3, 2]), (3, [2, 2])])
def test_degenerate_families(n, widths):
    for _, net in degenerate_networks(n, widths, seed=n + 10):
        assert_march_equals_table(net, unit_box(n), np.ones(n))


def test_more_inputs_than_subdivision_takes():
    """n_k = 9, only a few regions asked for: each map is the network at its own interior points."""
    net, domain = random_network(9, [12, 10], seed=2), unit_box(9)
    regions = list(islice(march(net, domain, np.full(9, 0.1)), 6))
    assert len({region.pattern.tobytes() for region in regions}) == 6
    rng = np.random.default_rng(0)
    k = 0.1 + 1e-3 * rng.normal(size=(50, 9))
    inside = k[(k @ regions[0].A.T <= regions[0].b).all(axis=1)]
    assert len(inside) > 0
    on = [inside @ net.weights[0].T + net.biases[0] > 0]
    assert (on[0] == regions[0].pattern[:12]).all()
    assert np.isfinite(outputs(net, inside)).all()


def test_lazy():
    """The first region of a network with millions of regions comes at once."""
    net = random_network(6, [64, 64], seed=0)
    first = next(march(net, unit_box(6), np.zeros(6)))
    assert len(first.A) == len(first.label) == len(first.neighbours)


def test_seed_outside_is_refused():
    with pytest.raises(InputError, match="inside the domain"):
        march(random_network(2, [3]), unit_box(2), [2.0, 0.0])
