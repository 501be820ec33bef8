"""The car as a black box: the same everywhere, calm without disturbance, disturbed as declared."""

import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims
from parc_jax.common.errors import InputError
from sims.f110 import params as c
from sims.f110.disturbance import LAWS, draw

pytestmark = pytest.mark.slow  # runs of its own: of the gate

KEYS = drawn_keys(5, 24)
CORNERS = [(y, v) for y in c.LINE_RANGE for v in c.SPEED_RANGE]


@pytest.fixture(scope="module")
def system():
    return sims.load("f110", threads=2)


@pytest.fixture(scope="module")
def ks(system):
    lo, hi = np.asarray(system.domain.lo), np.asarray(system.domain.hi)
    return np.concatenate([CORNERS, lo + (hi - lo) * np.random.default_rng(2).random((20, 2))])


@pytest.fixture(scope="module")
def run(system, ks):
    return system.run(KEYS, ks)


def test_without_disturbance_the_key_does_not_matter(ks):
    quiet = sims.load("f110", law="none")
    a, b = (quiet.run(keys, ks[:3]).measured for keys in (KEYS[:3], KEYS[3:6]))
    np.testing.assert_array_equal(a, b)
    with pytest.raises(InputError, match="floor, none"):
        sims.load("f110", law="ice")


def test_the_same_run_elsewhere(system, ks, run):
    """Up to the rounding of larger coordinates, which a slide of two seconds amplifies."""
    moved = system.run(KEYS[:4], ks[:4], origin=(37.0, -11.0))
    np.testing.assert_allclose(
        moved.pose[:, :, :2] - [37.0, -11.0], run.pose[:4, :, :2], rtol=0, atol=1e-6
    )
    np.testing.assert_allclose(moved.pose[:, :, 2], run.pose[:4, :, 2], rtol=0, atol=1e-6)


def test_draws_keep_inside_the_declared_law():
    law = LAWS["floor"]
    drawn = draw(law, drawn_keys(0, 500), 2)
    for name in ("friction", "motor", "battery", "mass", "steering", "latency"):
        lo, hi = getattr(law, name)
        values = getattr(drawn, name)
        assert values.min() >= lo and values.max() <= hi and np.ptp(values) > 0.95 * (hi - lo)
    assert drawn.patches.shape == (500, law.patches, 4)
    assert np.abs(drawn.noise).max(axis=(0, 1)) == pytest.approx([0.0017, 0.0017, 0.0068], rel=0.4)
