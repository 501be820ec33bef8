"""Laws of the regions, for networks drawn by hypothesis: generic, integer (degenerate) and
bias-free ones.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from region_networks import outputs, random_network, unit_box

from parc_jax.proof.regions import enumerate_regions

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


@laws
@given(networks(), seeds)
def test_piece_equals_the_network_on_its_region(net, seed):
    table = enumerate_regions(net, unit_box(net.n_in))
    number, k = interior_points(table, np.random.default_rng(seed))
    C, d = table.maps(number)
    ours = np.einsum("bij,bj->bi", C, k) + d
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
