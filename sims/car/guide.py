"""A driver of the Car that knows the map, as that of the Point."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from scipy.sparse import csr_array

from sims.car import ways
from sims.car.manoeuvre import STEP, TORQUE, engine
from sims.car.sensing import CUT
from sims.point.guide import Guide, Known, lagged, summed
from sims.point.world import SUBSTEPS

SHARES = np.linspace(-1.0, 1.0, 9)  # of the greatest torque, for which it is tried out
LAG, STOP = 0.06, 0.1  # [s] of its speeds; of its speed that a stop takes
TURNS = 1.3  # [rad/s] on the spot
STRAIGHT, SPOT, CHANGED = 0.45, 0.35, 0.4  # shares of actions drawn; of those that are changed


class CarGuide(Guide):
    """A policy for some worlds of the Car. Plans are a thrust and a turn to the left."""

    keep, rest = 0.243, 0.0
    drawn, refined = 160, 96
    fast, lag = 0.75, LAG
    knots, knot, held = 15, 0.08, 0.24
    cut, near, more = CUT, 1.5, 0.0

    @classmethod
    def _action(cls, plan):
        return wheels(plan) * TORQUE

    @classmethod
    def _anew(cls, key, size):
        """Straight ahead or back, a turn on the spot, or both at once, each often for long."""
        *own, key = jax.random.split(key, 5)
        kind = jax.random.uniform(own[0], size)
        sign = 1 - 2.0 * jax.random.bernoulli(own[1], 0.5, (2, *size))
        both = jax.random.uniform(own[2], size, minval=-1.0)
        straight, spot = kind < STRAIGHT, kind > 1 - SPOT
        thrust = jnp.where(spot, 0.0, sign[0])
        turn = jnp.where(straight, 0.0, jnp.where(spot, sign[1], both))
        drawn, new = jnp.stack([thrust, turn], -1), jax.random.bernoulli(key, CHANGED, size)
        plans = [drawn[:, 0]]
        for i in range(1, size[1]):
            plans.append(jnp.where(new[:, i, None], drawn[:, i], plans[-1]))
        return jnp.stack(plans, 1)

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
    def _left(cls, place, velocity, axis, known: Known):
        return ways.read(known.far, place, axis, cls.half)

    @classmethod
    def _shape(cls) -> tuple[int, ...]:
        return ways.HEADINGS, ways.size(cls.half), ways.size(cls.half)

    @classmethod
    def _ways_round(cls, discs: np.ndarray) -> tuple[csr_array, np.ndarray]:
        """As of `Guide`, and what steps of a heading take."""
        return super()._ways_round(discs), ways.dear(discs, cls.half)

    @classmethod
    def _field(cls, goals: np.ndarray, ways_round: tuple[csr_array, np.ndarray]) -> np.ndarray:
        """[s] to the next goal from each heading and place."""
        shortest, dear = ways_round
        guess = super()._field(goals, shortest)[:: ways.FINER, :: ways.FINER] / cls.fast
        return ways.times(guess, dear, goals[0], (cls.fast, TURNS), cls.half)


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
