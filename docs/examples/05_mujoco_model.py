"""Door 4: a MuJoCo model file with a controller, stepped by MJX."""

import runpy
from pathlib import Path

import jax
import jax.numpy as jnp

import parc_jax as pj
from sims.mjx_system import mjx_system

MODEL = """
<mujoco>
  <option timestep="0.05" integrator="implicitfast" gravity="0 0 0">
    <flag contact="disable"/>
  </option>
  <worldbody>
    <body name="puck">
      <joint name="x" type="slide" axis="1 0 0" damping="2"/>
      <joint name="y" type="slide" axis="0 1 0" damping="2"/>
      <joint name="yaw" type="hinge" axis="0 0 1" damping="1"/>
      <geom type="cylinder" size="0.1 0.05" mass="1"/>
    </body>
  </worldbody>
  <actuator>
    <motor joint="x" gear="1"/>
    <motor joint="y" gear="1"/>
    <motor joint="yaw" gear="0.02"/>
  </actuator>
</mujoco>
"""


def controller(qpos, qvel, time, k):
    """k = (x, y), where to go [m]: a spring and a damper; the yaw follows y."""
    wanted = jnp.array([k[0], k[1], k[1]])
    return 40 * (wanted - qpos) - 10 * qvel


def push(key, k, data):
    """A disturbance per run: the puck starts with a little velocity."""
    return data.replace(qvel=0.05 * jax.random.normal(key, data.qvel.shape, data.qvel.dtype))


def system():
    """The black box. `model` may be the path of an MJCF file as well."""
    return mjx_system(
        MODEL,
        controller,
        pj.box([0.5, -0.5], [1.0, 0.5]),
        pj.learning.time_grid(dt=0.1, t_f=1.0, dt_record=0.05),
        n_p=2,
        n_q=1,
        final=lambda qpos, qvel: qpos[2:],
        start=push,
        name="puck",
    )


if __name__ == "__main__":
    key, puck = jax.random.PRNGKey(0), system()
    gap = pj.learning.translation_gap(puck, key, starts=[[0.5, -0.3]])
    print(
        "moving the start moves the run by",
        gap.p,
        "m: this controller pulls towards a place, not by an offset",
    )
    assert gap.p.max() > 0.1  # so it is made relative to where it starts

    def relative(qpos, qvel, time, k):
        """The same controller around the place where the puck is: velocity control."""
        return 20 * (jnp.array([k[0], k[1], k[1]]) * (1.5 - time) - qvel)

    puck = mjx_system(
        MODEL,
        relative,
        puck.domain,
        puck.time,
        n_p=2,
        n_q=1,
        final=puck.final,
        start=push,
        name="puck",
    )
    assert pj.learning.translation_gap(puck, key, starts=[[0.5, -0.3]]).p.max() < 1e-9
    ask = runpy.run_path(str(Path(__file__).with_name("02_jax_function.py")))["ask"]
    answer = ask(puck, key)
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
