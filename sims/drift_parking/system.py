"""The simulator as a black box that can be certified."""

from typing import ClassVar

import jax
import jax.numpy as jnp
from flax import struct

from parc_jax.errors import InputError
from parc_jax.sets.box import Box, box
from parc_jax.system import TimeGrid, Trajectory, time_grid
from sims.drift_parking import params as c
from sims.drift_parking.plant_ode import newton_euler
from sims.drift_parking.simulate import Run, simulate


@struct.dataclass
class DriftParking:
    """Drift parking over k = (v [m/s], threshold sideslip [rad]); p = (x, y) [m], q = (final yaw, not wrapped [rad]).

    Build with `system`. Deterministic. Call under x64: float32 does not reproduce the manoeuvre.
    """

    domain: Box
    time: TimeGrid
    plant: object = struct.field(pytree_node=False)

    name: ClassVar[str] = "drift_parking"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 1

    def run(self, k) -> Run:
        """Everything the simulation knows for k (2,): all states, switching sample, steering at the switch."""
        return simulate(self.plant, k)

    def rollout(self, key, k) -> Trajectory:
        """p (781, 2) relative to the start, q (1,). NaN when the drift never starts. `key` is unused."""
        del key
        states = self.run(k).states
        return Trajectory(jnp.stack([states.x, states.y], axis=-1), states.yaw[-1:])


def system(plant: str = "mjx") -> DriftParking:
    """The system on a MuJoCo body ("mjx") or on the closed-form rigid body ("ode"). Raises InputError for other names."""
    if plant == "ode":
        accelerations = newton_euler
    elif plant == "mjx":
        from sims.drift_parking.plant_mjx import mujoco_body

        accelerations = mujoco_body()
    else:
        raise InputError(f'plant: expected "mjx" or "ode"; got {plant!r}.')
    lo, hi = zip(c.SPEED_RANGE, c.SIDESLIP_RANGE, strict=True)
    return DriftParking(box(lo, hi), time_grid(c.PLAN_STEP, c.T_FINAL, c.STEP), accelerations)
