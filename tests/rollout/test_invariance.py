"""Translation invariance is measured, and its absence is reported with its size."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import noisy, plant

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.start_gap import translation_gap
from parc_jax.learning.system import Trajectory

STARTS = np.array([[1.0, 2.0], [-30.0, 4.0], [0.0, 0.0]])


class Slope:
    """A plant on a hill: the run drifts by `tilt` times the start's first coordinate."""

    def __init__(self, tilt):
        base = plant(noisy)
        self.name, self.domain, self.time, self.n_p, self.n_q, self.tilt = (
            "slope",
            base.domain,
            base.time,
            2,
            1,
            tilt,
        )
        self.rollout = base.rollout

    def rollout_from(self, key, k, p0):
        p, q = self.rollout(key, k)
        s = jnp.linspace(0.0, 1.0, len(p))[:, None]
        return Trajectory((p0[None] + p + self.tilt * p0[0] * s) - p0[None], q)


def test_the_gap_of_an_invariant_plant_is_rounding():
    gap = translation_gap(Slope(0.0), jax.random.PRNGKey(0), STARTS)
    assert gap.p.max() < 1e-13 and gap.q.max() == 0


def test_a_violation_is_reported_with_its_size():
    gap = translation_gap(Slope(0.01), jax.random.PRNGKey(0), STARTS)
    np.testing.assert_allclose(gap.p, [0.3, 0.3], atol=1e-12)


def test_a_system_without_rollout_from_is_told_what_to_offer():
    with pytest.raises(InputError, match="rollout_from"):
        translation_gap(plant(noisy), jax.random.PRNGKey(0), STARTS)
