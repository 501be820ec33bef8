"""A driver of the Car that knows the map, as that of the Point."""

from functools import cache

import jax.numpy as jnp
import numpy as np

from sims.car.manoeuvre import STEP, TORQUE, engine
from sims.car.sensing import CUT
from sims.point.guide import Guide, Known, lagged, summed
from sims.point.world import SUBSTEPS

SHARES = np.linspace(-1.0, 1.0, 9)  # of the greatest torque, for which it is tried out
LAG, STOP = 0.06, 0.1  # [s] of its speeds; of its speed that a stop takes
TURNS, BACKWARDS = 1.3, 0.3  # [rad/s] on the spot; [s] that going backwards loses


class CarGuide(Guide):
    """A policy for some worlds of the Car. Plans are a thrust and a turn to the left."""

    fast = 0.75
    knots, knot, held = 20, 0.08, 0.24
    cut = CUT

    @classmethod
    def _action(cls, plan):
        return wheels(plan) * TORQUE

    @classmethod
    def _roll(cls, plans, known: Known):
        (_, back, turning), (x, y, heading) = known.speeds, known.pose
        wanted = _tabled(wheels(plans.transpose(0, 2, 1))).transpose(2, 0, 1)  # (2, n, knots)
        kept, followed = lagged(cls.knots, cls.knot / LAG)
        now = jnp.array([-back, turning])[:, None, None]
        ahead, turning = now * kept + wanted @ followed
        heading = heading + cls.knot * summed(turning)
        axis = jnp.stack([jnp.sin(heading), -jnp.cos(heading)])  # its front is along -y
        velocity = ahead * axis
        place = jnp.array([x, y])[:, None, None] + cls.knot * summed(velocity)
        return place, velocity, axis

    @classmethod
    def _stop(cls, velocity, axis):
        return jnp.full(velocity.shape[1:], STOP)

    @classmethod
    def _lost(cls, velocity, axis, away):
        off = jnp.arccos(jnp.clip(-(axis * away).sum(axis=0), -1.0, 1.0))
        return jnp.minimum(off, np.pi - off + TURNS * BACKWARDS) / TURNS


def wheels(plans):
    """Torques (..., 2) left, right as shares of the greatest, of thrusts and turns (..., 2)."""
    thrust, turn = plans[..., 0], plans[..., 1]
    return jnp.clip(jnp.stack([thrust + turn, thrust - turn], axis=-1), -1.0, 1.0)


def _tabled(torques):
    """Speeds (..., 2) ahead [m/s], turning [rad/s] that torques (..., 2) end in."""
    table, n = jnp.asarray(steady(), torques.dtype), len(SHARES)
    at = jnp.clip((torques + 1) / 2 * (n - 1), 0, n - 1.001)
    (i, j), (a, b) = jnp.moveaxis(at.astype(int), -1, 0), jnp.moveaxis(at % 1.0, -1, 0)[..., None]
    first = (1 - b) * table[i, j] + b * table[i, j + 1]
    return (1 - a) * first + a * ((1 - b) * table[i + 1, j] + b * table[i + 1, j + 1])


@cache
def steady() -> np.ndarray:
    """(9, 9, 2) speeds ahead and turning of robots driven for three seconds by torques left and
    right of SHARES, means of the last two.
    """
    torques = np.stack(np.meshgrid(SHARES, SHARES, indexing="ij"), -1).reshape(-1, 2)
    batch = engine(len(torques), 1)
    qpos, qvel, ctrl = (batch.bind(name) for name in ("qpos", "qvel", "ctrl"))
    ctrl[:], found = torques * TORQUE, []
    for _ in range(round(3.0 / STEP)):
        for _ in range(SUBSTEPS):
            batch.step()
        w, x, y, z = qpos[:, 3:7].T
        heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        ahead = np.sin(heading) * qvel[:, 0] - np.cos(heading) * qvel[:, 1]
        found.append(np.stack([ahead, qvel[:, 5]], axis=-1))
    mean = np.mean(found[round(1.0 / STEP) :], axis=0)
    return mean.reshape(len(SHARES), len(SHARES), 2)
