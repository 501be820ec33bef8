"""The rigid body as a MuJoCo model, one `mjx.forward` per evaluation."""

import contextlib
import functools
import io

from sims.drift_parking import params as c

# Planar joints in the order x, y, yaw. Nothing can touch anything: no geometry collides and no joint has a limit, so
# MuJoCo's acceleration is the unconstrained one. The yaw joint passes through the centre of mass.
MODEL = f"""
<mujoco model="drift_parking">
  <option timestep="{c.STEP}" gravity="0 0 0">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body name="car">
      <inertial pos="0 0 0" mass="{c.MASS}" diaginertia="500 {c.YAW_INERTIA} {c.YAW_INERTIA}"/>
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="yaw" type="hinge" axis="0 0 1"/>
      <geom type="box" size="{0.5 * c.BODY_LENGTH} {0.5 * c.BODY_WIDTH} 0.5" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""


@functools.cache
def mujoco_body():
    """A plant (see vehicle.Plant) that asks MuJoCo for the accelerations. Needs mujoco and mujoco-mjx."""
    import jax.numpy as jnp

    with contextlib.redirect_stdout(io.StringIO()):  # importing mjx prints when an optional package is missing
        import mujoco
        from mujoco import mjx

    host_model = mujoco.MjModel.from_xml_string(MODEL)

    def accelerations(z, cos_yaw, sin_yaw, wrench):
        """World-frame generalised forces in, world-frame accelerations out, turned back into body axes."""
        model = mjx.put_model(host_model)
        force = jnp.stack(
            [cos_yaw * wrench.fx - sin_yaw * wrench.fy, sin_yaw * wrench.fx + cos_yaw * wrench.fy, wrench.moment]
        )
        velocity = jnp.stack([z.ux * cos_yaw - z.uy * sin_yaw, z.ux * sin_yaw + z.uy * cos_yaw, z.yaw_rate])
        data = mjx.make_data(model).replace(qpos=jnp.stack([z.x, z.y, z.yaw]), qvel=velocity, qfrc_applied=force)
        ax, ay, yaw_acceleration = mjx.forward(model, data).qacc
        return cos_yaw * ax + sin_yaw * ay, cos_yaw * ay - sin_yaw * ax, yaw_acceleration

    return accelerations
