"""Outlines (Shapely, GeoJSON, corners, Nav2 footprints) and the few convex pieces to cover them."""

import json
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, SoundnessError, check_text, reading
from parc_jax.common.on_use import Late, package
from parc_jax.common.said import slot
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import polytope_around
from parc_jax.common.sets.rational import area
from parc_jax.common.spelling import exact
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.body import Body, Disc, Part, body_of

shapely = Late("shapely", "free space")  # for edges; what else needs it names itself
TINY = 5e-3  # [m] outlines of this size are 500 m of degrees
FARTHEST = 1e5  # [m] from the origin: farther away floats round by more than is allowed for


def outlines(name: str, value: object) -> list:
    """Polygons and lines, in the plane, of a Shapely geometry, a GeoJSON dict, anything with a
    `__geo_interface__`, or corners (n, 2). Raises InputError, which begins with `name`.
    """
    shapely = package("shapely", name)
    geometry = value if isinstance(value, shapely.Geometry) else _read(name, value)
    _require_local(name, [value, geometry])
    parts = shapely.get_parts(shapely.force_2d(geometry)).tolist()
    while any(hasattr(part, "geoms") for part in parts):
        parts = [one for part in parts for one in shapely.get_parts(part)]
    for part in parts:
        kind = part.geom_type
        if kind not in ("Polygon", "LineString", "LinearRing"):
            raise InputError(f"{name}: expected polygons and lines; got a {kind}.")
        if part.is_empty:
            raise InputError(f"{name}: expected a {kind} with corners; got an empty one.")
        require_near(name, shapely.get_coordinates(part))
        if not part.is_valid:
            why = shapely.is_valid_reason(part)
            raise InputError(
                f"{name}: expected a valid {kind}; got one with {why}. Try shapely.make_valid, and "
                "look at what it makes of it."
            )
    if not parts:
        raise InputError(f"{name}: expected at least one polygon or line; got none.")
    sides = [np.ptp(shapely.get_coordinates(part), axis=0).max() for part in parts]
    if geometry is not value and (half := float(np.median(sides))) < TINY:
        raise InputError(
            f"{name}: expected metres; half of its outlines are below {half:.2g} m. Are they "
            "degrees, as GeoJSON has them? Project them, and subtract an origin."
        )
    return parts


def require_near(name: str, places: np.ndarray) -> None:
    """Raises InputError for places (..., 2) [m] farther than FARTHEST from the origin."""
    far = np.abs(places).max(initial=0.0)
    if not far <= FARTHEST:
        raise InputError(
            f"{name}: expected finite coordinates up to {FARTHEST:g} m; got {far:g}. Subtract an "
            "origin near by first."
        )


def require_areas(name: str, region: Any) -> None:
    """Raises InputError for what is no valid Shapely Polygon or MultiPolygon near the origin."""
    if getattr(region, "geom_type", "") not in ("Polygon", "MultiPolygon") or not region.is_valid:
        raise InputError(f"{name}: expected a valid Polygon or MultiPolygon; got {region!s:.60}.")
    _require_local(name, [region])
    require_near(name, shapely.get_coordinates(region))


def place_of(place: npt.ArrayLike) -> np.ndarray:
    """(2,) [m] of x, y, or of a pose with a heading. Raises InputError."""
    found = as_float64("place (x, y)", place, (None,))
    if len(found) not in (2, 3):
        raise InputError(f"place: expected x, y or x, y, heading; got {len(found)} numbers.")
    require_near("place", found[:2])
    return found[:2]


def require_turn(name: str, heading: float, turns: int = 1) -> None:
    """Raises InputError for a heading [rad] of more turns."""
    if abs(heading) > (most := 6.3 * turns):
        raise InputError(
            f"{name}: expected rad, at most {most:.4g}; got {heading:g}. Is it in degrees? One "
            "that counts turns: math.remainder(heading, 2 * math.pi)."
        )


def _require_local(name: str, inside: list) -> None:
    """Raises InputError for a stated coordinate system: degrees, stretched metres, or far ones."""
    told: list = []
    for one in inside:  # grows: features, and what they and collections hold
        told.append(getattr(one, "crs", None))
        if isinstance(one, shapely.Geometry):
            told.append((srid := shapely.get_srid(one)) and f"SRID {srid}")
        elif isinstance(one := getattr(one, "__geo_interface__", one), dict):
            told += [one.get("crs"), one.get("coordRefSys")]  # of GeoJSON of 2008, of JSON-FG
            inside += [one.get("geometry"), *one.get("features", []), *one.get("geometries", [])]
    if any(told):
        raise InputError(
            f"{name}: expected metres from an origin near by, of no coordinate system; got "
            f"{next(filter(None, told))!s:.90}. Project it, subtract an origin, leave out its crs."
        )


def _read(name: str, value: object):
    value = getattr(value, "__geo_interface__", value)
    if not isinstance(value, dict):
        corners = as_float64(f"{name} corners", value, (None, 2))
        if len(corners) < 3:
            raise InputError(f"{name}: expected at least three corners; got {len(corners)}.")
        return shapely.Polygon(corners)
    features = value.get("features", [value])
    kinds = f"a GeoJSON geometry, feature or collection, not {value!r:.60}"
    with reading(name, kinds, Exception):  # whatever Shapely makes of a foreign dict
        told = [one.get("geometry", one) for one in features]
        if none := [i for i, one in enumerate(told) if one is None]:
            raise InputError(f"{name}: expected places; geometry of feature {none[0]} is null.")
        shapes = [shapely.geometry.shape(one) for one in told]
    return shapely.GeometryCollection(shapes)


Corner = tuple[float, float]
THIN = 1e-3  # [m] half thickness of the piece of a line


def convex_pieces(outline: object) -> tuple[HPolytope, ...]:
    """Few convex obstacles that cover a polygon, which may have holes and inlets, or lines (walls).

    outline: a Shapely geometry, a GeoJSON dict (in metres, without a crs), anything with a
        `__geo_interface__`, or corners (n, 2). Lines get pieces THIN on either side.
    Raises InputError.

    Algorithm: a constrained triangulation, of which neighbours are merged as long as they stay
    convex: at most four times as many pieces as there must be (Hertel and Mehlhorn 1983). That the
    triangles cover the polygon is checked by their areas, in exact rationals.
    """
    found: list[HPolytope] = []
    for part in outlines("convex_pieces", outline):
        if part.geom_type != "Polygon":
            ends = np.asarray(part.coords)
            found += thin_pieces(np.stack([ends[:-1], ends[1:]], axis=1))
            continue
        found += [polytope_around(corners, "convex_pieces") for corners in convex_parts(part)]
    return tuple(found)


def convex_parts(polygon: "shapely.Polygon") -> list[list[Corner]]:
    """A valid polygon as convex parts, counter-clockwise, with corners of the polygon only."""
    # neighbours are joined across their common edge as long as the result stays convex
    pieces = dict(enumerate(_triangles(polygon)))
    home = {edge: i for i, piece in pieces.items() for edge in _edges(piece)}
    inner = {tuple(sorted(edge)) for edge in home if edge[::-1] in home}
    for a, b in sorted(inner, key=lambda edge: -np.hypot(*np.subtract(*edge))):
        one, other = home[a, b], home[b, a]
        joined = _joined(pieces[one], pieces[other], a, b)
        if one != other and _is_convex(joined):
            pieces[one] = joined
            home |= dict.fromkeys(_edges(pieces.pop(other)), one)
    return list(pieces.values())


@struct.dataclass
class Edge(HPolytope):
    """An obstacle along the boundary of a region of the plane, beyond which nothing is one: for a
    start inside of it alone. region: a Shapely geometry [m], None for one in another frame, of
    which no start is said to be inside. width: as of `FreeSpace`; told: its `bounds` in words.
    """

    region: Any = struct.field(pytree_node=False, default=None)
    width: float = struct.field(pytree_node=False, default=0.0)
    told: str = struct.field(pytree_node=False, default="")

    @property
    def written(self) -> str:
        """Region as hexadecimal WKB, empty for none, width, and what was told: for `edge_of`."""
        region = self.region.wkb_hex if self.region else ""
        more = f"; {self.told}" if self.told else ""
        return f"{region} {self.width!r}{more}" if self.width or more else region

    @property
    def rests_on(self) -> str:
        """What it stands for, and what is assumed of what stands, as of `Span.said`."""
        wide = f"; all that stands is at least {slot(exact(self.width))} m wide" * (self.width > 0)
        free = "Within edges of free space nothing stands, and nothing has come since it was seen"
        told = f"; as told each time, at most: {self.told}" if self.told else ""
        return f"{free}; beyond them nothing is told{wide}{told}."

    def require_all(self, edges: "list[Edge]") -> None:
        """Raises InputError unless these, of one region, valid, cover its boundary. [T41]"""
        if self.region is None:
            return
        require_areas("obstacles", self.region)
        sides = sides_of(self.region)
        had, rows = {x.A.tobytes() + x.b.tobytes() for x in edges}, zip(*_thin(sides), strict=True)
        left = sides[[A.tobytes() + b.tobytes() not in had for A, b in rows]]
        for one in edges if len(left) else ():  # of grown ones, too, each side is in one of them
            held = (left @ one.A.T <= one.b - TOLERANCES.outline).all(axis=(1, 2))
            left = left[~held]
        if len(left):
            raise InputError(
                f"obstacles: expected all {len(sides)} edges of a free space, as it gave them; "
                f"{len(left)} of its sides are in none of those given. Take them all."
            )

    def holds(self, places: np.ndarray) -> bool:
        """Whether the hull of places (n, 2) [m] lies in the region."""
        if self.region is None or not np.isfinite(places).all():
            return False
        return bool(self.region.contains(shapely.MultiPoint(places).convex_hull))


def edge_of(obstacle: HPolytope, written: str | None) -> HPolytope:
    """The obstacle as the edge that was written so; itself for None. Raises InputError."""
    if written is None:
        return obstacle
    with reading("edge", f"text of a saved scene, not {written!r:.40}", shapely.GEOSException):
        edge, _, told = written.partition("; ")
        wkb, _, width = edge.partition(" ")
        if not 0 <= (wide := float(width or 0)) < np.inf:
            raise ValueError
        check_text("what was told of it", told)
        return Edge(obstacle.A, obstacle.b, shapely.from_wkb(wkb or None), wide, told)


def sides_of(region: "shapely.Geometry") -> np.ndarray:
    """(n, 2 ends, 2) sides of all rings of polygons."""
    rings = shapely.get_rings(shapely.get_parts(region))
    places, ring = shapely.get_coordinates(rings, return_index=True)
    return np.stack([places[:-1], places[1:]], axis=1)[ring[1:] == ring[:-1]]


def thin_pieces(segments: npt.ArrayLike) -> list[HPolytope]:
    """Each segment (n, 2 ends, 2) grown by THIN, as a rectangle of four rows, rounded outward."""
    A, b = _thin(np.asarray(segments, np.float64))
    A.setflags(write=False), b.setflags(write=False)  # as of `owned`
    return [HPolytope(rows, offsets) for rows, offsets in zip(A, b, strict=True)]


def _thin(segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows A (n, 4, 2), b (n, 4) of `thin_pieces`."""
    along = segments[:, 1] - segments[:, 0]
    length = np.hypot(*along.T)[:, None]
    along = np.where(length > 0, along / np.where(length > 0, length, 1.0), [1.0, 0.0])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    A = np.stack([along, -along, across, -across], axis=1)
    ends = (A[:, :, None] * segments[:, None]).sum(axis=-1)
    return A + 0.0, ends.max(axis=-1) + (THIN + TOLERANCES.outline)  # no -0.0, which files lose


def _triangles(polygon: "shapely.Polygon") -> list[list[Corner]]:
    """Triangles, counter-clockwise, that are the polygon. Raises SoundnessError if not."""
    shapely = package("shapely", "convex_pieces")
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    found = [_ring(part.exterior) for part in parts]
    rings = [_ring(ring) for ring in (polygon.exterior, *polygon.interiors)]
    whole, *holes = [abs(_exact_area(ring)) for ring in rings]
    if sum((abs(_exact_area(t)) for t in found), Fraction(0)) != whole - sum(holes):
        raise SoundnessError(
            "convex_pieces: the triangles of a polygon are not all of it; nothing is covered. "
            "Simplify its outline a little."
        )
    return [t if _exact_area(t) > 0 else t[::-1] for t in found]


def _ring(ring: "shapely.LinearRing") -> list[Corner]:
    return list(ring.coords)[:-1]


def _exact_area(ring: list[Corner]) -> Fraction:
    return area([(Fraction(x), Fraction(y)) for x, y in ring])


def _edges(piece: list) -> list[tuple]:
    return list(zip(piece, piece[1:] + piece[:1], strict=True))


def _joined(one: list[Corner], other: list[Corner], a: Corner, b: Corner) -> list:
    """All corners of two counter-clockwise pieces, one with the edge (a, b), the other (b, a)."""
    i, j = one.index(b), other.index(a)
    first = one[i:] + one[:i]  # b ... a
    second = other[j:] + other[:j]  # a ... b
    return first + second[1:-1]


def _is_convex(corners: list) -> bool:
    """In floats: where they are wrong a piece becomes its hull, which is more."""
    p = np.array(corners)
    ahead, after = np.roll(p, -1, axis=0) - p, np.roll(p, -2, axis=0) - np.roll(p, -1, axis=0)
    return bool((ahead[:, 0] * after[:, 1] - ahead[:, 1] * after[:, 0] >= 0).all())


BASE = "base"


@dataclass(frozen=True, eq=False)
class Footprint:
    """Reference points of a robot, from its outline: build with `read_footprint`.

    points: ("base", "corner 0", ...), names for a system's or a file's `points`. places: (n, 2) [m]
    in the robot's frame, the base first, at (0, 0). body: for `reach_avoid`, hulls of corners.
    """

    points: tuple[str, ...]
    places: np.ndarray
    body: Body

    def at(self, pose: npt.ArrayLike):
        """Places (..., n, 2) [m] of all points for poses (..., 3): x, y, heading. NumPy or JAX."""
        xp = jnp if isinstance(pose, jax.Array) else np
        pose = xp.asarray(pose)
        c, s = xp.cos(pose[..., 2]), xp.sin(pose[..., 2])
        turn = xp.stack([xp.stack([c, s], axis=-1), xp.stack([-s, c], axis=-1)], axis=-2)
        return pose[..., None, :2] + xp.asarray(self.places, pose.dtype) @ turn

    def corners(self, pose: npt.ArrayLike):
        """Places (..., n - 1, 2) [m] of the corners alone: for `free_place` and `holds`."""
        return self.at(pose)[..., 1:, :]


def read_footprint(outline: str | npt.ArrayLike) -> Footprint:
    """A body with corner points from a Nav2 footprint.

    outline: "[[0.2, 0.1], [0.2, -0.1], ...]" [m], or the numbers (n, 2), in order, either way
    round; base_link is at (0, 0). Several convex parts cover another shape. Raises InputError.
    """
    if isinstance(outline, str):
        with reading("footprint", '"[[x, y], [x, y], ...]"'):
            outline = json.loads(outline)
    corners = as_float64("footprint", outline, (None, 2))
    (polygon,) = outlines("footprint", corners)
    names = [f"corner {i}" for i in range(len(corners))]
    named = dict(zip(map(tuple, corners.tolist()), names, strict=True))
    parts = [Part(tuple(named[x] for x in part), Disc(0.0)) for part in convex_parts(polygon)]
    places = np.concatenate([np.zeros((1, 2)), corners])
    points = (BASE, *names)
    known = tuple((name, *place) for name, place in zip(points, places.tolist(), strict=True))
    return Footprint(points, places, body_of(parts).replace(places=known))
