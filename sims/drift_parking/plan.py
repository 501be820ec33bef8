"""Reference plan: accelerate straight, flick left, then turn right at the yaw rate of a steady
drift.
"""

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
# Yaw rate times speed of the steady drift with both axles sliding and steering beyond 90 degrees
# [m/s^2].
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
    """Targets at plan times 0.1 i; each field (LENGTH + LOOK_AHEAD, *lanes).

    x, y [m], yaw [rad], speed [m/s]; accel [m/s^2], steer [rad].
    """

    x: jax.Array
    y: jax.Array
    yaw: jax.Array
    speed: jax.Array
    accel: jax.Array
    steer: jax.Array


def reference_plan(v) -> Plan:
    """Plan for speed parameters v (*lanes) [m/s]: the kinematic car rolled out under ramp, flick
    and turn.
    """
    v = jnp.expand_dims(v, 0)
    index = jnp.arange(LENGTH).reshape(-1, *(1,) * (v.ndim - 1))
    accel = jnp.where(
        index < RAMP, (v - RAMP_MARGIN - SPEED_START) / (RAMP * c.PLAN_STEP), TURN_ACCEL
    )
    speed = SPEED_START + _rolled(accel)
    turn = jnp.where(index == RAMP + 1, FLICK, 1.0) * (DRIFT_ACCEL * c.WHEELBASE) / v
    steer = jnp.clip(
        jnp.arctan2(turn, jnp.roll(speed, 1, axis=0)), -c.STEER_MAX, c.STEER_MAX
    )  # speed one step earlier
    steer = jnp.where(index > RAMP, steer, 0.0)
    yaw = _rolled(speed * jnp.tan(steer) / c.WHEELBASE)
    x, y = _rolled(speed * jnp.cos(yaw)), _rolled(speed * jnp.sin(yaw))
    return Plan(
        *(jnp.concatenate([a, *[a[-1:]] * LOOK_AHEAD]) for a in (x, y, yaw, speed, accel, steer))
    )


def _rolled(rate):
    """Euler sum along the plan: entry 0 is zero, entry i + 1 adds T times rate i."""
    return c.PLAN_STEP * jnp.concatenate([jnp.zeros_like(rate[:1]), jnp.cumsum(rate[:-1], axis=0)])
