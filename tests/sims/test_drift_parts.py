"""The scene of drift parking, and what keeps its programs from being merged."""

import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.problem.body import Disc
from sims.drift_parking import scenario, trig


def test_scene():
    disc = scenario.problem()
    assert isinstance(disc.body, Disc) and disc.body.radius == pytest.approx(2.35369, abs=5e-6)
    inside = np.array([30.5, -16.0, -np.pi])
    assert disc.goal.contains(inside) and not disc.goal.contains(
        inside + np.array([0, 0, 2 * np.pi])
    )
    assert [bool(o.contains(np.array([25.0, -16.0]))) for o in disc.obstacles] == [True, False]
    with pytest.raises(InputError, match="disc"):
        scenario.problem("square")


def test_what_several_read_is_the_same_bits():
    x = np.random.default_rng(0).normal(size=256) * 10.0 ** np.arange(-128, 128)
    x[:2] = 0.0, np.nan
    np.testing.assert_array_equal(trig.once(x)[0], x)
