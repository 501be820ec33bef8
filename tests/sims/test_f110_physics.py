"""The car's physics: a batch is MuJoCo itself, no slide is harder than friction, failures show."""

import mujoco
import numpy as np
import pytest

from sims.f110 import params as c
from sims.f110.car import XML, ackermann
from sims.f110.disturbance import LAWS, draw
from sims.f110.simulate import simulate

G = 9.81


@pytest.fixture(scope="module")
def drift():
    """One nominal run, and the same commands given to a single MjData: contacts (ticks, 4, 2)
    normal and tangential.
    """
    draws = draw(LAWS["none"], np.zeros((1, 2), np.uint32), 588)
    run = simulate(np.array([[-1.4, 2.8]]), draws, keep_qpos=True)
    return run, *driven(mujoco.MjModel.from_xml_path(str(XML)), run.commands[0])


def driven(model, commands):
    """The MjData after the commands, and friction, normal and tangential force (n, 3) of every
    contact on the way.
    """
    data, forces = mujoco.MjData(model), []
    for steer, speed, brake in commands:
        data.ctrl[0], data.ctrl[1] = ackermann(np.array(steer))
        data.ctrl[2:4], data.ctrl[4:] = speed / c.WHEEL_RADIUS, brake
        mujoco.mj_step(model, data, c.SUBSTEPS)
        wrench = np.zeros(6)
        for i in range(data.ncon):
            mujoco.mj_contactForce(model, data, i, wrench)
            forces.append((data.contact[i].friction[0], wrench[0], np.hypot(wrench[1], wrench[2])))
    return data, np.array(forces)


@pytest.mark.slow
def test_a_batch_is_mujoco_step_by_step(drift):
    run, data, _ = drift
    np.testing.assert_array_equal(run.qpos[0, -1], data.qpos)


def test_the_car_slides_no_harder_than_friction_allows(drift):
    speed = drift[0].velocity[0, :, :2]
    every = 12
    harder = np.linalg.norm(speed[every:] - speed[:-every], axis=1) / (every * c.TICK)
    assert harder.max() < 0.36 * G * 1.1


@pytest.mark.night
def test_a_run_that_blows_up_is_marked_and_leaves_the_others_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warning into a file beside us
    ks, keys = np.tile([[-1.4, 2.8]], (3, 1)), np.zeros((3, 2), np.uint32)
    sound = draw(LAWS["none"], keys, 40)
    sick = sound._replace(start=sound.start.copy())
    sick.start[1, 0] = 1e12
    good, bad = simulate(ks, sound, 40), simulate(ks, sick, 40)
    assert bad.failed.tolist() == [False, True, False] and not good.failed.any()
    assert np.isnan(bad.measured[1]).all()
    np.testing.assert_array_equal(bad.pose[[0, 2]], good.pose[[0, 2]])
