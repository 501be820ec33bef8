"""The table: rows, neighbours, maps, vertices and `locate` agree with one another and with the
network.
"""

import numpy as np
import pytest
from exact_points import with_exact_points
from region_networks import outputs, random_network

from benchmarks.neuralparc.cells import neighbours
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.proof.regions import enumerate_regions
from parc_jax.proof.regions.table import float_patterns

SHAPES = [(1, [6, 5]), (2, [8, 6, 5]), (3, [7, 6]), (4, [6, 5])]


@pytest.fixture(scope="module", params=SHAPES, ids=str)
def table(request):
    n, widths = request.param
    return enumerate_regions(random_network(n, widths, seed=n), box(-1.5 * np.ones(n), np.ones(n)))


def test_vertices_satisfy_the_rows_and_every_row_is_a_facet(table):
    n = table.net.n_in
    for i in range(table.count):
        region, v = table.region(i), table.region_vertices(i)
        slack = region.b[:, None] - region.A @ v.T
        assert slack.min() >= -1e-13
        tight = slack <= 1e-11
        for row in tight:  # n affinely independent vertices: the row is not redundant
            assert np.linalg.matrix_rank(v[row] - v[row].mean(axis=0), tol=1e-9) == n - 1
        assert (tight.sum(axis=0) >= n).all()


def test_neighbours_are_mutual_and_share_the_facet(table):
    ends, across = table.facet_offsets, neighbours(table)
    for i in range(table.count):
        for facet, other in zip(
            table.facet_index[ends[i] : ends[i + 1]],
            across[ends[i] : ends[i + 1]],
            strict=True,
        ):
            label = table.facet_label[facet]
            assert (other < 0) == (label < 0)
            if other >= 0:
                assert facet in table.facet_index[ends[other] : ends[other + 1]]
                differ = np.flatnonzero(table.patterns[i] != table.patterns[other])
                assert label in differ and (len(differ) == 1 or differ.min() == label)


def test_maps_are_the_network_on_closed_regions(table):
    all_C, all_d = table.maps()
    for i in range(table.count):
        v = table.region_vertices(i)
        points = np.concatenate([v, v.mean(axis=0, keepdims=True)])
        np.testing.assert_allclose(
            points @ all_C[i].T + all_d[i], outputs(table.net, points), atol=1e-12
        )
    C, d = table.maps(slice(0, 3))
    np.testing.assert_array_equal(C, all_C[:3])
    np.testing.assert_array_equal(d, all_d[:3])


def test_locate_finds_the_pattern_of_random_points(table, rng):
    k = rng.uniform(table.domain.lo, table.domain.hi, (20_000, table.net.n_in))
    number = table.locate(k)
    on, sure = float_patterns(table.net, k)
    assert sure.all()
    np.testing.assert_array_equal(table.patterns[number], on)
    share = np.bincount(number, minlength=table.count) / len(k)
    expected = table.volumes / table.domain.volume
    assert np.abs(share - expected).max() <= 6 * np.sqrt(expected.max() / len(k))


def test_locate_on_vertices_facets_and_outside(table):
    for x in (table.points[:60], np.array([table.domain.lo, table.domain.hi])):
        number = table.locate(x)
        assert (number >= 0).all()
        for point, i in zip(x, number, strict=True):
            region = table.region(i)
            assert (region.A @ point <= region.b + 1e-12).all()
    assert table.locate(table.domain.hi + 1e-9) == -1
    assert table.locate(np.full((2, 3, table.net.n_in), 50.0)).tolist() == [[-1] * 3] * 2
    with pytest.raises(InputError, match="expected k of "):
        table.locate(np.zeros(table.net.n_in + 1))


def test_exact_points_are_within_the_stated_error(table):
    exact = with_exact_points(table)
    moved = np.abs(exact.points - table.points)
    assert (moved <= table.point_error + exact.point_error).all()
    assert moved.max() <= 1e-12
    assert exact.point_error.max() <= 2.0**-52


def test_a_number_of_no_region_is_refused(table):
    """-1 is what `locate` says outside of the domain, where nothing is a region."""
    ways = (table.region, table.region_vertices, table.maps, lambda i: table.maps([0, i]))
    for wrong in (-1, table.count, int(table.locate(np.full(table.net.n_in, 5.0)))):
        for ask in ways:
            with pytest.raises(InputError, match=rf"region: expected .* 0 to {table.count - 1}"):
                ask(wrong)
    assert len(table.maps([])[0]) == 0 and len(table.maps(slice(-1, None))[0]) == 1
    assert len(table.maps(np.ones(table.count, bool))[0]) == table.count
    np.testing.assert_array_equal(table.maps(np.array(0))[0], table.maps(0)[0])
