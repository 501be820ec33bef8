"""A robot that turns with the heading at its start, but for a wind that does not."""

import jax
import jax.numpy as jnp

import parc_jax as pj
from parc_jax.learning.system import STAYS, TURNS


class Arc:
    """A robot that drives an arc of curvature k_1 at speed k_0; a north wind pushes it, whatever
    its heading.
    """

    name, n_p, n_q = "arc", 2, 2
    rotation = (TURNS, STAYS)
    domain, time = pj.box([0.5, -0.5], [1.0, 0.5]), pj.learning.time_grid(dt=0.25, t_f=1.0)

    def __init__(self, wind: float):
        self.wind = wind

    def rollout(self, key, k):
        return self.rollout_headed(key, k, jnp.zeros((), k.dtype))

    def rollout_headed(self, key, k, heading):
        s = jnp.linspace(0.0, 1.0, self.time.n_record + 1).astype(k.dtype)
        along, across = s * k[0], 0.5 * k[1] * s**2 + 0.1 * s * jax.random.uniform(key, (), k.dtype)
        x = along * jnp.cos(heading) - across * jnp.sin(heading)
        y = along * jnp.sin(heading) + across * jnp.cos(heading) - self.wind * s
        return pj.Trajectory(jnp.stack([x, y], axis=-1), jnp.stack([k[1] + heading, k[0]]))
