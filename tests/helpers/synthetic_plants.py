"""Small black boxes whose errors are known: a drift-like plant, and plants that hide their error in
one place.
"""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common import struct
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.system import TimeGrid, Trajectory, time_grid


@struct.dataclass
class Plant:
    """A plant with p = base(k, s) + error, given as a function (key, k, s) -> (p (records, 2), q
    (1,)).
    """

    domain: Box
    time: TimeGrid
    run: callable = struct.field(pytree_node=False)
    name: str = struct.field(pytree_node=False, default="plant")

    n_p = 2
    n_q = 1

    def rollout(self, key, k):
        s = jnp.linspace(0.0, 1.0, self.time.n_record + 1)
        p, q = self.run(key, k, s)
        return Trajectory(p - p[:1], q)


def straight(k, s):
    """The path that `straight_network` predicts exactly: p = s k, q = k_0."""
    return s[:, None] * k[None], k[:1]


def straight_network(T: int):
    """k (2,) -> c_t = (t / T) k, q = k_0, as one linear layer."""
    W = np.concatenate([np.kron(np.arange(1, T + 1)[:, None] / T, np.eye(2)), [[1.0, 0.0]]])
    return relu_network([W], [np.zeros(2 * T + 1)])


@cache
def plant(run, T=4, stride=5, name="plant"):
    """A plant over K = [0, 1]^2 with T intervals of `stride` records over one second."""
    return Plant(
        box([0.0, 0.0], [1.0, 1.0]), time_grid(1.0 / T, 1.0, 1.0 / (T * stride)), run, name
    )


def noisy(key, k, s):
    """Smooth model error that grows with s and with k_0, and a random bend: heteroscedastic,
    continuous scores.
    """
    p, q = straight(k, s)
    a = jax.random.normal(key, (3,)) * (0.02 + 0.1 * k[0])
    bend = jnp.stack([a[0] * s, a[1] * jnp.sin(3 * s)], axis=1)
    return p + bend + 0.05 * s[:, None] ** 2 * jnp.sin(7 * k)[None], q + 0.3 * a[2:]


def exact(key, k, s):
    """No error at all."""
    return straight(k, s)


def spike(width=1e-4, height=10.0):
    """No error, except `height` [m] in the slab k_0 in [0.5, 0.5 + width]."""

    def run(key, k, s):
        p, q = straight(k, s)
        hit = (k[0] >= 0.5) & (k[0] <= 0.5 + width)
        return p + jnp.where(hit, height, 0.0) * s[:, None], q

    return run


def between_knots(T=4, height=0.3):
    """Exact at every knot, off by up to `height` [m] between them."""

    def run(key, k, s):
        p, q = straight(k, s)
        return p + height * jnp.sin(jnp.pi * T * s)[:, None] ** 2, q

    return run


def disturbed(key, k, s, scale=1.0):
    """Error from the disturbance alone, a normal gain, the same for every k."""
    p, q = straight(k, s)
    return p + 0.1 * scale * jax.random.normal(key, (2,))[None] * s[:, None], q


def failing(key, k, s):
    """NaN for one run in twenty, else exact."""
    p, q = straight(k, s)
    return jnp.where(jax.random.uniform(key) < 0.05, jnp.nan, p), q
