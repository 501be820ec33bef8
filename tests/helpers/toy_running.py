"""A cart whose drive lags: it begins to move at a measured speed, and what its drive is about to do
is hidden.
"""

import jax
import jax.numpy as jnp
import numpy as np
from toy_models import assumed, told

from parc_jax.common.sets.box import box
from parc_jax.learning.bound.tube import tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.runs.law import subject
from parc_jax.learning.system import Trajectory, time_grid

H, LAG, DRIVE = 0.05, 0.2, 0.3  # [s] step, and how fast speed follows drive and drive the command
MOVING = 10  # records for which the command is followed; after that the cart stops
ROUGH = 0.01  # [m/s] noise of the drive at a start from standstill


class Cart:
    """k = (speed at the start, measured; speed that is commanded) [m/s]: half a second of it, and
    half a second to stop in. Its state is (speed, drive).
    """

    name, n_p, n_q = "cart", 2, 0
    domain = box([0.0, 0.0], [1.0, 1.0])
    time = time_grid(dt=0.25, t_f=1.0, dt_record=H)
    k_labels = ("v0 [m/s]", "v [m/s]")
    given = ("v0 [m/s]",)
    chunk = 64

    def rollout(self, key, k):
        """From a drive that has settled at the speed."""
        drive = k[0] + ROUGH * jax.random.normal(key, ())
        return self.rollout_from_state(key, jnp.stack([k[0], drive]), k)[0]

    def start_state(self, key):
        """At rest."""
        return ROUGH * jax.random.uniform(key, (2,))

    def measured(self, state):
        """The speed."""
        return state[:1]

    def rollout_from_state(self, key, state, k):
        """The same from a state, and the states at all records."""

        def step(state, record):
            speed, drive = state
            command = jnp.where(record < MOVING, k[1], 0.0)
            after = speed + H * (drive - speed) / LAG, drive + H * (command - drive) / DRIVE
            return jnp.stack(after), jnp.stack(after)

        states = jax.lax.scan(step, state, jnp.arange(self.time.n_record))[1]
        states = jnp.concatenate([state[None], states])
        x = H * jnp.concatenate([jnp.zeros(1, state.dtype), jnp.cumsum(states[:-1, 0])])
        y = 1e-3 * jnp.linspace(0, 1, len(x)) * jax.random.normal(key, ())
        return Trajectory(jnp.stack([x, y], axis=1), k[:0]), states


class Carts(Cart):
    """The same, many at a time in NumPy: nothing is compiled."""

    rollout = None

    def rollout_batch(self, keys, ks):
        drive = ks[:, 0] + ROUGH * _draws(keys, "standard_normal")
        return self.rollout_from_state(keys, np.stack([ks[:, 0], drive], axis=1), ks)[0]

    def start_state(self, keys):
        return ROUGH * _draws(keys, "random", 2)

    def measured(self, states):
        return np.asarray(states)[..., :1]

    def rollout_from_state(self, keys, states, ks):
        states = [np.asarray(states)]
        for record in range(self.time.n_record):
            speed, drive = states[-1].T
            command = ks[:, 1] if record < MOVING else 0.0
            after = speed + H * (drive - speed) / LAG, drive + H * (command - drive) / DRIVE
            states.append(np.stack(after, axis=1))
        states = np.stack(states, axis=1)
        x = H * np.cumsum(np.pad(states[:, :-1, 0], ((0, 0), (1, 0))), axis=1)
        y = 1e-3 * np.linspace(0, 1, x.shape[1]) * _draws(keys, "standard_normal")[:, None]
        return Trajectory(np.stack([x, y], axis=2), np.zeros((len(ks), 0))), states


def _draws(keys, kind: str, *shape) -> np.ndarray:
    """A draw for each key (n, 2), of a method of NumPy's generators."""
    return np.array([getattr(np.random.default_rng(np.asarray(key)), kind)(*shape) for key in keys])


def settled_network() -> ReLUNetwork:
    """What the cart does from a settled drive, exactly: it is linear in k."""
    W, speed, drive = np.zeros((21, 2, 2)), np.array([1.0, 0.0]), np.array([1.0, 0.0])
    for record in range(20):
        W[record + 1, 0] = W[record, 0] + H * speed
        speed = speed + H * (drive - speed) / LAG
        drive = drive + H * ([0.0, float(record < MOVING)] - drive) / DRIVE
    return relu_network([W[5::5].reshape(8, 2)], [np.zeros(8)])


def cart_model(widths=(0.02, 0.05), edges=(0.0, 0.5, 1.0)) -> TrajectoryModel:
    """Of the cart, with an assumed tube per bin of the speed at the start."""
    about = Cart()
    interval = np.broadcast_to(np.reshape(widths, (-1, 1, 1)), (len(widths), 4, 2))
    errors = tube([edges, (0.0, 1.0)], interval, interval[:, 0])
    claim = assumed(settled_network(), errors, about.time, about.name)
    named = subject(about.name, about.domain, about.time, 2, 0, labels={"k": about.k_labels})
    return told(trajectory_model(settled_network(), claim), labels=named.labels, given=(0,))
