"""A model to learn from: the robot as a constant twist, linear in the wheel speeds.

It is identified from the training commands alone and gives the network its shape, smooth and
without noise, from as many runs as one likes. No claim is made about it: claims come from
recorded runs.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from parc_jax.common.sets.box import Box
from parc_jax.learning.system import TimeGrid, Trajectory
from sims.foreign.husky.log import NAME
from sims.rectangle import POINTS, centre_and_corners

_UNUSUAL = 0.02  # [m/s, rad/s] residuals beyond this count linearly: sticking wheels


class Twist(NamedTuple):
    """Twist (forward, leftward [m/s], turning [rad/s]) = gain (3, 2) @ wheel speeds + offset
    (3,).
    """

    gain: np.ndarray
    offset: np.ndarray


class TwistModel:
    """A black box in JAX: a footprint under the twist of k, without disturbance.

    domain: K. time: the grid of its runs. size: (length, width) [m] of the footprint.
    """

    name, n_p, n_q, points = f"{NAME}, twist model", 2, 0, POINTS

    def __init__(self, twist: Twist, domain: Box, time: TimeGrid, size: tuple[float, float]):
        self.twist = twist
        self.domain = domain
        self.time = time
        self.size = size

    def rollout(self, key, k):
        """k (2,) wheel speeds [rad/s]; p (n_record + 1, 5, 2) [m]."""
        del key
        t = jnp.arange(self.time.n_record + 1, dtype=k.dtype) * self.time.dt_record
        gain, offset = (jnp.asarray(part, k.dtype) for part in self.twist)
        forward, leftward, turning = gain @ k + offset
        along, across = arc(t, turning)
        centre = jnp.stack(
            [forward * along - leftward * across, forward * across + leftward * along], axis=-1
        )
        return Trajectory(centre_and_corners(centre, turning * t, *self.size), k[:0])


def arc(t, turning):
    """Way (n_t,) ahead and to the left after t (n_t,) [s] at unit speed ahead and a turning rate
    [rad/s]. NumPy or JAX.
    """
    xp = jnp if isinstance(turning, jax.Array) else np
    half = 0.5 * turning * t
    chord = t * xp.sinc(half / np.pi)
    return chord * xp.cos(half), chord * xp.sin(half)


def identify(t: np.ndarray, p: np.ndarray, yaw: np.ndarray, command: np.ndarray) -> Twist:
    """The twist that fits runs p (n, n_t, 2) [m], yaw (n, n_t) [rad] at t (n_t,) [s] of commands
    (n, 2), each run seen as one constant twist of its own.
    """
    rates = (yaw @ t) / (t @ t)
    seen = np.array([_own_twist(t, run, rate) for run, rate in zip(p, rates, strict=True)])
    inputs = np.column_stack([command, np.ones(len(p))])
    rows = np.array([_robust_line(inputs, column) for column in seen.T])
    return Twist(rows[:, :2], rows[:, 2])


def _own_twist(t: np.ndarray, run: np.ndarray, rate: float) -> np.ndarray:
    """(3,) the twist of one run (n_t, 2) that turns at `rate`."""
    along, across = arc(t, rate)
    columns = np.concatenate([np.column_stack([along, -across]), np.column_stack([across, along])])
    velocity = np.linalg.lstsq(columns, run.T.reshape(-1), rcond=None)[0]
    return np.array([*velocity, rate])


def _robust_line(inputs: np.ndarray, seen: np.ndarray) -> np.ndarray:
    start = np.linalg.lstsq(inputs, seen, rcond=None)[0]
    return least_squares(lambda x: inputs @ x - seen, start, loss="soft_l1", f_scale=_UNUSUAL).x
