"""A manoeuvre in dynobench's own model: what is commanded, where the robot is, how it ends."""

import numpy as np

from sims.foreign.dynobench.process import ask
from sims.foreign.dynobench.robots import AXLES, HITCH, ROBOTS, SIZE, TICK, TRAILER, Robot
from sims.rectangle import centre_and_corners


def commands(robot: Robot, k) -> np.ndarray:
    """(ticks, 2) speed [m/s] and turning [rad/s] of the chosen part of k, zero while braking."""
    speed, *turns = np.asarray(k)[len(robot.state) :]
    ticks = [round(seconds / TICK) for seconds in robot.held]
    asked = np.column_stack([np.full(sum(ticks), speed), np.repeat(turns, ticks)])
    return np.concatenate([asked, np.zeros((round(robot.brake / TICK), 2))])


def states(robot: Robot, start, asked) -> np.ndarray:
    """(ticks + 1, n_x) of the model from a start (n_x,) under commands (ticks, 2), a speed and how
    fast to turn: accelerated towards where speeds are states, steered by the car.
    """
    if robot.n_x == 5:
        return ask("towards", robot.name, start, asked)
    if robot.trailer:
        speed, turning = asked.T
        asked = np.column_stack([speed, np.arctan(AXLES * turning / speed)])
    return ask("steps", robot.name, start, asked)


def start_of(robot: Robot, measured, place=(0.0, 0.0), heading: float = 0.0) -> np.ndarray:
    """The model's state (n_x,) at a pose, from what is measured at the start of a manoeuvre."""
    if robot.trailer:
        return np.array([*place, heading, heading - measured[0]])
    return np.array([*place, heading, *measured])


def measured_of(robot: Robot, x) -> np.ndarray:
    """What a loop measures of states (..., n_x): speeds, or the bend between car and trailer."""
    if robot.trailer:
        return wrapped(x[..., 2:3] - x[..., 3:])
    return x[..., 3:]


def wrapped(angle):
    """[rad] in -pi to pi."""
    return (np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi


def places(robot: Robot, x) -> np.ndarray:
    """(..., points, 2) [m] of states (..., n_x)."""
    found = centre_and_corners(x[..., :2], x[..., 2], *SIZE)
    if not robot.trailer:
        return found
    about = x[..., 3]
    behind = x[..., :2] - HITCH * np.stack([np.cos(about), np.sin(about)], axis=-1)
    trailer = centre_and_corners(behind, about, *TRAILER)[..., 1:, :]
    return np.concatenate([found, trailer], axis=-2)


def ends(robot: Robot, x) -> np.ndarray:
    """q of a manoeuvre through states (n, n_x): heading, and of the trailer its heading and the
    most that it was bent.
    """
    if not robot.trailer:
        return x[-1, 2:3]
    return np.array([x[-1, 2], x[-1, 3], np.abs(measured_of(robot, x)).max()])


def drive_from(name: str, rng, k, p0):
    """One manoeuvre of a robot: p (n_record + 1, points, 2), q. The models have no chance in them,
    so rng has no part in it.
    """
    robot = ROBOTS[name]
    start = start_of(robot, k[: len(robot.state)], p0)
    x = states(robot, start, commands(robot, k))
    return places(robot, x), ends(robot, x)


def drive(name: str, rng, k):
    """`drive_from` the origin."""
    return drive_from(name, rng, k, np.zeros(2))
