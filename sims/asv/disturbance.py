"""What water, build and sensors do to a run: named laws; one draw frozen per episode, noise per
control step.

| uniform in                        | "none" | "study" | "full" | unit |
|-----------------------------------|--------|---------|--------|------|
| thrust gain, both propellers, 1 ± | 0      | 0.5     | 0.5    | 1    |
| mass 35.96 ±                      | 0      | 1       | 1      | kg   |
| steady force, body axes, up to    | 0      | 0.5     | 1.768  | N    |
| steady torque ±                   | 0      | 0.1     | 1      | N m  |
| waves: force, torque, up to       | 0      | 0       | 1.768, 1 | N, N m |
| each drag coefficient, 1 ±        | 0      | 0       | 0.1    | 1    |
| position noise ±                  | 0      | 0.015   | 0.03   | m    |
| velocity and yaw rate noise ±     | 0      | 0.015   | 0.03   | m/s, rad/s |
| heading noise ±                   | 0      | 0.025   | 0.025  | rad  |
| command noise ±                   | 0      | 0.05    | 0.05   | 1    |

"study" is the level at which the published hovering data can be met, "full" the level the published
capture policies were trained and tested at.
"""

import math
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

from parc_jax.common import struct
from parc_jax.common.errors import InputError


@dataclass(frozen=True)
class Law:
    """Half widths of the uniform draws; see the module's table. Hashable, so it is static under
    jit.
    """

    name: str
    thrust_gain: float = 0.0  # [1]
    mass: float = 0.0  # [kg]
    force: float = 0.0  # [N]
    torque: float = 0.0  # [N m]
    wave_force: float = 0.0  # [N]
    wave_torque: float = 0.0  # [N m]
    drag: float = 0.0  # [1]
    position_noise: float = 0.0  # [m]
    velocity_noise: float = 0.0  # [m/s] and [rad/s]
    heading_noise: float = 0.0  # [rad]
    command_noise: float = 0.0  # [1]
    noisy: bool = field(init=False)

    def __post_init__(self):
        noises = (self.position_noise, self.velocity_noise, self.heading_noise, self.command_noise)
        object.__setattr__(self, "noisy", any(noises))


_FULL_FORCE = 2.5 / math.sqrt(2.0)  # [N]
LAWS = {
    law.name: law
    for law in (
        Law("none"),
        Law(
            "study",
            thrust_gain=0.5,
            mass=1.0,
            force=0.5,
            torque=0.1,
            position_noise=0.015,
            velocity_noise=0.015,
            heading_noise=0.025,
            command_noise=0.05,
        ),
        Law(
            "full",
            thrust_gain=0.5,
            mass=1.0,
            force=_FULL_FORCE,
            torque=1.0,
            wave_force=_FULL_FORCE,
            wave_torque=1.0,
            drag=0.1,
            position_noise=0.03,
            velocity_noise=0.03,
            heading_noise=0.025,
            command_noise=0.05,
        ),
    )
}


def named_law(name: str) -> Law:
    """The law of that name. Raises InputError."""
    if name not in LAWS:
        raise InputError(f"asv law: expected one of {', '.join(LAWS)}; got {name!r}.")
    return LAWS[name]


@struct.dataclass
class Disturbance:
    """One episode's draw; constant over the episode.

    mass, thrust_gain: () [kg], [1]. force: (2,) [N] and torque: () [N m], steady, body axes.
    Waves add force_i = amplitude sin(number_i p_i + phase_i) and a torque of the same form in p_x +
    p_y, where p is the
    position *since the start*: the field moves with p0, so the law, like the vessel, does not know
    where it started.
    wave_force: () [N], wave_number, wave_phase: (2,) [rad/m], [rad]; the torque's are ().
    linear_drag_factor, quadratic_drag_factor: (3,) multiply the vessel's coefficients.
    """

    mass: jax.Array
    thrust_gain: jax.Array
    force: jax.Array
    torque: jax.Array
    wave_force: jax.Array
    wave_number: jax.Array
    wave_phase: jax.Array
    wave_torque: jax.Array
    torque_wave_number: jax.Array
    torque_wave_phase: jax.Array
    linear_drag_factor: jax.Array
    quadratic_drag_factor: jax.Array


def draw_disturbance(key: jax.Array, law: Law, nominal_mass: float) -> Disturbance:
    """The episode's disturbance: 19 uniform numbers from `key`, scaled by the law. Same key, same
    draw.
    """
    u = jax.random.uniform(key, (19,), jnp.result_type(float))
    sym = 2.0 * u - 1.0
    direction = 2.0 * math.pi * u[3]
    return Disturbance(
        mass=nominal_mass + law.mass * sym[0],
        thrust_gain=1.0 + law.thrust_gain * sym[1],
        force=law.force * u[2] * jnp.stack([jnp.cos(direction), jnp.sin(direction)]),
        torque=law.torque * sym[4],
        wave_force=law.wave_force * u[5],
        wave_number=0.25 + 2.75 * u[6:8],
        wave_phase=100.0 * u[8:10],
        wave_torque=law.wave_torque * u[10],
        torque_wave_number=0.25 + 2.75 * u[11],
        torque_wave_phase=100.0 * u[12],
        linear_drag_factor=1.0 + law.drag * sym[13:16],
        quadratic_drag_factor=1.0 + law.drag * sym[16:19],
    )


def body_load(law: Law, d: Disturbance, position: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Disturbing force (2,) [N] and torque () [N m] in body axes at `position` (2,) [m] since the
    start.
    """
    if not (law.wave_force or law.wave_torque):
        return d.force, d.torque
    force = d.force + d.wave_force * jnp.sin(d.wave_number * position + d.wave_phase)
    return force, d.torque + d.wave_torque * jnp.sin(
        d.torque_wave_number * position.sum() + d.torque_wave_phase
    )
