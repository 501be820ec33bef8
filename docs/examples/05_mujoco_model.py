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
    <motor joint="x"/> <motor joint="y"/> <motor joint="yaw" gear="0.02"/>
  </actuator>
</mujoco>
"""


def to_place(qpos, qvel, time, k):
    """k = (x, y), where to go [m]: a spring and a damper; the yaw follows y."""
    return 40 * (jnp.array([k[0], k[1], k[1]]) - qpos) - 10 * qvel


def by_velocity(qpos, qvel, time, k):
    """The same manoeuvre relative to the place where the puck is."""
    return 20 * (jnp.array([k[0], k[1], k[1]]) * (1.5 - time) - qvel)


def push(key, k, data):
    """A disturbance per run: the puck starts with a little velocity."""
    return data.replace(qvel=0.05 * jax.random.normal(key, data.qvel.shape, data.qvel.dtype))


def puck(controller):
    """The black box. MODEL may be the path of an MJCF file as well."""
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
    key, starts = jax.random.PRNGKey(0), [[0.5, -0.3]]
    gap = pj.learning.translation_gap(puck(to_place), key, starts).p
    print("pulled towards a place, a moved start moves the run by", gap, "m: refused")
    assert pj.learning.translation_gap(puck(by_velocity), key, starts).p.max() < 1e-9 < gap.max()

    ask = runpy.run_path(str(Path(__file__).with_name("02_jax_function.py")))["ask"]
    answer = ask(puck(by_velocity), key)
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
