"""The affine map of a pattern alone, with its region, and of a whole table in chunks."""

import numpy as np
import pytest
from region_networks import outputs, random_network, unit_box

from parc_jax.learning.network import maps
from parc_jax.learning.network.maps import affine_maps, pattern_map
from parc_jax.proof.regions import enumerate_regions


@pytest.mark.parametrize(("n", "widths"), [(1, [4]), (2, [6, 5]), (3, [5, 4, 3])])
def test_one_pattern_and_many_agree(n, widths, monkeypatch):
    monkeypatch.setattr(maps, "CHUNK_BYTES", 1000)  # several chunks
    table = enumerate_regions(random_network(n, widths, seed=n), unit_box(n))
    net = table.net
    C, d = affine_maps(net, table.patterns)
    for i in range(0, table.count, max(1, table.count // 7)):
        inside = table.region_vertices(i).mean(axis=0)
        A, b, one_C, one_d = pattern_map(net, table.patterns[i])
        np.testing.assert_allclose(one_C, C[i], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(one_d, d[i], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(one_C @ inside + one_d, outputs(net, inside[None])[0])
        assert (A @ inside <= b).all() and len(b) == sum(net.hidden)
