"""The simulator as a black box that can be certified."""

from dataclasses import dataclass
from typing import ClassVar

import jax.numpy as jnp

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import ONE_POINT, TURNS, TimeGrid, Trajectory, time_grid
from sims import rectangle
from sims.drift_parking import params as c
from sims.drift_parking.plant_ode import newton_euler
from sims.drift_parking.scenario import BODIES
from sims.drift_parking.simulate import Run, simulate
from sims.drift_parking.vehicle import Plant


@dataclass(frozen=True, eq=False)
class DriftParking:
    """Drift parking over k = (v [m/s], threshold sideslip [rad]); p = (x, y) [m] of the centre of
    mass or, with points, of it and of the four corners; q = (final yaw, not wrapped [rad]).

    Build with `system`. Deterministic. Float64 only: float32 does not reproduce the manoeuvre.
    """

    domain: Box
    time: TimeGrid
    plant: Plant
    plant_name: str
    points: tuple[str, ...] = ONE_POINT

    name: ClassVar[str] = "drift_parking"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 1
    q_labels: ClassVar[tuple[str, ...]] = ("final yaw [rad]",)
    # the controller works in the frame of the start, and the ground is even
    rotation: ClassVar[tuple[str, ...]] = (TURNS,)
    k_labels: ClassVar[tuple[str, ...]] = ("speed [m/s]", "sideslip at braking [rad]")

    @property
    def law(self) -> dict[str, str]:
        """What a claim about this system has to name beside K: the plant."""
        return {"plant": self.plant_name}

    def run(self, k) -> Run:
        """Everything the simulation knows for k (2, *lanes): all states, switching sample, steering
        at the switch.

        Lanes (parallel runs) are trailing axes here; `jax.vmap` over single k works as well. Raises
        InputError.
        """
        if k.dtype != jnp.float64:
            raise InputError(
                f"drift_parking: expected float64 k; got {k.dtype}. Call inside "
                "parc_jax.common.arrays.x64()."
            )
        return simulate(self.plant, k)

    def rollout(self, key, k) -> Trajectory:
        """p (781, 2) or (781, 5, 2) relative to the start, q (1,). NaN when the drift never starts.
        `key` is unused.
        """
        del key
        states = self.run(k).states
        p = jnp.stack([states.x, states.y], axis=-1)
        if self.points != ONE_POINT:
            p = rectangle.centre_and_corners(p, states.yaw, c.BODY_LENGTH, c.BODY_WIDTH)
        return Trajectory(p, states.yaw[-1:])


def system(plant: str = "mjx", body: str = "disc") -> DriftParking:
    """The system on a MuJoCo body ("mjx") or on the closed-form rigid body ("ode"). Raises
    InputError otherwise.

    body: as of `problem`; with "rectangle" the corners are reference points too.
    """
    rectangle.require_body(body, BODIES)
    if plant == "ode":
        accelerations = newton_euler
    elif plant == "mjx":
        from sims.drift_parking.plant_mjx import mujoco_body

        accelerations = mujoco_body()
    else:
        raise InputError(f'plant: expected "mjx" or "ode"; got {plant!r}.')
    lo, hi = zip(c.SPEED_RANGE, c.SIDESLIP_RANGE, strict=True)
    points = rectangle.POINTS if body == rectangle.BODY else ONE_POINT
    grid = time_grid(c.PLAN_STEP, c.T_FINAL, c.STEP)
    return DriftParking(box(lo, hi), grid, accelerations, plant, points)
