"""The pilot: along a line at a speed, a roll in which thrust still holds the drone across the slot,
and back to hovering on the line. It knows the state, and learns from it what pulls at the drone.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sims.foreign.slot import params as c

AHEAD = np.array([1.0, 0.0, 0.0])
ALONG = np.array([0.0, math.cos(c.INCLINE), math.sin(c.INCLINE)])  # the direction of the slot
ACROSS = np.array([0.0, -math.sin(c.INCLINE), math.cos(c.INCLINE)])  # the normal of it
FRAME = np.array([AHEAD, ALONG, ACROSS])  # from the world, z upward, to the slot
DOWN = np.array([0.0, 0.0, -c.GRAVITY])


class Flight(NamedTuple):
    """What the pilot sees: place (3,) [m] from the start, velocity (3,) [m/s], up (3,), the unit
    vector in which the rotors push, push [m/s^2], by how much they do.
    """

    place: jax.Array
    velocity: jax.Array
    up: jax.Array
    push: jax.Array


def way(t, speed):
    """Place, speed and acceleration along x (3,) of a smooth start, at a time t [s]."""
    share = jnp.clip(t / c.SPEED_UP, 0.0, 1.0)
    late = jnp.maximum(t - c.SPEED_UP, 0.0)
    place = c.SPEED_UP * (share**3 - 0.5 * share**4) + late
    return speed * jnp.stack(
        [place, 3 * share**2 - 2 * share**3, 6 * share * (1 - share) / c.SPEED_UP]
    )


def command(seen: Flight, pull, t, k):
    """Roll, pitch [rad], thrust [m/s^2] at time t for k = (speed, bank, shift); pull (3,) [m/s^2]
    is what the pilot believes to disturb it.
    """
    speed, bank, shift = k
    begin = c.ROLL_AT + shift
    rolls = (t >= begin) & (t < begin + c.ROLL_FOR)
    behind = t >= begin + c.ROLL_FOR
    hover = jnp.stack([way(c.ROLL_AT, speed)[0] + c.STOP_AFTER, 0.0, 0.0])
    ahead = jnp.where(behind, hover, way(t, speed))
    along = jnp.array([1.0, 0.0, 0.0])
    off = ahead[0] * along - seen.place
    slow = ahead[1] * along - seen.velocity
    asked = ahead[2] * along + c.STIFFNESS * off + c.DAMPING * slow - pull
    force = jnp.clip(asked, -c.MOST, c.MOST) - DOWN
    tilt = force / jnp.sqrt(force @ force)
    roll = jnp.where(rolls, bank, -jnp.arcsin(tilt[1]))
    pitch = jnp.where(rolls, 0.0, jnp.arctan2(tilt[0], tilt[2]))
    hold = c.ACROSS_STIFFNESS * off + c.ACROSS_DAMPING * slow - pull
    thrust = jnp.where(rolls, c.GRAVITY * seen.up[2] + ACROSS @ hold, force @ seen.up)
    return roll, pitch, jnp.maximum(thrust, c.LEAST_THRUST * c.GRAVITY)


def learned(memory, seen: Flight):
    """What the pilot believes to pull (3,) [m/s^2], and its memory (3,) for the next time: the part
    of the velocity that push and weight do not explain, at the rate of OBSERVER.
    """
    pull = memory + c.OBSERVER * seen.velocity
    explained = seen.push * seen.up + DOWN + pull
    return pull, memory - c.STEP * c.OBSERVER * explained
