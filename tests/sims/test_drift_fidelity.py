"""Whole drift manoeuvres against three references: the plain transcription, stored runs, and the
original simulator's.

Up to 4.8 s every implementation agrees to rounding. After the stop the car creeps by centimetres in
a direction that is chaotic in the rounding, so that 0.06 m and 0.06 rad is all that can be asked of
the end.
"""

from pathlib import Path

import drift_oracle as oracle
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import sims
from parc_jax.common.errors import InputError
from sims.drift_parking import simulate
from sims.drift_parking.plant_ode import newton_euler
from sims.drift_parking.vehicle import State, Wrench

LANES = 16  # every test runs batches of this size: one compilation
SURE = 481  # samples up to 4.8 s
TIGHT, LOOSE = 1e-9, 0.06  # [m] and [rad]
STORED = Path(__file__).parent / "data" / "drift_small.npz"


def _runner(plant):
    """A function k (n, 2) -> (states (n, 781, 8), switch (n,), steer (n,)), compiled once."""
    compiled = jax.jit(lambda k: simulate.simulate(plant, k))

    def run(k):
        parts = []
        for i in range(0, len(k), LANES):
            part = np.resize(k[i : i + LANES], (LANES, 2))
            run = compiled(jnp.asarray(part.T))
            states = np.moveaxis(np.asarray(jnp.stack(run.states)), (0, 1, 2), (2, 1, 0))
            parts.append((states, np.asarray(run.switch), np.asarray(run.steer)))
        return tuple(np.concatenate(p)[: len(k)] for p in zip(*parts, strict=True))

    return run


@pytest.fixture(scope="module")
def ode():
    return _runner(newton_euler)


@pytest.fixture(scope="module")
def mjx():
    return _runner(sims.load("drift_parking", plant="mjx").plant)


def _agree(states, switch, path, yaw, switch_want):
    """Path (n, 781, 2), yaw (n, 781)."""
    np.testing.assert_array_equal(switch, switch_want)
    error = np.concatenate([states[..., :2] - path, (states[..., 2] - yaw)[..., None]], axis=-1)
    assert np.abs(error[:, :SURE]).max() < TIGHT
    assert np.abs(error).max() < LOOSE


@pytest.mark.night
def test_agrees_with_the_plain_transcription(ode, rng):
    k = rng.uniform([9, np.pi / 6], [11, 2 * np.pi / 9], (6, 2))
    k[:2] = (9, np.pi / 6), (11, 2 * np.pi / 9)
    states, switch, steer = ode(k)
    for i in range(len(k)):
        want = oracle.simulate(*k[i])
        path = want["states"][None]
        _agree(states[i : i + 1], switch[i : i + 1], path[..., :2], path[..., 2], want["switch"])
        assert np.abs(states[i, :SURE] - want["states"][:SURE]).max() < TIGHT  # all eight
        assert steer[i] == pytest.approx(want["steer"], abs=1e-12)


def _stored():
    with np.load(STORED) as data:
        return dict(data)


def _agree_with_stored(run):
    data = _stored()
    states, switch, _ = run(data["k"])
    np.testing.assert_array_equal(switch, data["switch"])
    error = np.abs(states[:, ::10, :3] - data["pose"])
    assert error[:, : SURE // 10 + 1].max() < TIGHT
    assert error.max() < LOOSE


@pytest.mark.slow
def test_agrees_with_stored_runs(ode):
    _agree_with_stored(ode)


@pytest.mark.night
def test_mujoco_body_agrees_with_stored_runs(mjx):
    _agree_with_stored(mjx)


def _agree_with_original(run, shared_data):
    with np.load(shared_data / "drift_reference.npz") as data:
        states, switch, _ = run(data["k"])
        _agree(states, switch, data["p"], data["theta"], data["n_switch"])
        assert np.abs(states[:10, :SURE] - data["z_states_first10"][:, :SURE]).max() < TIGHT


@pytest.mark.slow
def test_agrees_with_the_original_simulator(ode, shared_data):
    _agree_with_original(ode, shared_data)


@pytest.mark.night
def test_mujoco_body_agrees_with_the_original_simulator(mjx, shared_data):
    _agree_with_original(mjx, shared_data)


# k: switch, steering at the switch, final (x, y, yaw), rows of t, x, y, yaw, yaw rate, V, beta, ux,
#     uy
CHECKED = {
    (10.0, 0.6): (
        359,
        -0.536681752,
        (29.06, -12.00, -2.79),
        """
        0.02 0.000496579 0.000063794 -0.000031853 -0.006370664 0.124671891 -0.188335775 0.063985185
        -0.005224510 0.10 0.017803164 -0.000250612 0.000210876 0.003685751 0.242323216 0.114070491
        0.349986567 -0.012721897 2.00 8.376524748 0.181288495 0.113305009 0.401061580 8.643358157
        0.017488742 8.763909646 0.074729233 3.59 24.869219767 -5.211900717 -1.446837610 -1.615049418
        12.266619639 0.617507016 10.001274754 7.102426392 4.80 29.040893131 -11.989331469
        -2.759796947 -0.493071257 0.777425979 1.549006831 0.019175057 0.777973881
        """,
    ),
    (9.0, np.pi / 6): (
        346,
        -0.480642638,
        (23.39, -12.34, -2.49),
        """
        0.02 0.000478061 0.000071415 -0.000035658 -0.007131584 0.120936055 -0.213964505 0.060281153
        -0.003700327 0.10 0.014131827 0.000516345 -0.000405540 -0.007526689 0.305999718 -0.115465382
        0.272233793 0.016471521 2.00 7.067490769 0.144205620 0.087973656 0.214427937 7.684612492
        -0.005478476 7.692741740 0.040022830 3.46 20.337911352 -5.336220071 -1.442178420
        -1.693222517 11.688024310 0.534195962 10.059628691 5.950948065 4.80 23.427819579
        -12.302302759 -2.503061686 0.001772845 0.486853644 0.003031470 0.487055134 0.001455786
        """,
    ),
    (11.0, 2 * np.pi / 9): (
        354,
        -0.411129911,
        (33.22, -11.74, -3.24),
        """
        0.02 0.000515096 0.000052062 -0.000025997 -0.005199309 0.129084845 -0.170564990 0.067689326
        -0.007570935 0.10 0.019894181 -0.000202663 0.000169239 0.001168662 0.317910551 0.014320796
        0.407223823 -0.008792202 2.00 9.449455437 0.172010466 0.103931720 0.387244121 9.624056385
        0.006793913 9.716696945 0.036001738 3.54 27.124634188 -4.906194732 -1.474300523 -1.788359819
        13.205991493 0.717947114 9.946195310 8.687428283 4.80 32.839204892 -11.657178285
        -3.226171982 -0.313406902 1.462636810 2.773423868 -1.365579536 0.525328374
        """,
    ),
}


@pytest.mark.slow
def test_check_values_of_the_description(ode):
    states, switch, steer = ode(np.array(list(CHECKED)))
    for i, (switch_want, steer_want, final, table) in enumerate(CHECKED.values()):
        assert (switch[i], steer[i]) == (switch_want, pytest.approx(steer_want, abs=6e-10))
        rows = np.array(table.split(), float).reshape(-1, 9)
        samples = np.round(100 * rows[:, 0]).astype(int)
        np.testing.assert_allclose(states[i, samples], rows[:, 1:], atol=6e-10)
        np.testing.assert_allclose(states[i, -1, :3], final, atol=0.06)


@pytest.mark.slow
def test_no_switch_gives_nan(ode):
    states, switch, _ = ode(np.array([[10.0, 0.6], [10.0, 3.0]]))  # a sideslip that is never held
    assert list(switch) == [359, 0]
    assert np.isfinite(states[0]).all() and np.isnan(states[1]).all()


@pytest.mark.night
def test_mujoco_accelerations_are_those_of_the_closed_form(rng):
    state = State(*jnp.asarray(rng.normal(size=(8, 50)) * 5.0))
    wrench = Wrench(*jnp.asarray(rng.normal(size=(3, 50)) * 5000.0))
    cos, sin = jnp.cos(state.yaw), jnp.sin(state.yaw)
    plant = sims.load("drift_parking").plant  # MuJoCo is the default
    got = jax.jit(plant)(state, cos, sin, wrench)
    want = newton_euler(state, cos, sin, wrench)
    np.testing.assert_allclose(got, want, rtol=1e-12, atol=1e-12)


def test_bad_requests_are_refused():
    with pytest.raises(InputError, match="mjx"):
        sims.load("drift_parking", plant="bullet")
    with pytest.raises(InputError, match="float64"):
        sims.load("drift_parking", plant="ode").rollout(None, jnp.array([10.0, 0.6], jnp.float32))
