"""The robot's physics against closed forms and laws: how fast it turns, how far it goes, that it is
the same to either side, gains nothing while coasting, and brakes no harder than friction allows.
"""

import mujoco
import numpy as np
import pytest
from drawn_keys import drawn_keys

from sims.jackal import params as c
from sims.jackal.floor import LAWS, draw
from sims.jackal.robots import XML, Robots, model, wheel_speeds

G = 9.81
KEY = drawn_keys(1, 1)
AT_ORIGIN = np.zeros((1, 3))


def robot(law="none", pose=AT_ORIGIN) -> Robots:
    return Robots(LAWS[law], draw(LAWS[law], KEY), pose, threads=1)


def held(command, seconds: float, ramp=c.RAMP, robots: Robots | None = None) -> np.ndarray:
    """Poses (n + 1, 3) of one robot under a command from rest."""
    commands = np.tile(np.array(command), (round(seconds / c.TICK), 1, 1))
    return (robots or robot()).drive(commands, ramp)[:, 0]


def test_the_outline_holds_all_of_the_robot_and_its_wheels():
    m = model()
    around = np.zeros(2)
    for i in np.flatnonzero(m.geom_bodyid > 0):
        place = m.geom_pos[i] + m.body_pos[m.geom_bodyid[i]] * (m.geom_bodyid[i] > 1)
        around = np.maximum(around, np.abs(place[:2]) + m.geom_size[i, :2])
    length, width = c.SIZES["rectangle"]
    assert length / 2 - 1e-3 < around[0] <= length / 2 and width / 2 - 1e-3 < around[1] <= width / 2


@pytest.mark.parametrize("rate", [0.4, -1.2])
def test_it_turns_in_place_as_the_balance_of_moments_demands(rate):
    """Tyres that grip alike along and across, wheels that all slip: along slip t/2 W - v, across
    l/2 W, and no moment is left when v = W (t^2 + l^2) / 2t, whatever the law of slip."""
    turned = held((0.0, rate), 3.0)[:, 2]
    wheels = wheel_speeds(np.array([0.0, rate]))[1] * c.WHEEL_RADIUS
    balance = 2 * c.TRACK * wheels / (c.TRACK**2 + c.WHEELBASE**2)
    assert (turned[-1] - turned[-51]) / 1.0 == pytest.approx(balance, rel=0.04)
    # which is why Clearpath's controller believes in a track half as wide again
    assert 1 + (c.WHEELBASE / c.TRACK) ** 2 == pytest.approx(c.TRACK_FACTOR, rel=0.01)


@pytest.mark.parametrize("speed", [0.2, 0.6])
def test_a_slow_drive_is_as_long_as_its_set_points(speed):
    robots = robot()
    there = held((speed, 0.0), 1.0, robots=robots)
    end = held((0.0, 0.0), 1.0, robots=robots)[-1]
    assert end[0] == pytest.approx(speed * 1.0, rel=0.02)  # the two ramps make up for each other
    assert abs(end[1]) < 1e-3 and abs(end[2]) < 1e-3
    assert there[-1, 0] < end[0]


def test_it_brakes_no_harder_than_friction_allows():
    robots = robot()
    held((2.0, 0.0), 1.5, robots=robots)
    way = held((0.0, 0.0), 1.0, ramp=(100.0, 100.0), robots=robots)[:, 0]
    speed = np.diff(way) / c.TICK
    harder = (speed[:-5] - speed[5:]) / (5 * c.TICK)
    assert harder.max() < 0.5 * G * 1.1
    # locked wheels slide about as far as Coulomb says
    assert way[-1] - way[0] == pytest.approx(speed[0] ** 2 / (2 * 0.5 * G), rel=0.25)


def test_the_controller_keeps_its_published_limits():
    robots = robot()
    asked = []
    for _ in range(30):
        robots.drive(np.array([[[9.0, 9.0]]]), (1e9, 1e9))
        asked.append(robots.set_point[0].copy())
    asked = np.array(asked)
    assert asked[-1].tolist() == list(c.MOST)
    steps = np.diff(asked, axis=0).max(axis=0) / c.TICK
    np.testing.assert_allclose(steps, c.MOST_CHANGE, rtol=1e-9)


def coasting(velocity, actuated: bool = False, steps: int = 400) -> np.ndarray:
    """Mechanical energy (steps,) [J] of a robot let go with velocity (3,) [m/s], wheels rolling."""
    m = mujoco.MjModel.from_xml_path(str(XML))
    m.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    if not actuated:
        m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    data = mujoco.MjData(m)
    mujoco.mj_step(m, data, 400)
    data.qvel[:3] = velocity
    for wheel in c.WHEELS:
        data.joint(wheel).qvel[0] = velocity[0] / c.WHEEL_RADIUS
    data.ctrl[:] = 30.0
    energy = []
    for _ in range(steps):
        mujoco.mj_step(m, data)
        energy.append(data.energy.sum())
    return np.array(energy)


@pytest.mark.parametrize("velocity", [(2, 0, 0), (0, 2, 0), (1.5, 1, 0)])
def test_coasting_gains_no_energy(velocity):
    energy = coasting(velocity)
    gained = np.maximum.accumulate(energy - np.minimum.accumulate(energy))[-1]
    assert gained < 0.1 and energy[-1] < energy[0]  # [J] of some 40 in all


def test_ticks_are_mujoco_step_by_step():
    robots = robot("floor")
    twin = robots.batch.get_data(0)
    m = robots.batch.get_model(0)
    for _ in range(40):
        robots.step(np.array([[1.5, 1.0]]))
        twin.ctrl[:] = robots.ctrl[0]
        mujoco.mj_step(m, twin, c.SUBSTEPS)
        np.testing.assert_array_equal(robots.qpos[0], twin.qpos)


def test_a_pushed_robot_has_the_speeds_asked_for_and_does_not_slip():
    robots = robot(pose=np.array([[3.0, -2.0, 2.0]]))
    robots.push(np.array([[1.2, 0.0]]))
    np.testing.assert_allclose(robots.speeds, [[1.2, 0.0, 0.0]], atol=1e-4)
    robots.step(np.array([[1.2, 0.0]]))
    np.testing.assert_allclose(robots.encoders * c.WHEEL_RADIUS, np.full((1, 4), 1.2), atol=0.02)
    np.testing.assert_allclose(robots.speeds, [[1.2, 0.0, 0.0]], atol=0.02)
    np.testing.assert_allclose(robots.pose[:, 2], 2.0, atol=1e-3)
