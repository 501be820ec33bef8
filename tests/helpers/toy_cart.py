"""A system of the user's own, as the shell finds it by its module name; and one that tilts."""

import jax
import jax.numpy as jnp

import parc_jax as pj


class Cart:
    """Rolls k along x and y in one second, with a gust."""

    name, n_p, n_q = "cart", 2, 0
    domain, time = (
        pj.box([0.5, -0.5], [1.0, 0.5]),
        pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.05),
    )
    tilt = 0.0

    def rollout(self, key, k):
        return self.rollout_from(key, k, jnp.zeros(2, k.dtype))

    def rollout_from(self, key, k, p0):
        s = jnp.linspace(0.0, 1.0, 21, dtype=k.dtype)[:, None]
        gust = 0.02 * jax.random.normal(key, (2,), k.dtype)
        return pj.Trajectory(s * k[None] + s**2 * gust[None] + self.tilt * p0[0] * s**2, k[:0])


class Hill(Cart):
    """Depends on where it starts."""

    tilt = 0.01


def system(plant: str = "cart"):
    """Either of the two."""
    return {"cart": Cart, "hill": Hill}[plant]()


def problem():
    """A goal behind a block."""
    return pj.reach_avoid(pj.box([0.8, -0.2], [1.2, 0.2]), [pj.box([0.4, 0.15], [0.6, 0.5])], 0.1)
