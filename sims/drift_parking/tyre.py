"""Fiala brush tyre with a smooth stitch between the adhesive cubic and full sliding."""

import jax.numpy as jnp

from sims.drift_parking import trig

SHARPNESS = 200.0  # of the stitch: 1/2 - 1/2 tanh(100 u) = 1 / (1 + exp(200 u)) [1/rad]
SLIP_CAP = 1.2  # [rad]; far beyond any threshold (0.26), where the stitch has saturated
# keeps the cubic finite where a wheel slides exactly sideways; its weight there is below 1e-80
TAN_CAP = 1e8


def lateral_capacity(limit, force_x):
    """Lateral force left [N] when the longitudinal force takes its share of the friction circle."""
    return jnp.sqrt(limit * limit - force_x * force_x)


def sliding_threshold(capacity, stiffness):
    """Slip angle [rad] beyond which the tyre slides."""
    return trig.arctan_small(3.0 / stiffness * capacity)


def lateral_force(slip, tan_slip, capacity, threshold, stiffness):
    """Lateral force [N] at a slip angle [rad], given with its tangent, which is rational in the
    velocities.

    With F the capacity and stitch weights s1 = 1 / (1 + lower), s2 = 1 / (1 + upper) this is s2 (s1
    F + (1 - s1) cubic)
    - (1 - s2) F written as one fraction. Logistic weights decay to zero where a difference of tanh
    would leave a rounding residue, so nothing has to saturate exactly.
    """
    tan_slip = jnp.clip(tan_slip, -TAN_CAP, TAN_CAP)
    ratio = stiffness / (3.0 * capacity) * tan_slip
    cubic = -stiffness * tan_slip * (1.0 - jnp.abs(ratio) + ratio * ratio / 3.0)
    slip = SHARPNESS * jnp.clip(slip, -SLIP_CAP, SLIP_CAP)
    lower, upper = jnp.exp(slip + SHARPNESS * threshold), jnp.exp(slip - SHARPNESS * threshold)
    return (capacity + lower * cubic - capacity * upper * (1.0 + lower)) / (
        (1.0 + lower) * (1.0 + upper)
    )
