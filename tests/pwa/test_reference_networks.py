"""Networks that others trained and counted: same number of regions, complete."""

import pytest
from region_networks import reference_network

from parc_jax.proof.regions import enumerate_regions

pytestmark = pytest.mark.soundness


@pytest.mark.parametrize(
    "name",
    [
        "vanderpol_2_20_20",
        "neuralparc_boat_3_8x4",
        "bunny_3_16x3",
        "double_pendulum_4_25_25",
        "vcas_3_20x5",
    ],
)
def test_count_and_volume_of_published_networks(shared_data, name):
    net, domain, count = reference_network(shared_data, name)
    table = enumerate_regions(net, domain)
    assert table.count == count
    assert abs(table.volumes.sum() - domain.volume) <= 1e-12 * domain.volume
    assert table.proof.euler == 1
    assert (
        table.proof.n_exact <= 10
    )  # the filter decides: a handful of hundreds of thousands of signs, if any
