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
        ({"max_seconds": 0.0}, r"max_seconds = 0 s"),
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


def test_caps_do_not_change_the_result():
    free = enumerate_regions(NET, DOMAIN)
    held = enumerate_regions(
        NET, DOMAIN, max_regions=free.count, max_seconds=60.0, max_bytes=1 << 30
    )
    assert held.count == free.count and (held.patterns == free.patterns).all()


def test_time_is_also_watched_between_exact_evaluations():
    slow = random_network(2, [6, 6], integer=1, bias=False)
    with pytest.raises(BudgetError, match="max_seconds"):
        enumerate_regions(slow, unit_box(2), max_seconds=1e-9)
