"""Fiala brush tyre with a smooth stitch between the adhesive cubic and full sliding."""

import jax.numpy as jnp

SHARPNESS = 200.0  # of the stitch: 1/2 - 1/2 tanh(100 u) = 1 / (1 + exp(200 u)) [1/rad]
SLIP_CAP = 3.0  # [rad]; beyond it exp(200 u) would overflow, and the stitch has long saturated
TAN_CAP = 1e20  # keeps the cubic finite where a wheel slides exactly sideways; its weight there is below 1e-100


def lateral_capacity(limit, force_x):
    """Lateral force left [N] when the longitudinal force takes its share of the friction circle."""
    return jnp.sqrt(limit * limit - force_x * force_x)


def sliding_threshold(capacity, stiffness):
    """Slip angle [rad] beyond which the tyre slides."""
    return jnp.arctan(3.0 * capacity / stiffness)


def lateral_force(slip, tan_slip, capacity, threshold, stiffness):
    """Lateral force [N] at a slip angle [rad] whose tangent is given as well (rational in the velocities, so no tan)."""
    tan_slip = jnp.clip(tan_slip, -TAN_CAP, TAN_CAP)
    ratio = stiffness / (3.0 * capacity) * tan_slip
    cubic = -stiffness * tan_slip * (1.0 - jnp.abs(ratio) + ratio * ratio / 3.0)
    # The logistic form of the stitch decays to zero instead of cancelling, so no exact saturation of tanh is needed.
    rise = jnp.exp(SHARPNESS * jnp.clip(slip, -SLIP_CAP, SLIP_CAP))
    shift = jnp.exp(SHARPNESS * threshold)
    below_lower = 1.0 / (1.0 + rise * shift)
    below_upper = 1.0 / (1.0 + rise / shift)
    middle = below_lower * capacity + (1.0 - below_lower) * cubic
    return below_upper * middle - (1.0 - below_upper) * capacity
