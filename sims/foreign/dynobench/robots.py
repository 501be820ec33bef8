"""Dynobench's models as they are driven here: what of their state is measured, what is commanded,
for how long. Every size and limit is that of the model's file in the package.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from sims.rectangle import CORNERS, POINTS

TICK = 0.1  # [s] the models' own step
SIZE = (0.5, 0.25)  # [m] length and width of every robot
TRAILER, HITCH = (0.3, 0.25), 0.5  # [m] of the trailer; from the car's middle to its middle
AXLES = 0.25  # [m] between the car's
BEND = pi / 4  # [rad] most between car and trailer that dynobench's constraint allows
TRAILER_CORNERS = tuple(f"trailer {corner}" for corner in CORNERS)


@dataclass(frozen=True)
class Robot:
    """One of dynobench's models, and the manoeuvres that it drives.

    A manoeuvre holds a speed, and one turn after another, each for its part of `held` [s], and
    ends at rest after `brake` [s]. state: names and limits of what is measured at its start.
    speed [m/s], turning [rad/s]: limits of what is commanded. n_x: states of the model. plan_step:
    [s] between knots.
    """

    name: str
    n_x: int
    state: tuple[tuple[str, float], ...]
    speed: tuple[float, float]
    turning: float
    held: tuple[float, ...]
    brake: float
    plan_step: float
    trailer: bool = False

    @property
    def t_f(self) -> float:
        """[s] of a manoeuvre."""
        return round(sum(self.held) + self.brake, 9)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the reference points."""
        return POINTS + TRAILER_CORNERS * self.trailer

    @property
    def labels(self) -> tuple[str, ...]:
        """Of k."""
        turns = [f"turning {i + 1} [rad/s]" for i in range(len(self.held))]
        return (*(name for name, _ in self.state), "speed [m/s]", *turns)

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Of k: the box K."""
        most = np.array([*(most for _, most in self.state), *[self.turning] * len(self.held)])
        at, (slowest, fastest) = len(self.state), self.speed
        return np.insert(-most, at, slowest), np.insert(most, at, fastest)


UNICYCLE1 = Robot("unicycle1_v0", 3, (), (-0.5, 0.5), 0.5, (1.6, 1.6), 0, 0.2)
UNICYCLE2 = Robot(
    "unicycle2_v0",
    5,
    (("speed at the start [m/s]", 0.4), ("turning at the start [rad/s]", 0.4)),
    (-0.4, 0.4),
    0.4,
    (1.6, 3.2),  # a turn, and as much of the other way, with what it takes to change
    1.6,  # 0.4 m/s at 0.25 m/s^2
    0.4,
)
CAR = Robot(
    "car1_v0",
    4,
    (("bend at the start [rad]", BEND),),
    (0.1, 0.5),
    0.6,
    (1.6, 1.6),
    0,
    0.2,
    trailer=True,
)
ROBOTS = {robot.name: robot for robot in (UNICYCLE1, UNICYCLE2, CAR)}
