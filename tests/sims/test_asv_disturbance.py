"""The laws: what is drawn, how far it reaches, and that a key decides everything."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

from sims.asv.control import draw_noise
from sims.asv.disturbance import LAWS, body_load, draw_disturbance, named_law
from sims.asv.vessel import SYSID

pytestmark = pytest.mark.slow

KEYS = drawn_keys(11, 20_000)


def within(values, lo, hi):
    """All inside [lo, hi], and 20,000 uniform draws come within 1 % of both ends."""
    width, values = hi - lo, np.asarray(values)
    assert values.min() >= lo
    assert values.max() <= hi
    assert values.min() < lo + 0.01 * width
    assert values.max() > hi - 0.01 * width


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "force", "torque", "wave", "drag"),
    [("study", 0.5, 0.1, 0, 0), ("full", 1.76777, 1, 1, 0.1)],
)
def test_draws_fill_the_stated_ranges(name, force, torque, wave, drag):
    d = jax.vmap(lambda key: draw_disturbance(key, LAWS[name], SYSID.mass))(KEYS)
    within(d.mass, 34.96, 36.96)
    within(d.thrust_gain, 0.5, 1.5)
    within(jnp.linalg.norm(d.force, axis=1), 0.0, force + 1e-5)
    within(jnp.arctan2(d.force[:, 1], d.force[:, 0]), -np.pi, np.pi)
    within(d.torque, -torque, torque)
    if wave:
        within(d.wave_force, 0.0, force + 1e-5)
        within(d.wave_torque, 0.0, 1.0)
        within(d.wave_number, 0.25, 3.0)
        within(d.wave_phase, 0.0, 100.0)
        within(d.linear_drag_factor, 1 - drag, 1 + drag)
        within(d.quadratic_drag_factor, 1 - drag, 1 + drag)
    else:
        assert not np.asarray(d.wave_force).any()
        assert (np.asarray(d.linear_drag_factor) == 1).all()


def test_noise_has_the_stated_half_widths():
    noise = np.asarray(jax.vmap(lambda key: draw_noise(key, LAWS["full"], float))(KEYS))
    for column, half_width in zip(
        noise.T, (0.03, 0.03, 0.025, 0.03, 0.03, 0.03, 0.05, 0.05), strict=True
    ):
        within(column, -half_width, half_width)


def test_waves_are_skipped_only_where_the_law_has_none():
    d = draw_disturbance(KEYS[0], LAWS["full"], SYSID.mass)
    here, there = jnp.zeros(2), jnp.array([1.0, -0.5])
    assert not np.allclose(
        body_load(LAWS["full"], d, here)[0], body_load(LAWS["full"], d, there)[0]
    )
    assert np.array_equal(body_load(LAWS["study"], d, here)[0], d.force)
    silent = dataclasses.replace(LAWS["full"], wave_force=0.0)  # the torque's waves alone still act
    assert float(body_load(silent, d, here)[1]) != float(d.torque)


def test_unknown_law_says_what_there_is():
    with pytest.raises(ValueError, match="expected one of none, study, full; got 'storm'"):
        named_law("storm")
