"""The physics step against a plain NumPy transcription of the equations, and the two plants against
each other.
"""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

from sims.asv.disturbance import LAWS, draw_disturbance
from sims.asv.dynamics import apply_command
from sims.asv.plant import make_plant
from sims.asv.vessel import SYSID, at_rest

KEYS = drawn_keys(7, 8)


def textbook(d, heading, commands, n_physics):
    """p and yaw after each command, by the planar equations of motion, one number at a time."""
    left = [-3.8, -3.8, -3.6, -3.6, -1.6, *[0] * 10, 4, 10, 15, 21, 23, 22]
    right = [-5, -5, -5, -4.6, -2.2, *[0] * 10, 4.6, 10, 17, 24, 24, 23]
    grid, off = np.linspace(-1, 1, 21), 0.02942
    x, y, psi = -off * math.cos(heading), -off * math.sin(heading), float(heading)
    vx = vy = r = fl = fr = 0.0
    linear = np.array([0, 99.99, 0.82985084]) * d.linear_drag_factor
    quadratic = np.array([17.257603, 99.99, 17.33600724]) * d.quadratic_drag_factor
    keep, rows = math.exp(-0.02 / 0.05), []
    for a_left, a_right in commands:
        for _ in range(n_physics):
            fl = keep * fl + (1 - keep) * d.thrust_gain * np.interp(a_left, grid, left)
            fr = keep * fr + (1 - keep) * d.thrust_gain * np.interp(a_right, grid, right)
            c, s = math.cos(psi), math.sin(psi)
            u, v, hx, hy = c * vx + s * vy, -s * vx + c * vy, x + off * c, y + off * s
            fx = d.force[0] + d.wave_force * math.sin(d.wave_number[0] * hx + d.wave_phase[0])
            fy = d.force[1] + d.wave_force * math.sin(d.wave_number[1] * hy + d.wave_phase[1])
            tau = d.torque + d.wave_torque * math.sin(
                d.torque_wave_number * (hx + hy) + d.torque_wave_phase
            )
            X = fl + fr - (linear[0] + quadratic[0] * abs(u)) * u + fx
            Y = -(linear[1] + quadratic[1] * abs(v)) * v + fy
            N = 0.377654 * (fr - fl) - (linear[2] + quadratic[2] * abs(r)) * r + tau
            vx, vy = vx + 0.02 * (c * X - s * Y) / d.mass, vy + 0.02 * (s * X + c * Y) / d.mass
            r += 0.02 * N / 8.061
            x, y, psi = x + 0.02 * vx, y + 0.02 * vy, psi + 0.02 * r
        rows.append((x + off * math.cos(psi), y + off * math.sin(psi), psi))
    return np.array(rows)


def ours(plant, d, heading, commands, n_physics):
    def one(state, command):
        state, hull = apply_command(SYSID, plant, LAWS["full"], d, state, command, n_physics)
        return state, hull[-1]

    return jax.lax.scan(one, at_rest(SYSID, heading), commands)[1]


@functools.partial(jax.jit, static_argnames="name")
def batch(name, ds, headings, commands):
    return jax.vmap(functools.partial(ours, make_plant(name, SYSID), n_physics=10))(
        ds, headings, commands
    )


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(3)
    ds = jax.vmap(lambda key: draw_disturbance(key, LAWS["full"], SYSID.mass))(KEYS)
    return ds, jnp.asarray(rng.uniform(-3, 3, 8)), jnp.asarray(rng.uniform(-1, 1, (8, 30, 2)))


@pytest.mark.slow
def test_twin_is_the_textbook(case):
    p = np.asarray(batch("ode", *case))
    for i in range(8):
        d = jax.tree.map(lambda leaf, i=i: np.asarray(leaf[i]), case[0])
        np.testing.assert_allclose(
            p[i], textbook(d, float(case[1][i]), np.asarray(case[2][i]), 10), atol=1e-11
        )


@pytest.mark.smoke
@pytest.mark.night
def test_mjx_is_the_twin_in_open_loop(case):
    np.testing.assert_allclose(
        np.asarray(batch("mjx", *case)), np.asarray(batch("ode", *case)), atol=1e-11
    )


def test_unknown_plant_says_what_there_is():
    with pytest.raises(ValueError, match="expected 'mjx' or 'ode'; got 'rk4'"):
        make_plant("rk4", SYSID)
