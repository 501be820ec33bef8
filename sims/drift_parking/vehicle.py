"""Eight-state planar car: tyre and brake forces, and the rates that follow from a plant's
accelerations.

V, beta and ux, uy are two copies of the velocity, each integrated by its own equation and never
re-synchronised within
a phase: the tyres and the path use ux, uy; the control laws use V, beta.
"""

from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp

from sims.drift_parking import params as c
from sims.drift_parking import trig, tyre

TINY = 1e-300  # [m^2/s^2]


class State(NamedTuple):
    """x, y [m], yaw [rad], yaw_rate [rad/s], speed V [m/s], sideslip beta [rad], body-frame
    velocity ux, uy [m/s].
    """

    x: jax.Array
    y: jax.Array
    yaw: jax.Array
    yaw_rate: jax.Array
    speed: jax.Array
    sideslip: jax.Array
    ux: jax.Array
    uy: jax.Array


class Wrench(NamedTuple):
    """Sum of the tyre forces in body axes [N] and their moment about the centre of mass [N m]."""

    fx: jax.Array
    fy: jax.Array
    moment: jax.Array


class Plant(Protocol):
    """Turns a body-frame wrench at a state into body-frame accelerations of the centre of mass and
    yaw acceleration.
    """

    def __call__(
        self, z: State, cos_yaw, sin_yaw, wrench: Wrench
    ) -> tuple[jax.Array, jax.Array, jax.Array]: ...


class Slip(NamedTuple):
    """Rear slip angle and the angle beyond which the rear tyre slides [rad]; the pre-drift law
    remembers them.
    """

    rear: jax.Array
    threshold: jax.Array


def rates(plant: Plant, z: State, steer, drive=0.0, brake: float = 0.0) -> tuple[State, Slip]:
    """Time derivative of the state under steering [rad], rear drive [N] and front brake command [N,
    <= 0].
    """
    sin_steer, cos_steer = trig.once(*trig.sincos(steer))
    vy_front, vy_rear = z.uy + c.FRONT_ARM * z.yaw_rate, z.uy - c.REAR_ARM * z.yaw_rate
    # Velocity of the front wheel along and across its plane: tan and cos of the slip angle without
    # calling them.
    rolling, sliding = (
        z.ux * cos_steer + vy_front * sin_steer,
        vy_front * cos_steer - z.ux * sin_steer,
    )
    course, slip_rear = trig.once(trig.arctan2(vy_front, z.ux), trig.arctan2(vy_rear, z.ux))
    slip_front = course - steer
    fx_front = 0.0
    if (
        brake
    ):  # scaled by the squared cosine of the slip angle, faded through zero with the rolling speed
        along = rolling * rolling
        fx_front = brake * jnp.tanh(5.0 * rolling) * along / (along + sliding * sliding + TINY)

    capacity_front = tyre.lateral_capacity(c.GRIP_FRONT, fx_front)
    capacity_rear = tyre.lateral_capacity(c.GRIP_REAR, drive)
    threshold_front = tyre.sliding_threshold(capacity_front, c.STIFFNESS_FRONT)
    threshold_rear = tyre.sliding_threshold(capacity_rear, c.STIFFNESS_REAR)
    fy_front = tyre.lateral_force(
        slip_front, sliding / rolling, capacity_front, threshold_front, c.STIFFNESS_FRONT
    )
    fy_rear = tyre.lateral_force(
        slip_rear, vy_rear / z.ux, capacity_rear, threshold_rear, c.STIFFNESS_REAR
    )

    lateral_front = fy_front * cos_steer + fx_front * sin_steer
    wrench = Wrench(
        *trig.once(
            drive - fy_front * sin_steer + fx_front * cos_steer,
            lateral_front + fy_rear,
            c.FRONT_ARM * lateral_front - c.REAR_ARM * fy_rear,
        )
    )
    sin_yaw, cos_yaw = trig.once(*trig.sincos(z.yaw))
    ax, ay, yaw_acceleration = trig.once(*plant(z, cos_yaw, sin_yaw, wrench))
    sin_slip, cos_slip = trig.once(*trig.sincos(z.sideslip))
    rate = State(
        x=z.ux * cos_yaw - z.uy * sin_yaw,
        y=z.ux * sin_yaw + z.uy * cos_yaw,
        yaw=z.yaw_rate,
        yaw_rate=yaw_acceleration,
        speed=ax * cos_slip + ay * sin_slip,
        sideslip=(ay * cos_slip - ax * sin_slip) / z.speed - z.yaw_rate,
        ux=ax + z.yaw_rate * z.uy,
        uy=ay - z.yaw_rate * z.ux,
    )
    return rate, Slip(slip_rear, threshold_rear)
