"""The control loop: measure, decide, command, move. One run from rest with all randomness from one
key.
"""

import jax
import jax.numpy as jnp

from sims.asv.disturbance import Disturbance, Law, draw_disturbance
from sims.asv.dynamics import apply_command
from sims.asv.plant import Plant
from sims.asv.policy import Policy, act, observe
from sims.asv.vessel import Vessel, VesselState, at_rest, hull_position


def draw_noise(key: jax.Array, law: Law, dtype) -> jax.Array:
    """Noise (8,) of one control step: position 2 [m], yaw [rad], velocity 2 [m/s], yaw rate
    [rad/s], command 2 [1].
    """
    position, velocity = (law.position_noise,) * 2, (law.velocity_noise,) * 2
    half_width = (
        *position,
        law.heading_noise,
        *velocity,
        law.velocity_noise,
        law.command_noise,
        law.command_noise,
    )
    return jnp.array(half_width, dtype) * jax.random.uniform(key, (8,), dtype, -1.0, 1.0)


def measure(
    vessel: Vessel,
    layout: str,
    obs_clip: float,
    state: VesselState,
    goal: jax.Array,
    noise: jax.Array,
):
    """Noisy, clipped observation (n_obs,); velocities are rotated with the noisy yaw. goal: (2,)
    [m] from the start.
    """
    position = hull_position(vessel, state) + noise[:2]
    observation = observe(
        layout, position, state.pose[2] + noise[2], state.velocity + noise[3:6], goal
    )
    return jnp.clip(observation, -obs_clip, obs_clip)


def control_step(
    vessel: Vessel,
    plant: Plant,
    law: Law,
    d: Disturbance,
    policy: Policy,
    goal,
    state: VesselState,
    noise,
) -> tuple[VesselState, jax.Array]:
    """One control period. Returns the state and the hull's pose (n_physics, 3) after each physics
    step.
    """
    action = act(policy, measure(vessel, policy.layout, policy.obs_clip, state, goal, noise))
    command = jnp.clip(action + noise[6:], -1.0, 1.0)
    return apply_command(vessel, plant, law, d, state, command, policy.n_physics)


def run(
    vessel: Vessel,
    plant: Plant,
    law: Law,
    policy: Policy,
    key: jax.Array,
    goal,
    heading,
    n_control: int,
    every: int,
) -> jax.Array:
    """Poses (1 + n_control * n_physics // every, 3) of the hull, x, y [m] and heading [rad], from
    rest at the origin, every `every` physics steps.

    goal: (2,) [m] from the start; heading: () [rad]. `every` divides the policy's physics steps per
        control step.
    """
    episode_key, noise_key = jax.random.split(key)
    d = draw_disturbance(episode_key, law, vessel.mass)
    return run_with(vessel, plant, law, policy, d, noise_key, goal, heading, n_control, every)


def run_with(
    vessel, plant, law, policy, d: Disturbance, noise_key, goal, heading, n_control: int, every: int
):
    """`run` with a given disturbance; the noise of step i comes from noise_key folded with i,
    whatever the horizon.
    """

    def step(state, i):
        noise = jnp.zeros(8, goal.dtype)
        if law.noisy:
            noise = draw_noise(jax.random.fold_in(noise_key, i), law, goal.dtype)
        state, poses = control_step(vessel, plant, law, d, policy, goal, state, noise)
        return state, poses[every - 1 :: every]

    _, poses = jax.lax.scan(step, at_rest(vessel, heading), jnp.arange(n_control))
    start = jnp.concatenate([jnp.zeros_like(goal), jnp.reshape(heading, 1)])
    return jnp.concatenate([start[None], poses.reshape(-1, 3)])
