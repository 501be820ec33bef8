"""Reference plan: accelerate straight, flick left, then turn right at the yaw rate of a steady drift."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp

from sims.drift_parking import params as c

RAMP = 18  # plan steps of straight acceleration: ceil((11 - 2 - 0.1) / (5 T)), whatever v is
LENGTH = 59  # plan entries; the last state and input are repeated for look-ahead
LOOK_AHEAD = 5
SPEED_START = 0.1  # [m/s]
RAMP_MARGIN = 2.0  # the ramp ends at v - 2 [m/s]
TURN_ACCEL = 5.0  # [m/s^2]
FLICK = -3.0  # the first turning step aims at minus three times the drift yaw rate
DRIFT_SIDESLIP = math.radians(15.0)

_ARM_RATIO = c.WHEELBASE / (c.FRONT_ARM - c.REAR_ARM)
_DRIFT_STEER = math.pi - math.atan(math.tan(DRIFT_SIDESLIP) * _ARM_RATIO)
# Yaw rate times speed of the steady drift with both axles sliding and steering beyond 90 degrees [m/s^2].
DRIFT_ACCEL = (
    c.FRICTION
    * c.GRAVITY
    / c.WHEELBASE
    * (
        c.REAR_ARM * math.cos(_DRIFT_STEER - DRIFT_SIDESLIP)
        + c.FRONT_ARM * math.cos(_DRIFT_STEER + DRIFT_SIDESLIP)
    )
)


class Plan(NamedTuple):
    """Targets at plan times 0.1 i; each field (LENGTH + LOOK_AHEAD,).

    x, y [m], yaw [rad], speed [m/s]; accel [m/s^2], steer [rad].
    """

    x: jax.Array
    y: jax.Array
    yaw: jax.Array
    speed: jax.Array
    accel: jax.Array
    steer: jax.Array


def reference_plan(v) -> Plan:
    """Plan for the speed parameter v [m/s]: the kinematic car rolled out under ramp, flick and turn."""
    index = jnp.arange(LENGTH)
    straight = index < RAMP
    accel = jnp.where(straight, (v - RAMP_MARGIN - SPEED_START) / (RAMP * c.PLAN_STEP), TURN_ACCEL)
    speed = _rolled(SPEED_START, c.PLAN_STEP * accel)
    gain = jnp.where(index == RAMP + 1, FLICK, 1.0)
    steer = jnp.arctan2(gain * (DRIFT_ACCEL / v * c.WHEELBASE), jnp.roll(speed, 1))  # speed one step earlier
    steer = jnp.where(index <= RAMP, 0.0, jnp.clip(steer, -c.STEER_MAX, c.STEER_MAX))
    yaw = _rolled(0.0, c.PLAN_STEP * speed * jnp.tan(steer) / c.WHEELBASE)
    x = _rolled(0.0, c.PLAN_STEP * speed * jnp.cos(yaw))
    y = _rolled(0.0, c.PLAN_STEP * speed * jnp.sin(yaw))
    return Plan(*(jnp.concatenate([a, jnp.broadcast_to(a[-1:], (LOOK_AHEAD,))]) for a in (x, y, yaw, speed, accel, steer)))


def _rolled(start, increments):
    """Euler sum: entry 0 is the start, entry i + 1 adds increment i."""
    return start + jnp.concatenate([jnp.zeros_like(increments[:1]), jnp.cumsum(increments[:-1])])
