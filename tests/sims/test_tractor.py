"""The tractor and its trailer against MuJoCo's own engine: where sites are, and that parts are
rigid and turn against each other.
"""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims
from parc_jax.common.errors import InputError
from parc_jax.problem.body import numbered
from sims.mjx_system import mjx_system
from sims.tractor.system import POINTS, TRACTOR, TRAILER, XML, drive, some_start

KEYS = drawn_keys(3, 3)
KS = np.array([[2.0, 1.2], [3.0, 1.5], [4.0, 1.05]])
OF = {name: i for i, name in enumerate(POINTS)}


@pytest.fixture(scope="module")
def tractor():
    return sims.load("tractor")


@pytest.fixture(scope="module")
def runs(tractor):
    return np.asarray(jax.jit(jax.vmap(tractor.rollout))(KEYS, jnp.asarray(KS)).p)


def by_the_engine(tractor, key, k) -> np.ndarray:
    """The same run in MuJoCo's C engine: places (n_record + 1, 9, 2) of the sites."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(XML))
    data = mujoco.MjData(model)
    control = jax.jit(drive)

    class Start:
        qpos, qfrc_applied = jnp.zeros(model.nq), jnp.zeros(model.nv)

        def replace(self, qpos, qfrc_applied):
            data.qpos[:], data.qfrc_applied[:] = qpos, qfrc_applied

    some_start(key, k, Start())
    places = []
    for record in range(tractor.time.n_record + 1):
        for _ in range(tractor.steps if record else 0):
            data.ctrl[:] = control(data.qpos, data.qvel, data.time, k)
            mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        places.append([data.site(name).xpos[:2].copy() for name in POINTS])
    return np.array(places) - np.array(places[0][0])


@pytest.mark.night
def test_points_are_the_sites_of_the_engine(tractor, runs):
    assert runs.shape == (3, 161, 9, 2) and (runs[:, 0, 0] == 0).all()
    for row in range(2):
        want = by_the_engine(tractor, KEYS[row], jnp.asarray(KS[row]))
        # a site that lags by one step would be 1.6 m/s x 0.01 s off
        np.testing.assert_allclose(runs[row], want, rtol=0, atol=1e-4)


@pytest.mark.night
def test_each_part_is_rigid_and_they_turn_against_each_other(runs):
    for part in (TRACTOR, TRAILER):
        for a, b in itertools.combinations(part, 2):
            apart = np.linalg.norm(runs[:, :, OF[a]] - runs[:, :, OF[b]], axis=-1)
            assert np.ptp(apart) < 1e-9
    across = np.linalg.norm(runs[:, :, OF[TRACTOR[0]]] - runs[:, :, OF[TRAILER[1]]], axis=-1)
    assert (np.ptp(across, axis=1) > 0.3).all()


def test_the_body_has_two_parts():
    problem = sims.tractor.problem()
    tractor, trailer = numbered(problem.body, POINTS)
    assert (tractor.points, trailer.points) == ((1, 2, 3, 4), (5, 6, 7, 8))
    assert problem.goal.n == 18 and not problem.goal.A[:, 10:].any()


def test_points_that_are_no_sites_are_refused(tractor):
    with pytest.raises(InputError, match=r"sites of the MuJoCo model \(rear axle, .*'mirror'"):
        mjx_system(XML, drive, tractor.domain, tractor.time, points=("rear axle", "mirror"))
