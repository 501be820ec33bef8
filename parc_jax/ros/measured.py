"""Maps and scans of messages, as what is known to be free."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.errors import InputError
from parc_jax.problem.world.free_space import FreeSpace
from parc_jax.problem.world.grid_map import GridMap, occupancy_grid
from parc_jax.problem.world.seen import seen_from
from parc_jax.ros.bags.fields import frames_of, yaw_of


def map_in(message: Any) -> GridMap:
    """The map of a nav_msgs/OccupancyGrid. Raises InputError, for costmaps too."""
    info = message.info
    if len(message.data) != info.height * info.width:
        raise InputError(
            f"map: expected {info.height} x {info.width} cells; got {len(message.data)}."
        )
    cells = np.asarray(message.data, np.int64).reshape(info.height, info.width)
    place = info.origin.position
    origin = (place.x, place.y, yaw_of(info.origin.orientation, "map"))
    return occupancy_grid(cells, info.resolution, origin)


def swept_in(message: Any) -> int:
    """[ns] from the first beam of a sensor_msgs/LaserScan to its last. Raises InputError."""
    each, n = float(message.time_increment), len(message.ranges)
    if not (np.isfinite(each) and each >= 0):
        raise InputError(f"scan: expected a time_increment of 0 s or more; got {each!r}.")
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
    """What a sensor_msgs/LaserScan shows to be free, from the pose (x, y, heading) of its sensor,
    as `seen_from` has it. An infinite range came back from nowhere; what is NaN, or nearer than the
    sensor can tell, or farther, says nothing. Raises InputError.

    uncertainty: ([m], [rad]) by which the pose may be off for any of the beams. between: ([m],
    [rad]) by which the sensor moves from one beam to the next; where it moves at all, first and
    last beam of a full turn are no neighbours.
    """
    ranges = np.asarray(message.ranges, np.float64)
    angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
    told = (message.range_min <= ranges) & (ranges <= message.range_max)
    ranges = np.where(np.isposinf(ranges), message.range_max, np.where(told, ranges, 0.0))
    if any(between):
        full = 2 * np.pi - 3 * abs(message.angle_increment)
        keep = abs(angles - angles[0]) <= full
        angles, ranges = angles[keep], ranges[keep]
    limits = {"max_range": message.range_max, "noise": noise + between[0], "width": width}
    return seen_from(
        pose, angles, ranges, uncertainty=uncertainty, angle_error=between[1], **limits
    )


def require_frame(message: Any, frame: str, what: str) -> None:
    """Raises InputError for a message that is told in another frame."""
    own = frames_of(message)[0]
    if own != frame:
        raise InputError(
            f"{what}: expected to be told in the frame {frame!r}; got {own!r}. Transforms are not "
            "looked up: publish it in that frame, or name another frame for all."
        )
