"""crazyflow's drone and its slot: rigid, level and hovering, the scene against the drone's size,
and a machine without crazyflow.
"""

import importlib.util
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys
from needs import need

import parc_jax as pj
import sims
from parc_jax.common.errors import InputError
from sims.foreign.slot import params as c
from sims.foreign.slot.pilot import ACROSS, FRAME
from sims.foreign.slot.replays import clear_along_an_axis
from sims.foreign.slot.scenario import AT, problem
from sims.foreign.slot.system import CORNERS, POINTS, system

KEYS = drawn_keys(4, 4)
KS = np.array([[2.2, 1.2, 0.0], [1.3, 0.85, -0.03], [2.4, 1.3, 0.03], [1.8, 1.0, 0.01]])


@pytest.fixture(scope="module")
def drone():
    need("crazyflow")
    return sims.load("slot")


@pytest.fixture(scope="module")
def runs(drone):
    p, q = jax.jit(jax.vmap(drone.rollout))(KEYS, jnp.asarray(KS))
    assert p.shape == (4, 301, 9, 3) and q.shape == (4, 3)
    return np.asarray(p) @ FRAME, np.asarray(q)  # in the world


def axes(p):
    """Unit vectors (..., 3, 3) of a drone with places p (..., 9, 3): along, across and up."""
    corner = {name: p[..., 1 + i, :] for i, name in enumerate(CORNERS)}
    first = corner["front left top"]
    others = ("rear left top", "front right top", "front left bottom")
    return np.stack([first - corner[name] for name in others], axis=-2) / np.array(c.SIZE)[:, None]


@pytest.mark.night
def test_it_starts_level_at_the_origin_and_ends_hovering(runs):
    p, q = runs
    assert (p[:, 0, 0] == 0).all()
    np.testing.assert_allclose(axes(p[:, 0]), np.array([np.eye(3)] * 4), atol=1e-14)
    assert np.abs(q).max() < 0.25 and np.abs(p[:, -1, 0, 1:]).max() < 0.05
    assert (axes(p[:, -1])[:, 2, 2] > np.cos(0.15)).all()


@pytest.mark.night
def test_the_box_is_rigid(runs):
    p, _ = runs
    turn = axes(p)
    np.testing.assert_allclose(turn @ np.swapaxes(turn, -1, -2), np.eye(3) + 0 * turn, atol=1e-12)
    np.testing.assert_allclose(p[:, :, 1:].mean(axis=2), p[:, :, 0], atol=1e-12)


def test_the_slot_is_inclined_and_lower_than_the_drone_is_wide():
    scene = problem(0.08)
    assert scene.goal.n == 3 * len(POINTS) + 3 and [o.n for o in scene.obstacles] == [3] * 4
    np.testing.assert_allclose(FRAME @ FRAME.T, np.eye(3), atol=1e-15)
    assert np.isclose(np.degrees(np.arccos(ACROSS[2])), 60.0)
    arms = 0.5 * np.array(c.SIZE) * np.array([[0, y, z] for y in (1, -1) for z in (1, -1)])
    held = [
        np.any([o.contains(AT + part) for o in scene.obstacles]) for part in (arms, arms @ FRAME.T)
    ]
    assert held == [False, True]


def test_the_proved_body_is_crazyflows_box_and_holds_all_that_is_drawn():
    """Guards included; but for two diffusers of light, which are drawn transparent."""
    need("crazyflow")
    import mujoco

    from sims.foreign.slot.film import drone

    model = drone(mujoco).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    shape = model.geom("col_box")
    np.testing.assert_allclose(2 * shape.size, c.SIZE)
    assert not shape.pos.any()
    glass = [i for i in range(model.nmat) if model.mat_rgba[i, 3] == 0]
    seen = [
        i
        for i in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)
        if model.geom_matid[i] not in glass
    ]
    assert {model.mesh(model.geom_dataid[i]).name for i in seen} >= {"prop-guards", "propL", "pcb"}
    for geom in seen:
        mesh = model.geom_dataid[geom]
        first, many = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        turn = data.geom_xmat[geom].reshape(3, 3)
        places = model.mesh_vert[first : first + many] @ turn.T + data.geom_xpos[geom]
        assert (np.abs(places) <= np.array(c.SIZE) / 2).all()


def test_a_run_beyond_a_wall_along_an_axis_is_clear_and_one_through_it_is_not():
    wall = pj.box([0.4, -1.0, -1.0], [0.5, 1.0, 1.0])
    corners = np.array(list(itertools.product((0.05, -0.05), repeat=3)))
    arms = np.concatenate([np.zeros((1, 3)), corners])
    steps = np.linspace(0.0, 1.0, 4)[:, None]
    below, through = (np.array(w) for w in ([0.0, 0.0, -1.2], [0.0, 0.0, 0.0]))
    ways = [start + steps * np.array([1.0, 0.0, 0.0]) for start in (below, through)]
    path = np.array([way[:, None] + arms for way in ways]).reshape(2, 4, 27)
    assert clear_along_an_axis(path, [wall]).tolist() == [True, False]  # no record is in the wall


def test_without_crazyflow_it_says_what_to_install(monkeypatch, capsys):
    from parc_jax.app.cli import main

    find = importlib.util.find_spec

    def hidden(name, package=None):
        return None if name == "crazyflow" else find(name, package)

    monkeypatch.setattr(importlib.util, "find_spec", hidden)
    with pytest.raises(InputError, match=r"pip install 'parc_jax\[drone\]'"):
        system()
    with pytest.raises(SystemExit, match="2"):
        main(["run", "slot", "--quiet"])
    assert "parc_jax[drone]" in capsys.readouterr().err
