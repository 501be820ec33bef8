"""MuJoCo models as black boxes: what does not fit is said at once. The physics is tested by the
example in docs.
"""

import pytest

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.system import BlackBoxSystem
from sims.mjx_system import mjx_system

MODEL = """
<mujoco><option timestep="0.02"/><worldbody><body>
  <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><geom size="0.1"/>
</body></worldbody></mujoco>
"""
DOMAIN, TIME = pj.box([0.0], [1.0]), pj.learning.time_grid(0.1, 1.0)


def none(qpos, qvel, time, k):
    return qpos[:0]


def test_a_model_is_a_black_box(tmp_path):
    (tmp_path / "puck.xml").write_text(MODEL)
    for model, name in ((MODEL, "mujoco"), (tmp_path / "puck.xml", "puck")):
        system = mjx_system(model, none, DOMAIN, TIME)
        assert isinstance(system, BlackBoxSystem) and system.name == name and system.steps == 5


def test_what_does_not_fit_is_refused(tmp_path):
    with pytest.raises(InputError, match="MJCF"):
        mjx_system(tmp_path / "none.xml", none, DOMAIN, TIME)
    with pytest.raises(InputError, match="MJCF"):
        mjx_system("<mujoco><worldbody><box/></worldbody></mujoco>", none, DOMAIN, TIME)
    with pytest.raises(InputError, match="whole number of its time steps"):
        mjx_system(MODEL, none, DOMAIN, pj.learning.time_grid(0.05, 1.0))
    with pytest.raises(InputError, match="at least 3 joint coordinates"):
        mjx_system(MODEL, none, DOMAIN, TIME, n_p=3)
