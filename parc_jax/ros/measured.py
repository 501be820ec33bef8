"""Maps and scans of messages, as what is known to be free."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.bags.fields import frames_of, yaw_of
from parc_jax.errors import InputError
from parc_jax.world.free_space import FreeSpace
from parc_jax.world.grid_map import GridMap, occupancy_grid
from parc_jax.world.seen import seen_from


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


def seen_in(
    message: Any, pose: ArrayLike, *, noise: float, width: float, doubt: tuple[float, float]
) -> FreeSpace:
    """What a sensor_msgs/LaserScan shows to be free, from the pose (x, y, heading) of its sensor,
    as `seen_from` has it. An infinite range came back from nowhere; what is NaN, or nearer than the
    sensor can tell, or farther, says nothing. Raises InputError.
    """
    ranges = np.asarray(message.ranges, np.float64)
    angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
    told = (message.range_min <= ranges) & (ranges <= message.range_max)
    ranges = np.where(np.isposinf(ranges), message.range_max, np.where(told, ranges, 0.0))
    limits = {"max_range": message.range_max, "noise": noise, "width": width}
    return seen_from(pose, angles, ranges, doubt=doubt, **limits)


def require_frame(message: Any, frame: str, what: str) -> None:
    """Raises InputError for a message that is told in another frame."""
    own = frames_of(message)[0]
    if own != frame:
        raise InputError(
            f"{what}: expected to be told in the frame {frame!r}; got {own!r}. Transforms are not "
            "looked up: publish it in that frame, or name another frame for all."
        )
