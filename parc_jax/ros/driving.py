"""How a pilot drives: what a person knows of robot, sensor and place."""

from dataclasses import dataclass

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.options import Options
from parc_jax.drive.loop.loop import Effort


@dataclass(frozen=True)
class Driving(Options):
    """How a pilot drives."""

    leave: float = 0.5
    """Seconds after the start of a manoeuvre from when on it may be left."""
    frame: str = "map"
    """The frame that everything is told in: pose, map, goal."""
    reach: float = 3.0
    """Half width [m] of the square around the robot in which it looks for ways."""
    arrived: float = 0.3
    """Distance [m] from the goal at which nothing more is asked for."""
    sensor: tuple[float, float, float] | None = None
    """Where the lidar is on the robot, x, y [m] and heading [rad]: obstacles come from its scans.
    Default: they come from the map."""
    noise: float = 0.03
    """Most [m] that a range is off."""
    width: float = 0.1
    """No obstacle is narrower than this [m]."""
    margin: float = 0.0
    """How far [m] around the robot a person has looked before its start, for scans: without it
    nothing is known to be free where it stands, and it stays."""
    mover_radius: float = 0.0
    """Radius [m] of a disc around each of those who move, with what their places are off by, and
    how far they go from when a pose was measured to when the manoeuvre begins. Above 0 m nothing is
    begun before it was told where they are, all of them; 0: nobody moves."""
    mover_speed: float = 0.0
    """Most [m/s] that they move, whatever they do."""
    uncertainty_start: float = 0.0
    """Metres by which a pose may be wrong, along each axis: localisation, and the way that the
    robot goes from when it was measured to when the manoeuvre begins."""
    uncertainty_heading: float = 0.0
    """Radians by which a heading may be wrong, for the same reasons."""
    drift: float = 0.0
    """Metres by which a pose may be off against the one at which the manoeuvre under way began,
    beside uncertainty_start of both: what odometry may drift meanwhile. A pose that is farther
    outside of the manoeuvre's tube begins nothing."""
    given: tuple[str, ...] = ()
    """Where in the messages of poses the model's given parameters are, such as
    twist.twist.linear.x."""
    deadline: float = 0.1
    """Seconds of the clock for a step."""
    effort_looks: int = Effort.looks
    """Looks of a step at pairs of an obstacle and a part of the body, after which it ends."""
    room: float = 0.1
    """Clearance [m] that is liked."""

    def __post_init__(self) -> None:
        super().__post_init__()
        least = {"reach": 0.1, "deadline": 1e-3, "width": 1e-3}
        sizes = (
            "reach",
            "arrived",
            "noise",
            "width",
            "margin",
            "uncertainty_start",
            "uncertainty_heading",
            "drift",
        )
        movers = ("mover_radius", "mover_speed")
        for name in (*sizes, *movers, "deadline", "room"):
            value, lowest = getattr(self, name), least.get(name, 0.0)
            if not (np.isfinite(value) and value >= lowest):
                raise InputError(f"{name}: expected {lowest:g} or more; got {value!r:.40}.")
        if self.mover_speed and not self.mover_radius:
            raise InputError(
                "mover_radius: expected above 0 m, since mover_speed says that somebody moves; "
                "got 0."
            )
