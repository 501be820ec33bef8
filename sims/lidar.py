"""A lidar in the plane: ranges along many beams, against cylinders, boxes and polygons."""

from dataclasses import dataclass, replace

import numpy as np

from parc_jax.common.errors import InputError

ROUNDS = 1e-9  # [m] by which a beam may seem to miss what it grazes


@dataclass(frozen=True, eq=False)
class Shapes:
    """What stands in a world. circles (m, 3): middle x, y and radius [m]; (beams, m, 3) of who
    moves while a lidar turns, as each beam meets them. edges (n, 2, 2): ends [m] of straight walls.
    Build with `shapes`.
    """

    circles: np.ndarray
    edges: np.ndarray


@dataclass(frozen=True, eq=False)
class Scan:
    """One scan. pose (3,): of the sensor at its middle beam, x, y [m], heading [rad]. angles (n,)
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
    frame. sweep: [s] from the first beam to the last. Build with `lidar`.
    """

    beams: int = 1081
    view: float = 1.5 * np.pi
    max_range: float = 10.0
    noise: float = 0.01
    mount: tuple[float, float, float] = (0.12, 0.0, 0.0)
    sweep: float = 0.0

    @property
    def moments(self) -> np.ndarray:
        """(beams,) [s] of each beam, the last one at 0."""
        return np.linspace(-self.sweep, 0.0, self.beams)

    @property
    def angles(self) -> np.ndarray:
        """(beams,) [rad] from the sensor's heading, ascending."""
        return np.linspace(-self.view / 2, self.view / 2, self.beams)

    def pose(self, robot) -> np.ndarray:
        """(..., 3) poses of the sensor on a robot at poses (..., 3)."""
        x, y, heading = np.moveaxis(np.asarray(robot, np.float64), -1, 0)
        ahead, left, turned = self.mount
        cos, sin = np.cos(heading), np.sin(heading)
        x, y = x + cos * ahead - sin * left, y + sin * ahead + cos * left
        return np.stack([x, y, heading + turned], axis=-1)

    def scan(self, robot, shapes: Shapes, rng: np.random.Generator | None = None) -> Scan:
        """A scan from a robot at pose (3,): x, y [m], heading [rad], or at poses (beams, 3), one at
        the moment of each beam. Without rng it has no noise.

        A beam that starts inside of a circle has range 0.
        """
        poses, angles = np.broadcast_to(self.pose(robot), (self.beams, 3)), self.angles
        ranges = np.minimum(cast(poses, angles, shapes), self.max_range)
        if rng is not None and self.noise:
            off = rng.uniform(-self.noise, self.noise, len(ranges))
            moved = np.clip(ranges + off, 0.0, self.max_range)
            ranges = np.where(ranges < self.max_range, moved, ranges)
        return Scan(poses[self.beams // 2], angles, ranges, self.max_range, self.noise)


def lidar(**options) -> Lidar:
    """A sensor with other numbers than the default ones (see `Lidar`). Raises InputError."""
    made = Lidar(**options)
    least = min(made.noise, made.sweep)
    if made.beams < 2 or not 0 < made.view <= 2 * np.pi or not made.max_range > 0 or not least >= 0:
        raise InputError(
            "lidar: expected at least 2 beams, a view up to 2 pi rad, max_range > 0 m, noise of "
            f"0 m or more and a sweep of 0 s or more; got {made}."
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


def cast(poses, angles: np.ndarray, shapes: Shapes) -> np.ndarray:
    """Distance (n,) [m] along beams (n,) [rad], ascending, to the first thing; infinite where there
    is none. poses: (3,), or (n, 3) of each beam.

    Broad phase: of each shape only the beams between the angles under which it is seen from the
    middle pose, and as many more as poses and shapes move meanwhile.
    """
    n, middle = len(angles), len(angles) // 2
    poses = np.broadcast_to(np.asarray(poses, np.float64), (n, 3))
    moved, walked = np.linalg.norm(poses[:, :2] - poses[middle, :2], axis=1).max(), 0.0
    if shapes.circles.ndim == 3:
        away = shapes.circles[..., :2] - shapes.circles[middle, :, :2]
        walked = np.linalg.norm(away, axis=-1).max(initial=0.0)
    turned = np.abs(poses[:, 2] - poses[middle, 2]).max()
    ranges = np.full(n, np.inf)
    _cast_circles(ranges, poses, angles, shapes.circles, moved + walked, turned)
    if len(shapes.edges):
        _cast_edges(ranges, poses, angles, shapes.edges, moved, turned)
    return ranges


def _cast_circles(ranges, poses, angles, circles, moved, turned) -> None:
    middle = len(angles) // 2
    now = circles if circles.ndim == 2 else circles[middle]
    at, far = _polar(now, poses[middle])
    half = _half(now[:, 2] + moved, far) + turned
    beam, shape = _pairs(angles, at - half, 2 * half)
    circle = circles[shape] if circles.ndim == 2 else circles[beam, shape]
    (at, far), radius = _polar(circle, poses[beam]), circle[:, 2]
    off = angles[beam] - at
    across, along = far * np.sin(off), far * np.cos(off)
    depth = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    meets = (along > 0) & (np.abs(across) <= radius + ROUNDS)
    away = np.where(meets, along - depth, np.inf)
    np.minimum.at(ranges, beam, np.where(far <= radius, 0.0, away))


def _cast_edges(ranges, poses, angles, edges, moved, turned) -> None:
    pose = poses[len(angles) // 2]
    a, b = np.moveaxis(edges - pose[:2], 1, 0)
    seen = np.arctan2(a[:, 1], a[:, 0]) - pose[2]
    wide = np.arctan2(_cross(a, b), (a * b).sum(axis=1))
    more = turned + (_half(moved, _nearest(a, b)) if moved else 0.0)
    first = np.where(wide < 0, seen + wide, seen) - more
    beam, shape = _pairs(angles, first, np.abs(wide) + 2 * more)
    a, b = np.moveaxis(edges[shape] - poses[beam, None, :2], 1, 0)
    angle = poses[beam, 2] + angles[beam]
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    wall = b - a
    slant = _cross(along, wall)
    low, high = _nearest(a, b), np.maximum(np.hypot(*a.T), np.hypot(*b.T))
    with np.errstate(divide="ignore", invalid="ignore"):
        far = _cross(a, wall) / slant
    # a beam along a wall meets its nearest point
    far = np.where(np.isfinite(far), far, np.where(_ahead(along, a, b), low, -1.0))
    meets = (far >= -ROUNDS) & (_cross(along, a) * _cross(along, b) <= ROUNDS)
    np.minimum.at(ranges, beam, np.where(meets, np.clip(far, low, high), np.inf))


def _ahead(along: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,) does any of a wall from a to b (n, 2) lie ahead?"""
    return np.maximum((along * a).sum(axis=1), (along * b).sum(axis=1)) >= 0


def _polar(places: np.ndarray, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions [rad] and distances [m] of places (..., 2 or more) from poses (..., 3)."""
    away = places[..., :2] - poses[..., :2]
    at = np.arctan2(away[..., 1], away[..., 0]) - poses[..., 2]
    return at, np.hypot(away[..., 0], away[..., 1])


def _half(radius, far: np.ndarray) -> np.ndarray:
    """[rad] half of the angle under which a disc is seen; all around from inside of it."""
    return np.where(far > radius, np.arcsin(np.minimum(radius / np.maximum(far, 1e-12), 1)), np.pi)


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
