"""A flat map of a round earth: the plane that touches it at the origin, x to the east, y to the
north.
"""

import numpy as np

from sims.foreign.towers import params as c

EQUATOR, FLATTENING = 6_378_137.0, 1 / 298.257223563  # [m], of WGS84, as JSBSim has them


def place_of(p0) -> tuple[float, float, float]:
    """Latitude and longitude [rad] of a place (2,) [m] on the map, and where the map's north points
    there, clockwise from the true one [rad].
    """
    latitude, longitude = np.radians([c.LATITUDE, c.LONGITUDE])
    squared = FLATTENING * (2 - FLATTENING)
    below = 1 - squared * np.sin(latitude) ** 2
    along = EQUATOR * (1 - squared) / below**1.5  # [m] radius of the meridian
    across = EQUATOR / np.sqrt(below)
    east = p0[0] / (across * np.cos(latitude))
    return latitude + p0[1] / along, longitude + east, float(east * np.sin(latitude))


def north_east_down(latitude, longitude) -> np.ndarray:
    """Rows (..., 3, 3): the directions north, east and down at a place [rad], in axes fixed to the
    earth.
    """
    sin, cos = np.sin(latitude), np.cos(latitude)
    far, near = np.sin(longitude), np.cos(longitude)
    zero = np.zeros_like(sin)
    north = np.stack([-sin * near, -sin * far, cos], axis=-1)
    east = np.stack([-far, near, zero], axis=-1)
    down = np.stack([-cos * near, -cos * far, -sin], axis=-1)
    return np.stack([north, east, down], axis=-2)


def on_map(places) -> np.ndarray:
    """Map coordinates (..., 2) [m] of places (..., 3) [m] in axes fixed to the earth, up to a
    constant.
    """
    north, east, _ = north_east_down(*np.radians([c.LATITUDE, c.LONGITUDE]))
    return np.stack([places @ east, places @ north], axis=-1)


def body_axes(roll, pitch, yaw) -> np.ndarray:
    """Rows (..., 3, 3): the directions north, east and down seen from the aeroplane, whose axes
    point forward, right and down; the angles [rad] turn in the order yaw, pitch, roll.
    """
    sr, cr = np.sin(roll), np.cos(roll)
    sp, cp = np.sin(pitch), np.cos(pitch)
    sy, cy = np.sin(yaw), np.cos(yaw)
    north = np.stack([cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy], axis=-1)
    east = np.stack([cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy], axis=-1)
    down = np.stack([-sp, sr * cp, cr * cp], axis=-1)
    return np.stack([north, east, down], axis=-2)
