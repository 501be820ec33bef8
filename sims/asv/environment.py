"""A Brax environment over either plant: steer to a goal and stay there, under redrawn disturbances.
No obstacles, ever.

Instead of episodes, goal and disturbance are redrawn with a small probability per step, about the
vessel as it moves. Brax's auto-reset brings back the *first* state of each environment again and
again; so a state that comes from a reset is marked fresh and redrawn at the end of its first step,
and the random key lives in `info`, which auto-reset leaves alone.
"""

import functools
import math

import jax
import jax.numpy as jnp

from parc_jax.common import struct
from sims.asv.control import draw_noise, measure
from sims.asv.disturbance import Disturbance, draw_disturbance, named_law
from sims.asv.dynamics import apply_command
from sims.asv.plant import make_plant
from sims.asv.policy import LAYOUTS
from sims.asv.vessel import PHYSICS_DT, SYSID, VesselState, at_rest, hull_position
from sims.quiet import quiet_import

brax = quiet_import("brax.envs.base")

OBS_CLIP = 12.0  # elementwise limit of the observation, in training and in the policy trained
REDRAW = 0.01  # probability per control step of a new goal and a new disturbance
NEAREST, FARTHEST = 0.3, 10.0  # [m] goal distances drawn


@struct.dataclass
class Task:
    """State of one environment.

    vessel, disturbance: the plant's. goal: (2,) [m]. distance: () [m] to it. fresh: () 1.0 straight
        after a reset.
    """

    vessel: VesselState
    disturbance: Disturbance
    goal: jax.Array
    distance: jax.Array
    fresh: jax.Array


class HoverEnv(brax.Env):
    """Observation (6,) of layout "goto", action (2,) left and right command.

    reward = progress to the goal [m] + period * (exp(-distance / 0.25 m) - 0.05 r^2 - 0.02
    |action|^2), with the true distance, not the measured one.
    """

    def __init__(
        self, plant: str = "ode", law: str = "study", period: float = 0.2, redraw: float = REDRAW
    ):
        """plant: "mjx" or "ode". law: see sims.asv.disturbance. period: [s] control. redraw:
        probability per step.
        """
        self._plant, self._law = make_plant(plant, SYSID), named_law(law)
        self._period, self._n_physics, self._redraw = period, round(period / PHYSICS_DT), redraw

    @property
    def observation_size(self) -> int:
        """Length of the observation."""
        return LAYOUTS["goto"]

    @property
    def action_size(self) -> int:
        """Number of propellers."""
        return 2

    @property
    def backend(self) -> str:
        """Brax asks for it; the plant is ours."""
        return "sims.asv"

    def reset(self, rng: jax.Array) -> brax.State:
        """At rest, any heading, goal at a distance of NEAREST ... FARTHEST in any direction."""
        rng, heading_key, task_key, noise_key = jax.random.split(rng, 4)
        heading = jax.random.uniform(heading_key, (), jnp.result_type(float), -math.pi, math.pi)
        task = self._draw(task_key, at_rest(SYSID, heading)).replace(fresh=jnp.ones_like(heading))
        zero = jnp.zeros_like(heading)
        metrics = {"distance": zero, "near": zero}
        noise = draw_noise(noise_key, self._law, heading.dtype)
        return brax.State(task, self._observe(task, noise), zero, zero, metrics, {"key": rng})

    def step(self, state: brax.State, action: jax.Array) -> brax.State:
        """One control period; then, now and then, a new task."""
        task, key = state.pipeline_state, state.info["key"]
        key, noise_key, redraw_key, task_key, measure_key = jax.random.split(key, 5)
        noise = draw_noise(noise_key, self._law, task.goal.dtype)
        action = jnp.clip(action, -1.0, 1.0).astype(task.goal.dtype)
        command = jnp.clip(action + noise[6:], -1.0, 1.0)
        vessel, hull = apply_command(
            SYSID, self._plant, self._law, task.disturbance, task.vessel, command, self._n_physics
        )
        distance = jnp.hypot(*(task.goal - hull[-1, :2]))
        effort = 0.05 * vessel.velocity[2] ** 2 + 0.02 * (action**2).sum()
        reward = task.distance - distance + self._period * (jnp.exp(-distance / 0.25) - effort)

        moved = task.replace(vessel=vessel, distance=distance, fresh=jnp.zeros_like(task.fresh))
        again = (jax.random.uniform(redraw_key) < self._redraw) | (task.fresh > 0)
        task = jax.tree.map(
            functools.partial(jnp.where, again), self._draw(task_key, vessel), moved
        )
        metrics = {
            **state.metrics,
            "distance": distance,
            "near": (distance < 0.1).astype(distance.dtype),
        }
        observation = self._observe(task, draw_noise(measure_key, self._law, task.goal.dtype))
        return state.replace(
            pipeline_state=task,
            obs=observation,
            reward=reward,
            metrics=metrics,
            info={**state.info, "key": key},
        )

    def _observe(self, task: Task, noise: jax.Array) -> jax.Array:
        return measure(SYSID, "goto", OBS_CLIP, task.vessel, task.goal, noise)

    def _draw(self, key: jax.Array, vessel: VesselState) -> Task:
        disturbance_key, goal_key = jax.random.split(key)
        u = jax.random.uniform(goal_key, (2,), vessel.pose.dtype)
        distance = NEAREST + (FARTHEST - NEAREST) * u[0]
        goal = distance * jnp.stack([jnp.cos(2.0 * math.pi * u[1]), jnp.sin(2.0 * math.pi * u[1])])
        here = (
            jnp.zeros_like(vessel.pose).at[:2].set(hull_position(SYSID, vessel))
        )  # the new start is the origin
        return Task(
            vessel=vessel.replace(pose=vessel.pose - here),
            disturbance=draw_disturbance(disturbance_key, self._law, SYSID.mass),
            goal=goal,
            distance=distance,
            fresh=jnp.zeros_like(distance),
        )
