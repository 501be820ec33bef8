"""A program run entry by entry gives what it gives as it is, in fewer operations."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from parc_jax.common.arrays import x64
from sims.entrywise import entrywise
from sims.quiet import lenient, quiet_import

# nothing of it is diagonal: two hinges that carry each other about a slide that leans
ARM = """
<mujoco>
  <option jacobian="sparse"><flag contact="disable" constraint="disable"/></option>
  <worldbody>
    <body name="cart">
      <joint name="along" type="slide" axis="1 0 0.5" damping="0.3"/>
      <geom type="box" size="0.3 0.1 0.1" mass="2"/>
      <body name="upper" pos="0 0 0.1">
        <joint name="shoulder" type="hinge" axis="0 1 0.2" stiffness="3" armature="0.1"/>
        <geom type="capsule" fromto="0 0 0 0 0.1 0.5" size="0.03" mass="1"/>
        <body name="lower" pos="0 0.1 0.5">
          <joint name="elbow" type="hinge" axis="0.3 1 0"/>
          <geom type="capsule" fromto="0 0 0 0.2 0 0.4" size="0.02" mass="0.5"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(autouse=True)
def double():
    with x64():
        yield


def acceleration(xml: str):
    """qacc (n,) of qpos, qvel and force (n,) as MJX tells it."""
    import mujoco

    mjx = quiet_import("mujoco.mjx")
    host = mujoco.MjModel.from_xml_string(xml)

    def forward(position, velocity, force):
        model = mjx.put_model(host)
        data = mjx.make_data(model).replace(qpos=position, qvel=velocity, qfrc_applied=force)
        with lenient():
            return mjx.forward(model, data).qacc

    return forward


def by_entries(fun):
    return lambda *x: jnp.stack(jnp.broadcast_arrays(*entrywise(fun)(*x)[0]))


@pytest.mark.smoke
def test_a_program_of_all_kinds_of_steps_is_the_same():
    rng = np.random.default_rng(0)
    known = np.array([[0.0, 1.0, 2.0], [1.0, 0.0, 0.0]])

    def program(x, y):
        turned = jnp.stack([x, y[:3]]).T @ known  # (3, 3)
        picked = turned[np.array([2, 0]), np.array([1, 2])]
        moved = jnp.zeros(5).at[np.array([4, 1, 9])].set(x, mode="drop").at[1].add(y[3])
        held = jnp.where(x[0] > y[0], jnp.maximum(jnp.abs(y[0]), y[1]), jnp.sqrt(1.0 + x[1] * x[1]))
        whole = (3.0 * y).astype(int) + jax.lax.rem(-5.0 - x[0], 2.0).astype(int)
        parts = (
            0.0 - x,
            picked,
            moved[::2],
            (turned @ turned.T).ravel(),
            held[None],
            whole.astype(float),
        )
        return jnp.concatenate(parts)

    x, y = rng.normal(size=(3, 6)), rng.normal(size=(4, 6))
    want = jax.jit(jax.vmap(program, in_axes=-1, out_axes=-1))(x, y)
    found = jax.jit(by_entries(program))(x, y)
    np.testing.assert_allclose(found, want, rtol=1e-13, atol=1e-13)


def test_a_step_that_is_not_known_is_run_as_it_is_and_said():
    def program(x, y):
        return jax.lax.fori_loop(0, 3, lambda _, z: jnp.sort(z) * y, x), x[:1]

    x, y = np.random.default_rng(2).normal(size=(2, 3, 6))
    want = jax.vmap(program, in_axes=-1, out_axes=-1)(x, y)
    with pytest.warns(UserWarning, match="entrywise: .* run as it is"):
        found = jax.jit(entrywise(program))(x, y)
    for one, other in zip(found, want, strict=True):
        np.testing.assert_allclose(np.stack(one), other, rtol=1e-13)


@pytest.mark.smoke
@pytest.mark.slow
def test_an_arm_that_is_nowhere_diagonal_accelerates_as_mujoco_says():
    """The oracle is MuJoCo's C engine: it shares no code with either."""
    import mujoco

    host = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(host)
    x = np.random.default_rng(1).normal(size=(3, 3, 40))
    found = jax.jit(by_entries(acceleration(ARM)))(*x)
    for i in range(x.shape[-1]):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = x[:, :, i]
        mujoco.mj_forward(host, data)
        np.testing.assert_allclose(found[:, i], data.qacc, rtol=1e-9, atol=1e-9)
