"""Settings of a pilot: robot, sensor and place."""

from dataclasses import dataclass, fields

import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.options import Options
from parc_jax.drive.loop.loop import Effort


def _place_of(sensor) -> tuple[float, float, float]:
    """x, y [m] and heading [rad] of a sensor. Raises InputError."""
    x, y, turned = as_float64("sensor", sensor, (3,)).tolist()
    if abs(turned) > 2 * np.pi:
        raise InputError(
            f"sensor: expected x, y [m] and a heading within a turn [rad]; got {turned!r} rad. "
            f"Degrees are {np.radians(turned):.6g} rad."
        )
    return x, y, turned


@dataclass(frozen=True)
class Driving(Options):
    """How a pilot drives."""

    leave: float = 0.5
    """Seconds after the start of a manoeuvre from when on it may be left."""
    frame: str = "map"
    """The frame of all messages: pose, map, goal."""
    reach: float = 3.0
    """Half width [m] of the square around the robot in which manoeuvres stay."""
    arrived: float = 0.3
    """Distance [m] from the goal at which driving ends."""
    sensor: tuple[float, float, float] | None = None
    """Where the lidar is on the robot, x, y [m] and heading [rad]: obstacles come from its scans.
    Default: they come from the map."""
    noise: float = 0.03
    """Most [m] that a range is off."""
    width: float = 0.1
    """No obstacle is narrower than this [m]."""
    margin: float = 0.0
    """Distance [m] around the robot that a person declares free at its start, for scans: without it
    no free space is declared where it stands, and it stays. The uncertainty of a pose is taken from
    it."""
    acceleration: float = 3.0
    """Most [m/s²] by which the robot changes its velocity: a scan is taken from where it was on a
    straight way between two poses, from which it may stray so far."""
    acceleration_turning: float = 6.0
    """Most [rad/s²] by which it changes how fast it turns, for the same reason."""
    stale: float = 1.0
    """Seconds after the last scan that was added, or message of movers, from when on nothing new
    begins; and most by which stamps of either may lie ahead of the last pose."""
    age: float = 0.0
    """Seconds after which a place that no scan has seen again is not free any more; 0: never."""
    mover_radius: float = 0.0
    """Radius [m] of a disc around each moving obstacle, with the error of its place and its way
    while messages of the pose and of the manoeuvre travel; that of `deadline` in between is added.
    Above 0 m nothing begins before a message has the places of all of them; 0: no obstacle
    moves."""
    mover_speed: float = 0.0
    """Largest speed [m/s] of a moving obstacle."""
    uncertainty_start: float = 0.0
    """Metres by which a pose may be wrong, along each axis: localisation, and the motion between
    its measurement and the beginning of the manoeuvre."""
    uncertainty_heading: float = 0.0
    """Radians by which a heading may be wrong, for the same reasons."""
    drift: float = 0.0
    """Metres by which a pose may be off against any other since the begin of the manoeuvre under
    way, beside uncertainty_start of both: the drift of odometry meanwhile. A pose that is farther
    outside of the manoeuvre's tube begins nothing. With a `sensor` alone: what was seen shrinks by
    it, a map does not."""
    drift_heading: float = 0.0
    """Radians by which a heading may be off in the same way."""
    given: tuple[str, ...] = ()
    """Paths of the model's given parameters in the messages of poses, such as
    twist.twist.linear.x, in the order of its k. A twist is of the body: for a model without a
    rotation it is along the frame's axes at a heading of 0 alone, and where the heading is another,
    or may be by uncertainty_heading, nothing begins."""
    deadline: float = 0.1
    """Seconds of the clock from where a pose is heard to the end of its step, free space
    included."""
    effort_looks: int = Effort.looks
    """Tests of a pair of an obstacle and a part of the body, after which a step ends."""
    room: float = 0.1
    """Preferred clearance [m]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        least = {"reach": 0.1, "deadline": 1e-3, "width": 1e-3}
        sizes = [f.name for f in fields(self) if f.type is float and f.name != "leave"]
        for name in sizes:  # the loop checks `leave`
            value, lowest = getattr(self, name), least.get(name, 0.0)
            if not (np.isfinite(value) and value >= lowest):
                raise InputError(f"{name}: expected {lowest:g} or more; got {value!r:.40}.")
        if not isinstance(self.frame, str) or not self.frame:
            raise InputError(f"frame: expected the name of a frame; got {self.frame!r:.40}.")
        if isinstance(self.given, str) or not all(isinstance(x, str) and x for x in self.given):
            raise InputError(
                "given: expected paths of numbers in messages of poses, as a list; got "
                f"{self.given!r:.80}."
            )
        if self.sensor is not None:
            object.__setattr__(self, "sensor", _place_of(self.sensor))
        for name in ("drift", "drift_heading"):
            if self.sensor is None and getattr(self, name):
                raise InputError(
                    f"{name}: expected 0 with obstacles of a map, which drifts away for good; got "
                    f"{getattr(self, name)!r}. Take poses localised on that map, with their error "
                    "as uncertainty_start and uncertainty_heading; or set sensor."
                )
        if self.mover_speed and not self.mover_radius:
            raise InputError(
                "mover_radius: expected above 0 m, since mover_speed says that somebody moves; "
                "got 0."
            )

    @property
    def premises(self) -> dict[str, str]:
        """Premises of manoeuvres beside model and tube: by name, in words with their numbers."""
        standing = "a map: its free cells are free, and stay so"
        if self.sensor is not None:
            x, y, turned = self.sensor
            standing = (
                f"a lidar at ({x!r}, {y!r}) m, {turned!r} rad on the robot: ranges within "
                f"±{self.noise!r} m, nothing narrower than {self.width!r} m, no echo: "
                "nothing up to its range_max, a sweep as long as its time_increment tells; between "
                "poses the robot turns by less than half a turn, and accelerates by at most "
                f"{self.acceleration!r} m/s² and "
                f"{self.acceleration_turning!r} rad/s²; all that the body can touch at any height "
                "crosses the plane of the lidar; what it sees no more "
                f"stays{f' for {self.age!r} s and the manoeuvre after' if self.age else ''}, and "
                f"before the start {self.margin!r} m around the robot were looked at"
            )
        size, speed = self.mover_radius, self.mover_speed
        moving = (
            f"all are told, at most {self.stale!r} s before, within {size!r} m, with their way "
            "while messages of the pose and of the manoeuvre travel, no faster than "
            f"{speed!r} m/s, for the {self.deadline!r} s of a step in between too; nobody has come "
            "since"
        )
        return {
            "measured poses": (
                f"in the frame {self.frame!r}, within ±{self.uncertainty_start!r} m along each "
                f"axis and ±{self.uncertainty_heading!r} rad of the truth, whatever covariance "
                "the messages tell, from the stamp to where the manoeuvre begins, by one clock; "
                "between any two moments from the begin of a manoeuvre to that of the next the "
                f"frame drifts {self.drift!r} m at most, where the robot is at the later of them, "
                f"and turns by {self.drift_heading!r} rad at most"
            ),
            "what stands": standing,
            "who moves": moving if size else "nobody",
        }
