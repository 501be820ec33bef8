"""The drone: a point mass whose thrust points where its box does, steered along a smooth path to a
place k away, in wind.
"""

import itertools
from dataclasses import dataclass
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import TimeGrid, Trajectory, time_grid

SIZE = (0.5, 0.5, 0.2)  # [m] of the box, along, across and up
GRAVITY = 9.81  # [m/s^2]
STIFFNESS, DAMPING = 16.0, 8.0  # [1/s^2], [1/s] of the control law about the path
TILT_LAG = 0.1  # [s] from the acceleration asked for to the one that the thrust gives
WIND = 0.3  # [m/s^2] most along each axis, one for a run
CORNERS = tuple(
    map(" ".join, itertools.product(("front", "rear"), ("left", "right"), ("top", "bottom")))
)
POINTS = ("centre", *CORNERS)


@dataclass(frozen=True, eq=False)
class Drone:
    """k = (x, y, z [m] of the place to go to, from the start) -> p (n_record + 1, 9, 3) of POINTS,
    q (0,). Build with `system`.
    """

    domain: Box
    time: TimeGrid
    wind: float

    name: ClassVar[str] = "drone"
    n_p: ClassVar[int] = 3
    n_q: ClassVar[int] = 0
    points: ClassVar[tuple[str, ...]] = POINTS
    k_labels: ClassVar[tuple[str, ...]] = ("way along x [m]", "way along y [m]", "climb [m]")

    @property
    def law(self) -> dict[str, float]:
        """What a claim about this system has to name beside K."""
        return {"wind": self.wind}

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """One run from hovering at the origin."""
        return self.rollout_from(key, k, jnp.zeros_like(k))

    def rollout_from(self, key: jax.Array, k: jax.Array, p0: jax.Array) -> Trajectory:
        """One run from hovering at p0 (3,); p is relative to it."""
        wind = self.wind * jax.random.uniform(key, (3,), k.dtype, -1.0, 1.0)
        h, t_f = self.time.dt_record, self.time.t_f

        def step(state, t):
            place, velocity, thrust = state
            at, speed, bend = (k * part for part in _smooth_step(t / t_f, t_f))
            asked = bend + STIFFNESS * (p0 + at - place) + DAMPING * (speed - velocity)
            thrust = thrust + h / TILT_LAG * (asked - thrust)
            velocity = velocity + h * (thrust + wind)
            place = place + h * velocity
            return (place, velocity, thrust), _points(place - p0, thrust)

        still = jnp.zeros_like(k)
        times = h * jnp.arange(self.time.n_record, dtype=k.dtype)
        _, p = jax.lax.scan(step, (p0, still, still), times)
        return Trajectory(jnp.concatenate([_points(still, still)[None], p]), k[:0])


def system(wind: float = WIND) -> Drone:
    """The drone in wind of up to so much along each axis [m/s^2]."""
    return Drone(box([2.5, -0.4, -0.2], [3.5, 0.4, 0.4]), time_grid(0.2, 2.0, 0.02), wind)


def _smooth_step(share, t_f: float):
    """A path from 0 to 1, at rest at both ends, its speed and its acceleration, at a share of
    t_f.
    """
    place = share**3 * (10 - 15 * share + 6 * share**2)
    speed = 30 * share**2 * (1 - share) ** 2 / t_f
    return place, speed, 60 * share * (1 - share) * (1 - 2 * share) / t_f**2


def _points(centre, thrust):
    """Places (9, 3) of POINTS of a box about a centre (3,), turned the short way from upright to
    where the thrust (3,) and the weight it bears point.
    """
    up = thrust + jnp.array([0.0, 0.0, GRAVITY], thrust.dtype)
    up = up / jnp.sqrt((up * up).sum())
    signs = np.array(list(itertools.product((1, -1), repeat=3)))
    arms = jnp.asarray(0.5 * signs * np.array(SIZE)[None], centre.dtype)
    axis = jnp.stack([-up[1], up[0], jnp.zeros_like(up[0])])  # e_z x up, the sine of the angle
    across = jnp.cross(axis[None], arms)
    turned = arms + across + jnp.cross(axis[None], across) / (1 + up[2])
    return jnp.concatenate([centre[None], centre[None] + turned])
