"""Domains that cannot be used are refused with a reason."""

import numpy as np
import pytest
from region_networks import random_network

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import enumerate_regions

NET = random_network(2, [3])


@pytest.mark.parametrize(
    ("domain", "words"),
    [
        (box([0, 0], [1, 0]), "box with interior"),
        (box([0, 0, 0], [1, 1, 1]), "2 dimensions"),
        ("a box", "domain: expected Box"),
        (from_box(box([0, 0], [1, 1])), "domain: expected Box"),
    ],
    ids=["flat box", "dimension", "not a set", "a polytope"],
)
def test_refused_domains(domain, words):
    with pytest.raises(InputError, match=words):
        enumerate_regions(NET, domain)


def test_more_than_six_inputs_are_sent_to_corridors():
    with pytest.raises(InputError, match="Corridors need no regions"):
        enumerate_regions(random_network(7, [2]), box(-np.ones(7), np.ones(7)))


def test_facets_on_the_domain_carry_its_row_numbers():
    rows = from_box(box([-1.0, -1.0], [0.5, 1.0]))
    A, b = rows.A, rows.b
    table = enumerate_regions(NET, box([-1.0, -1.0], [0.5, 1.0]))
    on_domain = table.facet_label < 0
    assert set(-1 - table.facet_label[on_domain]) == {0, 1, 2, 3}
    ends = table.points[table.boundaries[0][0].reshape(-1, 2)]
    for facet in np.flatnonzero(on_domain):
        row = -1 - table.facet_label[facet]
        np.testing.assert_allclose(ends[facet] @ A[row], b[row], atol=1e-15)


def test_numbers_that_would_overflow_are_refused_and_lesser_ones_are_not():
    assert enumerate_regions(NET, box([-1e30, -1e30], [1e30, 1e30])).count > 1
    with pytest.raises(InputError, match="sizes between"):
        enumerate_regions(NET, box([-1e60, -1.0], [1e60, 1.0]))
    huge = relu_network(
        [NET.weights[0] * 1e90, NET.weights[1]], [NET.biases[0] * 1e90, NET.biases[1]]
    )
    assert (
        enumerate_regions(huge, box([-1, -1], [1, 1])).count
        == enumerate_regions(NET, box([-1, -1], [1, 1])).count
    )
    with pytest.raises(InputError, match="Rescale"):
        enumerate_regions(
            relu_network([NET.weights[0] * 1e150, NET.weights[1]], NET.biases),
            box([-1, -1], [1, 1]),
        )
