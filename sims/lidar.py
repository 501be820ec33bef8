"""A lidar in the plane: ranges along many beams, against cylinders, boxes and polygons."""

from dataclasses import dataclass, replace

import numpy as np

from parc_jax.common.errors import InputError


@dataclass(frozen=True, eq=False)
class Shapes:
    """What stands in a world. circles (m, 3): middle x, y and radius [m]. edges (n, 2, 2): ends [m]
    of straight walls. Build with `shapes`.
    """

    circles: np.ndarray
    edges: np.ndarray


@dataclass(frozen=True, eq=False)
class Scan:
    """One scan. pose (3,): of the sensor when it was taken, x, y [m], heading [rad]. angles (n,)
    [rad] of the beams from its heading, ascending; ranges (n,) [m], `max_range` where nothing was
    hit: what `parc_jax.seen_from` asks for.

    max_range: [m] of the sensor. noise: [m] by which the range of what was hit is off, at most.
    """

    pose: np.ndarray
    angles: np.ndarray
    ranges: np.ndarray
    max_range: float
    noise: float

    @property
    def returned(self) -> np.ndarray:
        """(n,) did the beam come back?"""
        return self.ranges < self.max_range

    @property
    def ends(self) -> np.ndarray:
        """(n, 2) [m] where the beams end, as measured."""
        angle = self.pose[2] + self.angles
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return self.pose[:2] + self.ranges[:, None] * along

    def taken_from(self, pose) -> "Scan":
        """The same ranges, held to be taken from another pose (3,) of the sensor: where odometry
        says that it was.
        """
        return replace(self, pose=np.asarray(pose, np.float64))


@dataclass(frozen=True)
class Lidar:
    """A sensor; the defaults are a Hokuyo UST-10LX on the front mount of a Jackal.

    beams over view [rad], symmetric about straight ahead. max_range [m]. noise [m]: a range is off
    by at most so much, uniform; the data sheet's accuracy is 0.04 m, Clearpath's simulator has a
    standard deviation of 0.001 m. mount: x, y [m] and heading [rad] of the sensor in the robot's
    frame. Build with `lidar`.
    """

    beams: int = 1081
    view: float = 1.5 * np.pi
    max_range: float = 10.0
    noise: float = 0.01
    mount: tuple[float, float, float] = (0.12, 0.0, 0.0)

    @property
    def angles(self) -> np.ndarray:
        """(beams,) [rad] from the sensor's heading, ascending."""
        return np.linspace(-self.view / 2, self.view / 2, self.beams)

    def pose(self, robot) -> np.ndarray:
        """(3,) pose of the sensor on a robot at pose (3,)."""
        x, y, heading = np.asarray(robot, np.float64)
        ahead, left, turned = self.mount
        cos, sin = np.cos(heading), np.sin(heading)
        x, y = x + cos * ahead - sin * left, y + sin * ahead + cos * left
        return np.array([x, y, heading + turned])

    def scan(self, robot, shapes: Shapes, rng: np.random.Generator | None = None) -> Scan:
        """A scan from a robot at pose (3,): x, y [m], heading [rad]. Without rng it has no noise.

        A beam that starts inside of a circle has range 0.
        """
        pose, angles = self.pose(robot), self.angles
        ranges = np.minimum(cast(pose, angles, shapes), self.max_range)
        if rng is not None and self.noise:
            off = rng.uniform(-self.noise, self.noise, len(ranges))
            moved = np.clip(ranges + off, 0.0, self.max_range)
            ranges = np.where(ranges < self.max_range, moved, ranges)
        return Scan(pose, angles, ranges, self.max_range, self.noise)


def lidar(**options) -> Lidar:
    """A sensor with other numbers than the default ones (see `Lidar`). Raises InputError."""
    made = Lidar(**options)
    if made.beams < 2 or not 0 < made.view <= 2 * np.pi or not made.max_range > 0 or made.noise < 0:
        raise InputError(
            "lidar: expected at least 2 beams, a view up to 2 pi rad, max_range > 0 m and noise "
            f"of 0 m or more; got {made}."
        )
    return made


def shapes(circles=(), radius=None, polygons=(), boxes=()) -> Shapes:
    """What stands in a world: circles (m, 2) of one radius or of radii (m,) [m], polygons (n_i, 2)
    of corners in order, boxes (r, 4) x and y from, x and y to. Raises InputError.
    """
    middles = np.asarray(circles, np.float64).reshape(-1, 2)
    if len(middles) and radius is None:
        raise InputError("shapes: expected a radius [m] for the circles; there is none.")
    radii = np.broadcast_to(np.asarray(0.0 if radius is None else radius), (len(middles),))
    corners = [np.asarray(p, np.float64) for p in polygons]
    for x0, y0, x1, y1 in np.asarray(boxes, np.float64).reshape(-1, 4):
        corners.append(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))
    edges = [np.stack([p, np.roll(p, -1, axis=0)], axis=1) for p in corners]
    ends = np.concatenate([np.empty((0, 2, 2)), *edges])
    if not (np.isfinite(middles).all() and np.isfinite(ends).all() and (radii >= 0).all()):
        raise InputError("shapes: expected finite places and radii of 0 m or more.")
    return Shapes(np.column_stack([middles, radii]), ends)


def cast(pose, angles: np.ndarray, shapes: Shapes) -> np.ndarray:
    """Distance (n,) [m] from a pose (3,) along beams (n,) [rad], ascending, to the first thing;
    infinite where there is none.

    Broad phase: of each shape only the beams between the angles under which it is seen.
    """
    ranges = np.full(len(angles), np.inf)
    _cast_circles(ranges, pose, angles, shapes.circles)
    _cast_edges(ranges, pose, angles, shapes.edges)
    return ranges


def _cast_circles(ranges, pose, angles, circles) -> None:
    away = circles[:, :2] - pose[:2]
    far, radius = np.hypot(*away.T), circles[:, 2]
    if (far <= radius).any():
        ranges[:] = 0.0
        return
    at = np.arctan2(away[:, 1], away[:, 0]) - pose[2]
    half = np.arcsin(radius / far)
    beam, shape = _pairs(angles, at - half, 2 * half)
    off = angles[beam] - at[shape]
    across = far[shape] * np.sin(off)
    depth = np.sqrt(np.maximum(radius[shape] ** 2 - across**2, 0.0))
    np.minimum.at(ranges, beam, far[shape] * np.cos(off) - depth)


def _cast_edges(ranges, pose, angles, edges) -> None:
    a, b = np.moveaxis(edges - pose[:2], 1, 0)
    seen = np.arctan2(a[:, 1], a[:, 0]) - pose[2]
    wide = np.arctan2(_cross(a, b), (a * b).sum(axis=1))
    beam, shape = _pairs(angles, np.where(wide < 0, seen + wide, seen), np.abs(wide))
    angle = pose[2] + angles[beam]
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    wall = (b - a)[shape]
    slant = _cross(along, wall)
    low, high = _nearest(a, b)[shape], np.maximum(np.hypot(*a.T), np.hypot(*b.T))[shape]
    with np.errstate(divide="ignore", invalid="ignore"):
        meets = _cross(a[shape], wall) / slant
    # a beam along a wall meets its nearest point
    meets = np.where(np.isfinite(meets), np.clip(meets, low, high), low)
    np.minimum.at(ranges, beam, meets)


def _nearest(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance (n,) from the origin to the walls from a to b (n, 2)."""
    wall = b - a
    length = np.maximum((wall * wall).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(-(a * wall).sum(axis=1) / length, 0.0, 1.0)
    return np.hypot(*(a + share[:, None] * wall).T)


def _pairs(angles, lo, wide) -> tuple[np.ndarray, np.ndarray]:
    """Which beams (p,) may meet which shapes (p,), that are seen from lo (m,) on over wide (m,)
    [rad].
    """
    turn = 2 * np.pi
    lo = lo - turn * np.floor((lo + np.pi) / turn)
    lo = np.concatenate([lo, lo - turn])
    wide = np.concatenate([wide, wide])
    first = np.searchsorted(angles, lo, "left")
    count = np.maximum(np.searchsorted(angles, lo + wide, "right") - first, 0)
    shape = np.repeat(np.arange(len(lo)), count)
    within = np.arange(len(shape)) - np.repeat(np.cumsum(count) - count, count)
    return first[shape] + within, shape % (len(lo) // 2)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
