"""The tractor and its driver: drive, turn by an angle, stop."""

from pathlib import Path

import jax
import jax.numpy as jnp

from parc_jax.common.sets.box import box
from parc_jax.learning.system import time_grid
from sims.mjx_system import MJXSystem, mjx_system
from sims.tractor import params as c

XML = Path(__file__).with_name("tractor.xml")
SIDES = ("front left", "rear left", "rear right", "front right")
TRACTOR = tuple(f"tractor {side}" for side in SIDES)
TRAILER = tuple(f"trailer {side}" for side in SIDES)
POINTS = ("rear axle", *TRACTOR, *TRAILER)


def system() -> MJXSystem:
    """k = (way before the turn [m], angle of the turn [rad]); p (161, 9, 2) of POINTS. The angle of
    the trailer at the start and the slope of the ground are drawn from the key.
    """
    lo, hi = zip(c.BEFORE_TURN, c.TURN, strict=True)
    return mjx_system(
        XML,
        drive,
        box(lo, hi),
        time_grid(c.PLAN_STEP, c.T_FINAL, c.STEP),
        start=some_start,
        points=POINTS,
        name="tractor",
        k_labels=("way before the turn [m]", "turn [rad]"),
    )


def some_start(key, k, data):
    """The start of a run: a trailer not quite straight, and a slope that pulls sideways."""
    del k
    hitch, *pull = jax.random.uniform(key, (3,), data.qpos.dtype, -1.0, 1.0)
    forces = data.qfrc_applied.at[:2].set(c.SLOPE * jnp.stack(pull))
    return data.replace(qpos=data.qpos.at[4].set(c.HITCH_ANGLE * hitch), qfrc_applied=forces)


def drive(qpos, qvel, time, k):
    """Controls (drive [N], sideways forces of three axles [N], steering [rad]) at a state."""
    heading, steering, hitch = qpos[2], qpos[3], qpos[4]
    along, across = _rotated(qvel[:2], -heading)
    turning = jnp.clip(c.TURN_RATE * (time - k[0] / c.SPEED), 0.0, k[1])
    asked = c.HEADING_GAIN * (turning - heading)
    steer = jnp.arctan(c.WHEELBASE * asked / c.SPEED)
    speed = jnp.clip(jnp.minimum(c.LAUNCH * time, c.BRAKE * (c.STOP_AT - time)), 0.0, c.SPEED)
    front = _rotated(jnp.stack([along, across + c.WHEELBASE * qvel[2]]), -steering)
    pulled = _rotated(jnp.stack([along, across - c.HITCH * qvel[2]]), -hitch)
    slips = jnp.stack([across, front[1], pulled[1] - c.DRAWBAR * (qvel[2] + qvel[4])])
    sideways = -c.GRIP * jnp.tanh(slips / c.SLIP)
    limited = jnp.clip(steer, -c.STEER_LIMIT, c.STEER_LIMIT)
    ends = jnp.stack([c.SPEED_GAIN * (speed - along), limited])
    return jnp.concatenate([ends[:1], sideways, ends[1:]])


def _rotated(v, angle):
    """v (2,) turned by an angle [rad]."""
    cos, sin = jnp.cos(angle), jnp.sin(angle)
    return jnp.stack([cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]])
