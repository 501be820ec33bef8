"""From a command to a motion: thruster lag, drag and disturbance act on the body, one physics step
at a time.
"""

import math

import jax
import jax.numpy as jnp

from sims.asv.disturbance import Disturbance, Law, body_load
from sims.asv.plant import Plant
from sims.asv.vessel import (
    PHYSICS_DT,
    Vessel,
    VesselState,
    hull_pose,
    hull_position,
    steady_thrust,
)


def world_load(vessel: Vessel, law: Law, d: Disturbance, state: VesselState) -> jax.Array:
    """Force (2) [N] in world axes and yaw torque [N m], stacked (3,): thrust, drag and disturbance
    at `state`.
    """
    cos, sin = jnp.cos(state.pose[2]), jnp.sin(state.pose[2])
    vx, vy, r = state.velocity
    body_velocity = jnp.stack([cos * vx + sin * vy, cos * vy - sin * vx, r])
    linear = vessel.linear_drag.astype(r.dtype) * d.linear_drag_factor
    quadratic = vessel.quadratic_drag.astype(r.dtype) * d.quadratic_drag_factor
    surge, sway, yaw = -(linear + quadratic * jnp.abs(body_velocity)) * body_velocity
    left, right = state.thrust
    force, torque = body_load(law, d, hull_position(vessel, state))
    surge, sway = surge + left + right + force[0], sway + force[1]
    yaw = yaw + vessel.thruster_arm * (right - left) + torque
    return jnp.stack([cos * surge - sin * sway, sin * surge + cos * sway, yaw])


def apply_command(
    vessel: Vessel,
    plant: Plant,
    law: Law,
    d: Disturbance,
    state: VesselState,
    command: jax.Array,
    n_physics: int,
) -> tuple[VesselState, jax.Array]:
    """Hold `command` (2,) in [-1, 1] for n_physics steps. Returns the state and the hull's pose
    (n_physics, 3) after each step.
    """
    target = d.thrust_gain * steady_thrust(vessel, command)
    keep = math.exp(-PHYSICS_DT / vessel.thruster_lag)

    def physics_step(state, _):
        # the thrust of the end of the step acts over the whole step, as in the identified model
        state = state.replace(thrust=keep * state.thrust + (1.0 - keep) * target)
        pose, velocity = plant(
            state.pose, state.velocity, world_load(vessel, law, d, state), d.mass
        )
        state = state.replace(pose=pose, velocity=velocity)
        return state, hull_pose(vessel, state)

    return jax.lax.scan(physics_step, state, None, length=n_physics)
