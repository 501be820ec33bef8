"""Networks that others trained and counted: same number of regions, complete."""

import numpy as np
import pytest

from parc_jax.network.relu import relu_network
from parc_jax.pwa.subdivide import enumerate_regions
from parc_jax.sets.box import box

pytestmark = pytest.mark.soundness


def reference_network(shared_data, name):
    with np.load(shared_data / "nets" / f"{name}.npz") as z:
        layers = sum(key.startswith("W") for key in z.files)
        net = relu_network([z[f"W{i}"] for i in range(layers)], [z[f"b{i}"] for i in range(layers)])
        return net, box(z["lo"], z["hi"]), int(z["regions"])


@pytest.mark.parametrize(
    "name",
    ["vanderpol_2_20_20", "neuralparc_boat_3_8x4", "bunny_3_16x3", "double_pendulum_4_25_25", "vcas_3_20x5"],
)
def test_count_and_volume_of_published_networks(shared_data, name):
    net, domain, count = reference_network(shared_data, name)
    table = enumerate_regions(net, domain)
    assert table.count == count
    assert abs(table.volumes.sum() - domain.volume) <= 1e-12 * domain.volume
    assert table.proof.euler == 1
