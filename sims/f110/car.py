"""The car in MuJoCo: the model file, and a batch of cars that differ as the draws say."""

import functools
from pathlib import Path

import numpy as np

from sims.f110 import params as c
from sims.f110.disturbance import Draws

XML = Path(__file__).with_name("f110.xml")


@functools.cache
def model():
    """The nominal car, compiled once."""
    import mujoco

    return mujoco.MjModel.from_xml_path(str(XML))


def batch_of_cars(draws: Draws, origin: np.ndarray, threads: int):
    """A mujoco.batch.Batch at its start poses (B), moved by origin (2,) [m]. threads: 0 = all
    cores.
    """
    from mujoco.batch import Batch

    m = model()
    cars = Batch(m, nsim=len(draws.mass), nthread=threads)
    body = m.body("car").id
    cars.expand("body_mass")[:, body] *= draws.mass
    cars.expand("body_inertia")[:, body] *= draws.mass[:, None]
    strength = (draws.motor * draws.battery)[:, None]
    drive = [m.actuator(f"drive_{side}").id for side in ("left", "right")]
    cars.expand("actuator_gainprm")[:, drive, 0] *= strength
    cars.expand("actuator_biasprm")[:, drive, 2] *= strength
    cars.expand("actuator_forcerange")[:, drive] *= strength[:, :, None]
    cars.set_const()
    cars.reset()
    qpos = cars.bind("qpos")
    qpos[:, :2] += draws.start[:, :2] + origin
    qpos[:, 3], qpos[:, 6] = np.cos(draws.start[:, 2] / 2), np.sin(draws.start[:, 2] / 2)
    return cars


def ackermann(steer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the left and right front wheel (B,) [rad] that turn about one point."""
    bend = np.tan(steer) / c.WHEELBASE
    forward, half = bend * c.WHEELBASE, 0.5 * c.TRACK * bend
    return np.arctan(forward / (1 - half)), np.arctan(forward / (1 + half))


def friction_under_wheels(draws: Draws, pose: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(B, 4) coefficients where the wheels stand. pose (B, 3): x, y, heading; patches lie in the
    lab's frame.
    """
    cos, sin = np.cos(pose[:, 2].copy())[:, None], np.sin(pose[:, 2].copy())[:, None]
    ahead = np.array([1, 1, -1, -1])[None] * c.WHEELBASE / 2
    left = np.array([1, -1, 1, -1])[None] * c.TRACK / 2
    x = pose[:, :1] - origin[0] + cos * ahead - sin * left
    y = pose[:, 1:2] - origin[1] + sin * ahead + cos * left
    friction = np.repeat(draws.friction[:, None], 4, axis=1)
    for px, py, radius, factor in np.moveaxis(draws.patches, (1, 2), (0, 1))[..., None]:
        friction *= np.where((x - px) ** 2 + (y - py) ** 2 < radius**2, factor, 1.0)
    return friction
