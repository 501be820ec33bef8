"""The rigid body as a MuJoCo model, one `mjx.forward` per evaluation, run entry by entry."""

import functools

from sims.drift_parking import params as c
from sims.entrywise import entrywise
from sims.quiet import lenient, quiet_import

# Planar joints in the order x, y, yaw. Nothing can touch anything: no geometry collides and no
# joint has a limit, so MuJoCo's acceleration is the unconstrained one. The yaw joint passes through
# the centre of mass.
MODEL = f"""
<mujoco model="drift_parking">
  <option jacobian="sparse" timestep="{c.STEP}" gravity="0 0 0">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body name="car">
      <inertial pos="0 0 0" mass="{c.MASS}" diaginertia="500 {c.YAW_INERTIA} {c.YAW_INERTIA}"/>
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="yaw" type="hinge" axis="0 0 1"/>
      <geom type="box" size="{0.5 * c.BODY_LENGTH} {0.5 * c.BODY_WIDTH} 0.5"
            contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""


@functools.cache
def mujoco_body():
    """A plant (see vehicle.Plant) that asks MuJoCo for the accelerations. Needs mujoco and
    mujoco-mjx.
    """
    import jax
    import mujoco

    mjx = quiet_import("mujoco.mjx")
    host_model = mujoco.MjModel.from_xml_string(MODEL)

    def forward(position, velocity, force):
        """Acceleration (3,) of (x, y, yaw) under a generalised force (3,), all in world axes."""
        model = mjx.put_model(host_model)
        data = mjx.make_data(model).replace(qpos=position, qvel=velocity, qfrc_applied=force)
        with lenient():
            return mjx.forward(model, data).qacc

    # traced once, however often and in however many places the vehicle evaluates it
    by_entries = jax.jit(entrywise(forward))

    def accelerations(z, cos_yaw, sin_yaw, wrench):
        """Body-frame forces are turned to world axes for MuJoCo, its accelerations back to body
        axes.
        """
        fx, fy = (
            cos_yaw * wrench.fx - sin_yaw * wrench.fy,
            sin_yaw * wrench.fx + cos_yaw * wrench.fy,
        )
        vx, vy = z.ux * cos_yaw - z.uy * sin_yaw, z.ux * sin_yaw + z.uy * cos_yaw
        world = (z.x, z.y, z.yaw), (vx, vy, z.yaw_rate), (fx, fy, wrench.moment)
        [(ax, ay, yaw_acceleration)] = by_entries(*world)
        return cos_yaw * ax + sin_yaw * ay, cos_yaw * ay - sin_yaw * ax, yaw_acceleration

    return accelerations
