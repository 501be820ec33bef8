"""Messages of maps, scans and moving obstacles as free space and as obstacles. [T38]"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.bags.recording import frames_of, stamp_of, yaw_of
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.common.spelling import rounded_up
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.system import TimeGrid
from parc_jax.problem.world.free_space import FreeSpace
from parc_jax.problem.world.grid_map import GridMap, occupancy_grid
from parc_jax.problem.world.moving import moving
from parc_jax.problem.world.seen import seen_from

OF_ANGLES = ("angle_min", "angle_max", "angle_increment")
BEAMS_OFF = 2.0  # increments by which angle_max may be off
EVERY = 3  # intervals of a manoeuvre for which a disc has one outline
SIDES = np.pi / 4 * np.arange(8)  # of an outline: a loop's scenes are padded to as many corners
NORMALS = np.stack([np.cos(SIDES), np.sin(SIDES)], axis=1)


def map_in(message: Any) -> GridMap:
    """The map of a nav_msgs/OccupancyGrid. Raises InputError, for costmaps too."""
    info = message.info
    if len(message.data) != info.height * info.width:
        size = f"{info.height} x {info.width}"
        raise InputError(f"map: expected {size} cells; got {len(message.data)}.")
    cells = np.asarray(message.data, np.int64).reshape(info.height, info.width)
    place = info.origin.position
    origin = (place.x, place.y, yaw_of(info.origin.orientation, "map"))
    return occupancy_grid(cells, info.resolution, origin)


def swept_in(message: Any) -> int:
    """[ns] from the first beam of a sensor_msgs/LaserScan to its last. Raises InputError, also for
    ranges that are more or fewer than its angles.
    """
    each, n = float(message.time_increment), len(message.ranges)
    if not (each >= 0 and np.isfinite(each * n)):
        raise InputError(f"scan: expected a time_increment of 0 s or more; got {each!r}.")
    first, last, step = (float(getattr(message, name)) for name in OF_ANGLES)
    # drivers count the last beam or do not, and angles are of single precision
    if not abs(first + (n - 1) * step - last) <= BEAMS_OFF * abs(step):
        raise InputError(
            f"scan: expected ranges from angle_min, {first:.6g} rad, to angle_max, {last:.6g} rad, "
            f"every angle_increment, {step:.6g} rad; got {n}, which end at "
            f"{first + (n - 1) * step:.6g} rad. What takes some of them out has to tell the new "
            "increment."
        )
    return round(each * max(n - 1, 0) * 1e9)


def seen_in(
    message: Any,
    pose: ArrayLike,
    *,
    noise: float,
    width: float,
    uncertainty: tuple[float, float],
    between: tuple[float, float] = (0.0, 0.0),
) -> FreeSpace:
    """Free space of a sensor_msgs/LaserScan, from the pose (x, y, heading) of its sensor, by
    `seen_from`.

    uncertainty: ([m], [rad]) by which the pose may be off for any of the beams. between: ([m],
    [rad]) by which the sensor moves from one beam to the next. Raises InputError.
    """
    ranges = np.asarray(message.ranges, np.float64)
    angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
    # infinite: nothing within the range; NaN, nearer or farther than the sensor measures: unknown
    valid = (message.range_min <= ranges) & (ranges <= message.range_max)
    ranges = np.where(np.isposinf(ranges), message.range_max, np.where(valid, ranges, 0.0))
    if any(between):
        # of a moving sensor the first and last beam of a full turn are no neighbours
        full = 2 * np.pi - 3 * abs(message.angle_increment)
        keep = abs(angles - angles[0]) <= full
        angles, ranges = angles[keep], ranges[keep]
    limits = {"max_range": message.range_max, "noise": noise + between[0], "width": width}
    off = {"uncertainty": uncertainty, "angle_error": between[1]}
    x, y, heading = pose
    pose = x, y, math.remainder(heading, 2 * math.pi)
    return seen_from(pose, angles, ranges, **off, **limits)


def require_frame(message: Any, frame: str, name: str) -> None:
    """Raises InputError for a message in another frame."""
    got = frames_of(message)[0]
    if got != frame:
        raise InputError(
            f"{name}: expected one in the frame {frame!r}; got {got!r}. Transforms are not "
            "looked up: publish it in that frame, or name another frame for all."
        )


class Movers(NamedTuple):
    """Moving discs. stamp: [ns] of their measurement. places (n, 2) [m] of their middles."""

    stamp: int
    places: np.ndarray


def movers_in(message: Any) -> Movers:
    """The discs of a geometry_msgs/PoseArray; orientations are ignored. Raises InputError."""
    stamp = stamp_of(message)
    places = [(one.position.x, one.position.y) for one in message.poses]
    places = np.array(places, np.float64).reshape(-1, 2)
    if stamp is None or not np.isfinite(places).all():
        got = f"{places.tolist()!r:.80}"
        raise InputError(f"movers: expected finite places with a stamp; got {got}.")
    return Movers(stamp, places)


def among(
    movers: Movers,
    ways: Sequence,
    pose: np.ndarray,
    at: int,
    d: Any,
    time: TimeGrid,
    now: float,
    drifts: Sequence[np.ndarray] = (),
):
    """Obstacles and spans of a manoeuvre from a pose (x, y, ..) at the time `at` [ns], which is
    `now` [s] by the clock of the loop.

    ways: obstacles that stand still. d: `mover_radius`, `mover_speed`, `deadline`, `reach`, `drift`
    and `drift_heading` as of the settings of a pilot (`sims.driving`). drifts: places (x, y) of the
    robot at each drift of the frame since the movers were told, the last one last. The manoeuvre
    stays within the square of half width `d.reach`, so movers that cannot enter it are left out.
    Returns a sentence where a mover may be at the robot.
    """
    # of either sign: a measurement from after the pose is off by as much
    age = abs(at - movers.stamp) / 1e9
    # reachable before the manoeuvre begins: nothing is committed to after the deadline
    radius = d.mover_radius + d.mover_speed * (age + d.deadline) + TOLERANCES.outline
    radius = radius + _strayed(movers.places, drifts, d)
    away = np.abs(movers.places - pose[:2]).max(axis=1)
    if (away <= radius).any():
        return (
            f"who moves may be where the robot is: seen {age:.3g} s apart from its pose, within "
            f"{rounded_up(radius[away <= radius].max(), 4)} m when a manoeuvre begins"
        )
    obstacles, spans = list(ways), [None] * len(ways)
    near = away <= d.reach + radius + d.mover_speed * time.t_f
    for place, size in zip(movers.places[near], radius[near], strict=True):
        disc = hpolytope(NORMALS, NORMALS @ place + size)
        whole = (0, time.n_steps - 1)
        known = {"at": now, "every": EVERY, "off_by": d.mover_speed}
        parts, when = moving(disc, [0.0, 0.0], whole, time.dt, **known)
        obstacles += parts
        spans += when
    return obstacles, spans


def _strayed(places: np.ndarray, drifts: Sequence[np.ndarray], d: Any) -> np.ndarray:
    """(n,) [m] by which places (n, 2) are elsewhere after the frame has drifted."""
    off = np.zeros(len(places))
    for robot in drifts:
        # Let x be a place and p the robot before a drift, x' and p' after it: by what drift and
        # drift_heading bound, |p' - p| <= drift and x' = p' + R (x - p) with R of |angle| <=
        # drift_heading. So |x' - x| <= drift + drift_heading |x - p|, where p lies within drift of
        # p', the place of the robot that is known, and x within what drifts before this one did.
        far = np.linalg.norm(places - robot, axis=1) + d.drift + off
        off = off + d.drift + d.drift_heading * far
    return off
