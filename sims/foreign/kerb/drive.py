"""One drive: swerve towards the kerb by distance driven, brake, stop. Written so that numba can
compile it as it stands, and Python can run it.
"""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sims.foreign.kerb import params as c
from sims.foreign.kerb.model import compiler


class Orders(NamedTuple):
    """What the driver wants and what the car makes of it. speed [m/s] as asked for, turn [rad] most
    towards the kerb, steering_off [rad] of the steering's zero, brakes: their strength as a factor.
    """

    speed: float
    turn: float
    steering_off: float
    brakes: float


@functools.cache
def drives() -> Callable:
    """drive(f, x, orders, parameters, steps, every) -> states (steps / every + 1, 29)."""
    build = compiler()
    forward = build(_step)
    planned = build(_planned)
    command = build(_commanded_by(planned))

    def drive(f, x, orders, parameters, steps, every):
        states = np.zeros((steps // every + 1, 29))
        driven = 0.0
        beside = 0.0  # [m] left of the way planned
        held = False
        for step in range(steps + 1):
            if step % every == 0:
                states[step // every] = x
            held = held or x[3] < c.STOP
            if not held:
                u = command(x, driven, beside, orders)
                driven += c.STEP * x[3]
                meant = x[3] * math.sin(planned(driven, orders)[0])
                beside += c.STEP * (x[3] * math.sin(x[4]) + x[10] * math.cos(x[4]) - meant)
                x = forward(f, x, u, parameters)
        return states

    return build(drive)


def _step(f, x, u, parameters):
    """Runge and Kutta's fourth order. f changes what it is given, hence the copies."""
    h = c.STEP
    a = np.array(f(x.copy(), u, parameters))
    b = np.array(f(x + 0.5 * h * a, u, parameters))
    m = np.array(f(x + 0.5 * h * b, u, parameters))
    e = np.array(f(x + h * m, u, parameters))
    return x + h / 6 * (a + 2 * b + 2 * m + e)


def _planned(driven, orders):
    """Heading [rad] and its change per metre, after so many metres driven."""
    share = (driven - c.AHEAD) / c.SWERVE
    heading = 0.0
    bend = 0.0
    if 0.0 < share < 1.0:
        heading = -0.5 * orders.turn * (1.0 - math.cos(2.0 * math.pi * share))
        bend = -orders.turn * math.pi / c.SWERVE * math.sin(2.0 * math.pi * share)
    return heading, bend


def _commanded_by(planned):
    """The driver, with a plan that may be compiled."""

    def command(x, driven, beside, orders):
        """Rate of the steering angle [rad/s] and acceleration [m/s^2]."""
        heading, bend = planned(driven, orders)
        back = min(max(-c.LATERAL_GAIN * beside, -c.LATERAL_MOST), c.LATERAL_MOST)
        steer = math.atan(c.WHEELBASE * bend) + orders.steering_off
        steer += c.HEADING_GAIN * (heading + back - x[4]) + c.RATE_GAIN * (bend * x[3] - x[5])
        left = max(c.AHEAD + c.SWERVE + c.AFTER - driven, 0.0)
        speed = min(orders.speed, math.sqrt(2.0 * c.BRAKING * left))
        push = c.SPEED_GAIN * (speed - x[3])
        if speed < orders.speed:
            push -= c.BRAKING
        if push < 0.0:
            push = orders.brakes * max(push, -c.HARDEST)
        return np.array([c.STEERING_GAIN * (steer - x[2]), min(push, c.BRAKING)])

    return command
