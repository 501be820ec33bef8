"""The body of a robot: parts, each the hull of some reference points, grown by a shape. [T19]"""

from collections.abc import Sequence

import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, at_least
from parc_jax.common.errors import InputError, check_kind, is_text
from parc_jax.common.spelling import counted


@struct.dataclass
class Disc:
    """A ball of the given radius [m]; as the body of a robot, about its first reference point."""

    radius: float

    @property
    def size(self) -> float:
        """[m] of its farthest point from the middle."""
        return float(self.radius)


@struct.dataclass
class Polygon:
    """The convex hull of vertices (v, n_p) [m], which does not turn with the robot; as the body of
    a robot, about its first reference point.
    """

    vertices: np.ndarray

    @property
    def size(self) -> float:
        """[m] of its farthest point from the reference point."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    def __repr__(self) -> str:
        return f"Polygon of {counted(len(self.vertices), 'vertex', 'vertices')}"


@struct.dataclass
class Part:
    """The convex hull of some reference points, grown by a shape (Minkowski sum).

    points: names of reference points, or their numbers from 0.
    """

    points: tuple[str | int, ...] = struct.field(pytree_node=False)
    shape: Disc | Polygon

    def __repr__(self) -> str:
        names = ", ".join(str(p) for p in self.points)
        grown = f", grown by {self.shape!r}" if self.shape != Disc(0.0) else ""
        return f"hull of {names}{grown}"


@struct.dataclass
class Body:
    """Parts that turn and move with the reference points. Build with `body_of` or `hull`.

    places: points and where they are [m] on the robot, in any frame of it, where that is known: a
    model that begins with them elsewhere is refused.
    """

    parts: tuple[Part, ...]
    places: tuple[tuple[str, float, float], ...] = struct.field(pytree_node=False, default=())

    def __repr__(self) -> str:
        return f"Body({'; '.join(map(repr, self.parts))})"


def hull(*points: str | int, radius: float = 0.0) -> Body:
    """A body that is the hull of these reference points, grown by a radius [m]: four corners are a
    rectangle, eight a box, two a capsule, one a disc or ball. Raises InputError.
    """
    return body_of([Part(points, Disc(radius))])


def body_of(parts: Sequence[Part | Body]) -> Body:
    """A validated body of several parts. Raises InputError."""
    flat, valid, places = [], [], []
    for part in parts:
        flat += part.parts if isinstance(part, Body) else [part]
        places += part.places if isinstance(part, Body) else []
    if not flat:
        raise InputError("body: expected at least one part; got none.")
    for i, part in enumerate(flat):
        name = f"part {i} of the body"
        check_kind(name, part, Part)
        if len(part.points) == 0:
            raise InputError(f"{name}: expected at least one reference point; got none.")
        for point in part.points:
            if not (isinstance(point, int | np.integer) or is_text(point)):
                raise InputError(f"{name}: expected names or numbers of points; got {point!r}.")
        valid.append(Part(tuple(part.points), shape(name, part.shape)))
    return Body(tuple(valid), tuple(places))


def shape(name: str, value) -> Disc | Polygon:
    """A validated disc or polygon; a number is taken as a radius [m]. Raises InputError."""
    if isinstance(value, Polygon):
        vertices = as_float64(f"{name} vertices", value.vertices, (None, None))
        if len(vertices) == 0:
            raise InputError(
                f"{name}: expected a polygon with at least one vertex; got none. For a point use "
                "radius 0."
            )
        return Polygon(vertices)
    return Disc(at_least(f"{name} radius", value.radius if isinstance(value, Disc) else value))


def parts_of(robot: Disc | Polygon | Body) -> tuple[Part, ...]:
    """The parts of any kind of body."""
    return robot.parts if isinstance(robot, Body) else (Part((0,), robot),)


def numbered(robot: Disc | Polygon | Body, points: Sequence[str]) -> tuple[Part, ...]:
    """The parts, with numbers of their points in place of names. points: names of the robot's.

    Raises InputError.
    """
    out = []
    for i, part in enumerate(parts_of(robot)):
        numbers = tuple(number_of(p, points, f"part {i} of the body") for p in part.points)
        out.append(part.replace(points=numbers))
    return tuple(out)


def number_of(point: str | int, points: Sequence[str], name: str) -> int:
    """The number of a reference point given by name or number. Raises InputError."""
    if isinstance(point, str) and point in points:
        return tuple(points).index(point)
    if isinstance(point, int | np.integer) and 0 <= point < len(points):
        return int(point)
    raise InputError(f"{name}: expected reference points ({', '.join(points)}); got {point!r}.")
