"""A bar that drives and turns: a black box with two reference points, whose places are known."""

import jax
import jax.numpy as jnp
import numpy as np
from toy_models import assumed

import parc_jax as pj
from parc_jax.learning.bound.tube import zero_tube
from parc_jax.learning.model import trajectory_model
from parc_jax.learning.network.predict import layout_of
from parc_jax.learning.network.relu import relu_network

LENGTH = 0.5  # [m] from the first point to the second


class Bar:
    """Drives k_0 along x in one second and turns by k_1; a gust pushes all of it aside by up to
    2 cm. The second point starts at (0, LENGTH).
    """

    name, n_p, n_q = "bar", 2, 1
    points = ("tail", "nose")
    domain, time = (
        pj.box([0.5, -0.5], [1.0, 0.5]),
        pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.125),
    )

    def rollout(self, key, k):
        """Places of both points, and the turn."""
        return self.rollout_from(key, k, jnp.zeros(2, k.dtype))

    def rollout_from(self, key, k, p0):
        """The same from another start, which changes nothing."""
        s = jnp.linspace(0.0, 1.0, self.time.n_record + 1).astype(k.dtype)
        gust = 0.02 * jax.random.uniform(key, (), k.dtype, -1, 1)
        tail = p0[None] + jnp.stack([s * k[0], s**2 * gust], axis=-1)
        nose = tail + LENGTH * jnp.stack([-jnp.sin(s * k[1]), jnp.cos(s * k[1])], axis=-1)
        return pj.Trajectory(jnp.stack([tail, nose], axis=1) - p0[None, None], k[1:])


class Tail(Bar):
    """The same bar of which only the tail is seen, as a system without points returns it."""

    points = ("tail",)

    def rollout(self, key, k):
        """Places of the tail."""
        p, q = super().rollout(key, k)
        return pj.Trajectory(p[:, 0], q)


def straight_bar():
    """A model of a bar that does not turn: tail at (s k_0, 0), nose LENGTH beside it, q = k_1."""
    layout = layout_of(Bar())
    W, b = np.zeros((layout.n_offsets + 1, 2)), np.zeros(layout.n_offsets + 1)
    place = np.arange(layout.n_offsets) + layout.n_p  # the first point at the start is no output
    W[:-1, 0] = np.where(place % 2 == 0, (place // layout.n_c) / layout.n_steps, 0.0)
    b[:-1] = np.where(place % layout.n_c == 3, LENGTH, 0.0)
    W[-1, 1] = 1.0
    edges = [[lo, hi] for lo, hi in zip(Bar.domain.lo, Bar.domain.hi, strict=True)]
    none = zero_tube(edges, layout.n_steps, layout.n_c, layout.n_c + 1, n_points=2)
    net = relu_network([W], [b])
    return trajectory_model(net, assumed(net, none, Bar.time, "bar", Bar.points))
