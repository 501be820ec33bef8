"""One physics step of the rigid body, twice: a MuJoCo body stepped by MJX, and the same step
written out in JAX.

Both take the load of the step (held over it) and do semi-implicit Euler: velocities first,
positions with the new ones. They differ by rounding only; a test holds them to it. "mjx" is the
default, "ode" its oracle and the fast path.
"""

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp

from parc_jax.common.errors import InputError
from sims.asv.vessel import PHYSICS_DT, Vessel
from sims.entrywise import entrywise
from sims.quiet import lenient, quiet_import

# (pose (3,), velocity (3,), load (3,) world force and yaw torque, mass ()) -> (pose, velocity)
# after PHYSICS_DT
Plant = Callable[[jax.Array, jax.Array, jax.Array, jax.Array], tuple[jax.Array, jax.Array]]

# Three joints at the centre of mass: the world-frame force and the yaw torque are the generalised
# forces. Nothing touches anything. Roll and pitch inertia cannot matter; the identified ones break
# the triangle inequality, so legal ones stand here. Sparse: MJX then
# factors in plain arithmetic.
_XML = """
<mujoco>
  <option jacobian="sparse" timestep="{dt}" integrator="Euler" gravity="0 0 0">
    <flag contact="disable"/>
  </option>
  <worldbody>
    <body name="hull">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="yaw" type="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="5 5 {inertia}"/>
    </body>
  </worldbody>
</mujoco>
"""


def make_plant(name: str, vessel: Vessel) -> Plant:
    """The physics step called "mjx" or "ode", in JAX's default float type. Raises InputError."""
    if name == "ode":
        return functools.partial(_ode_step, vessel.inertia)
    if name == "mjx":
        return functools.partial(
            _mjx_step, *_mjx_model(vessel.mass, vessel.inertia, jax.config.jax_enable_x64)
        )
    raise InputError(f"asv plant: expected 'mjx' or 'ode'; got {name!r}.")


def _ode_step(inertia, pose, velocity, load, mass):
    velocity = velocity + PHYSICS_DT * load / jnp.stack([mass, mass, jnp.full_like(mass, inertia)])
    return pose + PHYSICS_DT * velocity, velocity


@functools.cache
def _mjx_model(mass: float, inertia: float, x64: bool):
    import mujoco

    mjx = quiet_import("mujoco.mjx")
    xml = _XML.format(dt=PHYSICS_DT, mass=mass, inertia=inertia)
    with jax.ensure_compile_time_eval(), jax.enable_x64(x64), lenient():
        model = mjx.put_model(mujoco.MjModel.from_xml_string(xml))
        return model, mjx.make_data(model)


def _mjx_step(model, template, pose, velocity, load, mass):
    from mujoco import mjx

    def step(pose, velocity, load, mass):
        with lenient():
            heavy = model.replace(
                body_mass=model.body_mass.at[1].set(mass[0]),
                body_subtreemass=jnp.full_like(model.body_subtreemass, mass[0]),
            )
            held = template.replace(qpos=pose, qvel=velocity, qfrc_applied=load)
            data = mjx.step(heavy, held)
        return data.qpos, data.qvel

    pose, velocity = entrywise(step)(pose, velocity, load, [mass])
    return jnp.stack(pose), jnp.stack(velocity)
