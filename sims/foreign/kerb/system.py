"""The car as a black box: worker processes, each drive from its own random stream."""

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.system import time_grid
from parc_jax.learning.systems.python_system import PythonSystem, python_system
from sims.foreign.extras import require
from sims.foreign.kerb import params as c
from sims.foreign.kerb.drive import Orders, drives
from sims.foreign.kerb.model import changed, right_hand_side, rolling
from sims.rectangle import POINTS, centre_and_corners

LAW = {
    "car": "commonroad-vehicle-models 3.0.2, multi-body, BMW 320i",
    "friction": c.FRICTION,
    "load": c.LOAD,
    "speed": c.SPEED_OFF,
    "heading": c.HEADING_OFF,
    "steering": c.STEERING_OFF,
    "brakes": c.BRAKES_OFF,
}


def system(workers: int | None = None) -> PythonSystem:
    """k = (speed [m/s], turn [rad]) -> p (201, 5, 2) of the centre of mass and the four corners,
    q = (heading,) [rad].

    workers: processes, None = one per core. Raises InputError without the car's package.
    """
    require("kerb", "vehiclemodels", "cars")
    lo, hi = zip(c.SPEED, c.TURN, strict=True)
    return python_system(
        drive,
        box(lo, hi),
        time_grid(c.PLAN_STEP, c.T_FINAL, c.RECORD),
        name="kerb",
        n_p=2,
        n_q=1,
        workers=workers,
        law=LAW,
        simulate_from=drive_from,
        points=POINTS,
        k_labels=("speed [m/s]", "turn [rad]"),
        q_labels=("heading [rad]",),
    )


def drive(rng: np.random.Generator, k) -> tuple[np.ndarray, np.ndarray]:
    """One drive from the origin: p (201, 5, 2) [m], q (1,) [rad]."""
    return drive_from(rng, k, np.zeros(2))


def drive_from(rng: np.random.Generator, k, p0) -> tuple[np.ndarray, np.ndarray]:
    """The same drive from p0 (2,) [m]."""
    states = simulated(rng, k, p0)
    return centre_and_corners(states[:, :2], states[:, 4], c.LENGTH, c.WIDTH), states[-1, 4:5]


def simulated(rng: np.random.Generator, k, p0) -> np.ndarray:
    """States (201, 29) of a drive, one a record. What differs between runs is drawn from `rng`."""
    friction = 1.0 + rng.uniform(*c.FRICTION)
    load, speed, heading, steering, brakes = rng.uniform(-1.0, 1.0, 5) * (
        c.LOAD,
        c.SPEED_OFF,
        c.HEADING_OFF,
        c.STEERING_OFF,
        c.BRAKES_OFF,
    )
    parameters = changed(friction, 1.0 + load)
    start = rolling(p0, float(heading), float(k[0] + speed), parameters)
    orders = Orders(float(k[0]), float(k[1]), float(steering), float(1.0 + brakes))
    steps, every = round(c.T_FINAL / c.STEP), round(c.RECORD / c.STEP)
    return drives()(right_hand_side(), start, orders, parameters, steps, every)
