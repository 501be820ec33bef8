"""The two stateful control laws. Both act, and update their memory, at every evaluation of the
right-hand side.

Four evaluations make one Runge-Kutta step, so the steering may move by four times STEER_STEP in
0.01 s, and the drive law alternates between two forces from stage to stage. Evaluating a law once
per step gives a different vehicle.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from sims.drift_parking import params as c
from sims.drift_parking.ilqr import Input
from sims.drift_parking.vehicle import Plant, State, rates

# At rest; V and ux disagree on purpose.
START = State(x=0.0, y=0.0, yaw=0.0, yaw_rate=0.0, speed=0.1, sideslip=0.0, ux=0.0, uy=0.0)


class Track(NamedTuple):
    """Memory of the pre-drift law: last steering [rad], last dV/dt [m/s^2], did the rear slide with
    positive slip.
    """

    steer: jax.Array
    speed_rate: jax.Array
    rear_slides: jax.Array


def track(plant: Plant, z: State, memory: Track, command: Input) -> tuple[State, Track]:
    """Pre-drift: follow the commanded acceleration and steering. Returns the state's rate and the
    new memory.
    """
    drive = _or_zero(2.0 * c.MASS * (command.accel - memory.speed_rate))
    drive = jnp.clip(drive, 0.0, c.DRIVE_MAX)
    steer = _or_zero(jnp.where(memory.rear_slides, memory.steer, command.steer))
    steer = _limited(steer, memory.steer)
    rate, slip = rates(plant, z, steer, drive=drive)
    speed_rate = jnp.where(jnp.isnan(rate.speed), memory.speed_rate, rate.speed)
    return rate, Track(steer, speed_rate, slip.rear > slip.threshold)


def brake(plant: Plant, z: State, last_steer) -> tuple[State, jax.Array]:
    """Drift: front brake fully on, steering follows the sideslip. Returns the state's rate and the
    applied steering.
    """
    steer = steer_into_slip(z, last_steer)
    return rates(plant, z, steer, brake=-c.BRAKE_MAX)[0], steer


def steer_into_slip(z: State, last_steer):
    """Steering of the braking law [rad]."""
    return _limited(_or_zero(z.sideslip), last_steer)


def after_start() -> tuple[State, Track]:
    """State at 0.01 s and law memory after step 0, the start from rest, in closed form.

    At stage 4 of step 0 the car has no forward speed and a lateral speed that is a rounding
    residue; its sign saturates both axles sideways. The outcome depends on that sign only, so the
    kick is prescribed: stages 2, 3 and 4 have the rates that the largest drive force causes, and
        stage 4 adds the lateral kick.
    """
    h, launch = c.STEP, c.DRIVE_MAX / c.MASS
    rear = (c.GRIP_REAR**2 - c.DRIVE_MAX**2) ** 0.5
    kick = -(c.GRIP_FRONT + rear) / c.MASS
    gained = h / 6.0 * (2.0 * launch + launch)
    state = START._replace(
        x=h / 6.0 * 2.0 * (0.5 * h * launch),
        yaw_rate=h / 6.0 * (-c.FRONT_ARM * c.GRIP_FRONT + c.REAR_ARM * rear) / c.YAW_INERTIA,
        speed=START.speed + gained,
        sideslip=h / 6.0 * kick / START.speed,
        ux=gained,
        uy=h / 6.0 * kick,
    )
    return state, Track(steer=0.0, speed_rate=launch, rear_slides=True)


def _limited(steer, last_steer):
    """Rate limit against the last evaluation, then the steering stop."""
    change = steer - last_steer
    steer = jnp.where(
        jnp.abs(change) > c.STEER_STEP, last_steer + jnp.sign(change) * c.STEER_STEP, steer
    )
    return jnp.clip(steer, -c.STEER_MAX, c.STEER_MAX)


def _or_zero(command):
    return jnp.where(jnp.isnan(command), 0.0, command)
