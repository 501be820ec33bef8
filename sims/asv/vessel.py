"""The twin-hull vessel: inertia, drag and propeller tables, identified on the water ("SysID")."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common import struct

PHYSICS_DT = (
    0.02  # [s] one semi-implicit Euler step; drag, disturbance and lagged thrust are held over it
)


@dataclass(frozen=True, eq=False)
class Vessel:
    """Constants of the planar plant; host numbers, so they are constants under jit. Kernels cast
    the arrays as they use
    them: JAX remembers a host array's type from its first use, also after x64 was switched.

    mass: [kg] nominal. inertia: [kg m^2] yaw inertia, not rescaled when the mass varies.
    linear_drag, quadratic_drag: (3,) surge, sway, yaw: drag = -(linear + quadratic |v|) v in body
        axes [N, N m].
    thrust_table: (2, 21) steady force [N] of the left and right propeller on the equally spaced
        command grid -1 ... 1.
    thruster_arm: [m] lateral distance of a propeller from the centre of mass. thruster_lag: [s]
        time constant.
    hull_offset: [m] the hull's reference point lies this far ahead of the centre of mass.
    """

    mass: float
    inertia: float
    linear_drag: np.ndarray
    quadratic_drag: np.ndarray
    thrust_table: np.ndarray
    thruster_arm: float
    thruster_lag: float
    hull_offset: float


@struct.dataclass
class VesselState:
    """What moves.

    pose: (3,) x, y [m] of the centre of mass since the start, and yaw [rad]. velocity: (3,) world
    [m/s] and yaw rate [rad/s]. thrust: (2,) lagged force [N] of the left and right propeller.
    """

    pose: jax.Array
    velocity: jax.Array
    thrust: jax.Array


_LEFT = (-3.8, -3.8, -3.6, -3.6, -1.6, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 10, 15, 21, 23, 22)
_RIGHT = (-5, -5, -5, -4.6, -2.2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4.6, 10, 17, 24, 24, 23)


# No added mass: the identification had none.
SYSID = Vessel(
    mass=35.96,
    inertia=8.061,
    linear_drag=np.array([0.0, 99.99, 0.82985084]),
    quadratic_drag=np.array([17.257603, 99.99, 17.33600724]),
    thrust_table=np.array([_LEFT, _RIGHT]),
    thruster_arm=0.377654,
    thruster_lag=0.05,
    hull_offset=0.02942,
)


def at_rest(vessel: Vessel, heading: jax.Array) -> VesselState:
    """State with the hull's reference point at the origin, the given yaw () [rad], no motion,
    propellers still.
    """
    ahead = jnp.stack([jnp.cos(heading), jnp.sin(heading), jnp.zeros_like(heading)])
    pose = -vessel.hull_offset * ahead + jnp.stack(
        [jnp.zeros_like(heading), jnp.zeros_like(heading), heading]
    )
    return VesselState(pose=pose, velocity=jnp.zeros_like(pose), thrust=jnp.zeros_like(pose[:2]))


def hull_position(vessel: Vessel, state: VesselState) -> jax.Array:
    """Position (2,) [m] of the hull's reference point: the workspace position p, and what the
    sensors report.
    """
    heading = state.pose[2]
    return state.pose[:2] + vessel.hull_offset * jnp.stack([jnp.cos(heading), jnp.sin(heading)])


def hull_pose(vessel: Vessel, state: VesselState) -> jax.Array:
    """Position [m] of the hull's reference point and heading [rad], stacked (3,)."""
    return jnp.concatenate([hull_position(vessel, state), state.pose[2:]])


def steady_thrust(vessel: Vessel, command: jax.Array) -> jax.Array:
    """Steady force (2,) [N] for the commands (2,) in [-1, 1]: linear interpolation of the tables.

    A sum of hat functions rather than a search: no gather, so a batch stays vectorised.
    """
    cells = vessel.thrust_table.shape[1] - 1
    cell = (command + 1.0) * (0.5 * cells)
    hats = jnp.maximum(
        1.0 - jnp.abs(cell[:, None] - jnp.arange(cells + 1, dtype=command.dtype)[None]), 0.0
    )
    return (hats * vessel.thrust_table.astype(command.dtype)).sum(axis=1)
