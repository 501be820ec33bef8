"""A quick kinematic stand-in in JAX, for tests: speeds follow the set point with first-order lags,
the tail drifts outwards, wheels slip. Its numbers are roughly MuJoCo's; no claim is about it.
"""

from dataclasses import dataclass
from typing import ClassVar

import jax
import jax.numpy as jnp

from parc_jax.learning.system import Trajectory
from sims.jackal import params as c
from sims.jackal.system import Manoeuvre
from sims.rectangle import centre_and_corners


@dataclass(frozen=True, eq=False)
class Twin(Manoeuvre):
    """The same manoeuvre, law of slip and sensing; friction and mass play no part."""

    plant: ClassVar[str] = "twin"

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """One run from the origin."""
        return self._run(key, k, jnp.zeros(2, k.dtype), jnp.zeros((), k.dtype))

    def rollout_from(self, key: jax.Array, k: jax.Array, p0: jax.Array) -> Trajectory:
        """One run from p0 (2,) [m]; p is relative to it."""
        return self._run(key, k, p0, jnp.zeros((), k.dtype))

    def rollout_headed(self, key: jax.Array, k: jax.Array, heading: jax.Array) -> Trajectory:
        """One run with that heading [rad] at the start; p is not turned back."""
        return self._run(key, k, jnp.zeros(2, k.dtype), heading)

    def _run(self, key, k, p0, heading) -> Trajectory:
        first, ever, off = jax.random.split(key, 3)
        n = self.time.n_record
        wheels = jnp.array(self.floor.travel, k.dtype) - 1.0
        keep = jnp.exp(jnp.array(-c.TICK / self.floor.memory, k.dtype))
        kicks = self.floor.slip * jax.random.normal(ever, (n + 1, 2), k.dtype)
        steady = jax.random.uniform(first, (2,), k.dtype, *wheels)
        sensed = jnp.array(self.floor.sensed, k.dtype)
        speeds = k[:2] + sensed * jax.random.uniform(off, (2,), k.dtype, -1.0, 1.0)
        command = jnp.where(jnp.arange(n)[:, None] < self.held, k[None, 2:], 0.0)
        most = c.TICK * jnp.minimum(jnp.array(self.ramp), jnp.array(c.MOST_CHANGE)).astype(k.dtype)
        share = -jnp.expm1(-c.TICK / jnp.array(c.TWIN_LAG)).astype(k.dtype)
        half = 0.5 * c.TRACK_FACTOR * c.TRACK

        def tick(state, now):
            pose, speeds, held, slip = state
            asked, kick = now
            held = held + jnp.clip(asked - held, -most, most)
            slip = keep * slip + jnp.sqrt(1 - keep**2) * kick
            sides = 1.0 + steady + slip  # left, right
            left, right = held[0] - half * held[1], held[0] + half * held[1]
            left, right = sides[0] * left, sides[1] * right
            target = jnp.stack([0.5 * (left + right), 0.5 * (right - left) / half])
            speeds = speeds + share * (target - speeds)
            middle = pose[2] + 0.5 * c.TICK * speeds[1]
            cos, sin = jnp.cos(middle), jnp.sin(middle)
            drift = -c.TWIN_DRIFT * speeds[0] * speeds[1]
            vx, vy = cos * speeds[0] - sin * drift, sin * speeds[0] + cos * drift
            pose = pose + c.TICK * jnp.stack([vx, vy, speeds[1]])
            return (pose, speeds, held, slip), pose

        start = jnp.concatenate([p0, heading[None]]).astype(k.dtype)
        state = (start, speeds, k[:2], kicks[0])
        _, poses = jax.lax.scan(tick, state, (command, kicks[1:]))
        poses = jnp.concatenate([start[None], poses])
        p = centre_and_corners(poses[:, :2] - p0[None], poses[:, 2], *self.size)
        return Trajectory(p, poses[-1, 2:])
