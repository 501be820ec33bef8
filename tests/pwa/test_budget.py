"""Caps end in a message that says which, how far it came, and what to do."""

import numpy as np
import pytest
from region_networks import random_network, unit_box

from parc_jax.common.errors import BudgetError
from parc_jax.proof.regions import complex, enumerate_regions
from parc_jax.proof.regions.storage import NUMBER

NET, DOMAIN = random_network(3, [12, 12], seed=1), unit_box(3)


@pytest.mark.parametrize(
    ("cap", "words"),
    [
        (
            {"max_regions": 50},
            r"max_regions = 50 regions, with \d+ of 30 hyperplanes cut, \d+ regions",
        ),
        ({"max_bytes": 100_000}, r"max_bytes = 100000"),
    ],
)
def test_caps(cap, words):
    with pytest.raises(BudgetError, match=words) as caught:
        enumerate_regions(NET, DOMAIN, **cap)
    assert "raise the cap" in str(caught.value)


def test_more_faces_than_can_be_counted(monkeypatch):
    assert 3 * complex.MAX_FACES < np.iinfo(NUMBER).max
    monkeypatch.setattr(complex, "MAX_FACES", 1000)
    with pytest.raises(BudgetError, match="1000 faces of one dimension"):
        enumerate_regions(NET, DOMAIN)
