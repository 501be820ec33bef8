"""MuJoCo models as black boxes: what does not fit is said at once, and places are those of MuJoCo's
world. The physics is tested by the example in docs.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
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


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("<body>", '<body euler="0 0 90">', r"number 1, raised by 1, moves body by \(.*, 1, 0\) m"),
        ("0 1 0", "0 -1 0", r"number 2, raised by 1, moves body by \(0, -1, 0\) m"),
        ("0 1 0", "0 0 1", r"along x, y of the world; number 2.*\(0, 0, 1\) m"),
        ('slide" axis="1 0 0', 'hinge" axis="0 0 1', "number 1.*Put slide joints"),
        ('slide" axis="0 1 0', 'hinge" axis="0 0 1', r"number 2.*\(0, 0, 0\) m"),
    ],
)
def test_joint_coordinates_that_are_no_places_are_refused(old, new, told):
    """A turned body, a mirrored axis, one that points up, angles: with and without a site."""
    text = MODEL.replace(old, new)
    assert text != MODEL
    with pytest.raises(InputError, match=told):
        mjx_system(text, none, DOMAIN, TIME)
    with pytest.raises(InputError, match="moves tip"):
        mjx_system(
            text.replace("<geom", '<site name="tip"/><geom'), none, DOMAIN, TIME, points=["tip"]
        )


@pytest.mark.slow
def test_places_are_those_of_the_world():
    """Joints in any bodies: p is where the body is that the last of them moves."""
    nested = """
    <mujoco><option timestep="0.02" gravity="0 0 0"/><worldbody><body pos="3 0 0">
      <joint type="slide" axis="1 0 0"/><geom size="0.1"/>
      <body pos="0 2 0"><joint type="slide" axis="0 1 0"/>
        <joint type="hinge" axis="0 0 1" pos="0.5 0 0"/><geom size="0.1"/></body>
    </body></worldbody></mujoco>"""

    def spun(key, k, data):
        return data.replace(qvel=jnp.array([0.0, 0.0, 1.0]))

    p = (
        mjx_system(nested, none, DOMAIN, TIME, start=spun)
        .rollout(jax.random.PRNGKey(0), jnp.ones(1))
        .p
    )
    assert p.shape == (11, 2) and np.abs(p).max() > 0.1


def test_two_models_are_two_subjects():
    """Neither name nor labels tell them apart: the law does, in any process, also of a copy."""
    heavy = MODEL.replace('size="0.1"', 'size="0.2"')
    laws = [mjx_system(text, none, DOMAIN, TIME).law for text in (MODEL, MODEL, heavy)]
    assert laws[0] == laws[1] and laws[0] | {"model": laws[2]["model"]} == laws[2] != laws[0]

    def other(qpos, qvel, time, k):
        return qpos[:0] + 0

    assert mjx_system(MODEL, other, DOMAIN, TIME).law["controller"] != laws[0]["controller"]
    copied = replace(mjx_system(MODEL, none, DOMAIN, TIME), controller=other)
    assert copied.law == mjx_system(MODEL, other, DOMAIN, TIME).law
    with pytest.raises(InputError, match="whole number of its time steps"):
        replace(copied, time=pj.learning.time_grid(0.05, 1.0))


@pytest.mark.soundness
def test_a_copy_that_tells_other_places_is_another_subject():
    """Its points changed places under the same names, and its law was the same."""
    text = MODEL.replace("<geom", '<site name="l" pos="0 0.1 0"/><site name="r"/><geom')
    one = mjx_system(text, none, DOMAIN, TIME, points=("l", "r"))
    assert replace(one, sites=one.sites).law == one.law != replace(one, sites=one.sites[::-1]).law
    assert one.law["sites"] == "(0, 1)"
    arm = MODEL.replace("</body>", '<body pos="1 0 0"><geom size="0.1"/></body></body>')
    body = mjx_system(arm, none, DOMAIN, TIME)
    assert replace(body, body=1).law == body.law != replace(body, body=2).law


class Lazy:
    """Takes its weights at the first call."""

    weights: np.ndarray | None = None

    def __call__(self, qpos, qvel, time, k):
        if self.weights is None:
            self.weights = np.ones(1)
        return self.weights * qpos[:0]


def test_a_controller_that_fills_what_it_keeps_at_its_first_call_is_the_same_robot():
    """It was refused when its runs were traced again, as for another number of them."""
    system = mjx_system(MODEL, (lazy := Lazy()), DOMAIN, TIME)
    for _ in range(2):
        jax.eval_shape(system.rollout, jax.random.PRNGKey(0), jnp.ones(1))
    assert mjx_system(MODEL, Lazy(), DOMAIN, TIME).law == system.law
    lazy.weights = np.zeros(1)
    with pytest.raises(InputError, match="as they were built; one was changed"):
        jax.eval_shape(system.rollout, jax.random.PRNGKey(0), jnp.ones(1))


def test_a_controller_that_cannot_be_traced_is_refused_with_its_line():
    with pytest.raises(InputError, match=r"can be traced; it fails in .*test_mjx_system.py, line"):
        mjx_system(MODEL, lambda q, v, t, k: q[:0] if k[0] > 0 else q[1:1], DOMAIN, TIME)


def test_a_controller_of_another_shape_is_refused_before_it_runs():
    """It was refused in the first run, by a line of ours."""
    with pytest.raises(InputError, match=r"controller: expected \(n_u,\), .* \(0,\); got \(2,\)"):
        mjx_system(MODEL, lambda q, v, t, k: q, DOMAIN, TIME)


@pytest.mark.slow  # compiles a model of its own, twice
@pytest.mark.parametrize("what", ["model", "controller"])
def test_what_is_changed_in_place_is_refused_also_after_runs(what):
    gain = np.ones(1)
    system = mjx_system(MODEL, lambda *about: gain[0] * about[0][:0], DOMAIN, TIME)
    pj.learning.collect(system, jax.random.PRNGKey(0), n=4, quiet=True)
    if what == "model":
        system.model.opt.gravity[0] = 5.0
    else:
        gain[0] = 2.0
    with pytest.raises(InputError, match="as they were built; one was changed"):
        pj.learning.collect(system, jax.random.PRNGKey(0), n=4, quiet=True)
