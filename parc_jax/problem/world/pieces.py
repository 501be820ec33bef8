"""Convex pieces that cover: of polygons, also with holes, and thin ones of lines."""

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.hull import polytope_around
from parc_jax.common.sets.rational import area
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.world.outlines import outlines, package

if TYPE_CHECKING:
    import shapely

Corner = tuple[float, float]
THIN = 1e-3  # [m] half thickness of the piece of a line


def convex_pieces(outline: object, tolerance: float = 0.0) -> tuple[HPolytope, ...]:
    """Few convex obstacles that cover a polygon, which may have holes and inlets, or lines (walls).

    outline: a Shapely geometry, a GeoJSON dict (in metres, not degrees), anything with a
    `__geo_interface__`, or corners (n, 2). tolerance: [m] by how much more than the outline may be
    covered, where that saves corners and so pieces; never is it less. Lines get pieces THIN on
    either side. Raises InputError.

    Algorithm: a constrained triangulation, of which neighbours are merged as long as they stay
    convex: at most four times as many pieces as there must be (Hertel and Mehlhorn 1983). That the
    triangles are the whole polygon is checked by their areas, in exact rationals.
    """
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise InputError(f"convex_pieces: expected a tolerance >= 0 m; got {tolerance!r:.40}.")
    found: list[HPolytope] = []
    for part in outlines("convex_pieces", outline):
        if part.geom_type != "Polygon":
            ends = np.asarray(part.coords)
            found += thin_pieces(np.stack([ends[:-1], ends[1:]], axis=1))
            continue
        simple = _simpler(part, tolerance) if tolerance else part
        found += [polytope_around(corners, "convex_pieces") for corners in convex_parts(simple)]
    return tuple(found)


def convex_parts(polygon: "shapely.Polygon") -> list[list[Corner]]:
    """Convex parts, counter-clockwise, that are a valid polygon; their corners are its own."""
    return _merged(_triangles(polygon))


def thin_pieces(segments: npt.ArrayLike, half_width: float = THIN) -> list[HPolytope]:
    """Each segment (n, 2 ends, 2) grown by a half width [m], as a rectangle of four rows that holds
    all of it, whatever floats round.
    """
    segments = np.asarray(segments, np.float64)
    along = segments[:, 1] - segments[:, 0]
    length = np.hypot(*along.T)[:, None]
    along = np.where(length > 0, along / np.where(length > 0, length, 1.0), [1.0, 0.0])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    A = np.stack([along, -along, across, -across], axis=1)
    ends = (A[:, :, None] * segments[:, None]).sum(axis=-1)
    b = ends.max(axis=-1) + (half_width + TOLERANCES.outline)
    return [HPolytope(rows, offsets) for rows, offsets in zip(A, b, strict=True)]


def _simpler(polygon: "shapely.Polygon", tolerance: float):
    """A polygon around this one, within the tolerance of it, with fewer corners; or this one."""
    shapely = package("shapely", "convex_pieces")
    wide = polygon.buffer(tolerance / 2, quad_segs=2)
    simple = wide.simplify(0.45 * tolerance)
    around = simple.is_valid and simple.contains(polygon)
    fewer = shapely.get_num_coordinates(simple) < shapely.get_num_coordinates(polygon)
    return simple if around and fewer else polygon


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


def _merged(triangles: list[list[Corner]]) -> list[list[Corner]]:
    """Neighbours joined across their common edge as long as what comes is convex."""
    pieces = dict(enumerate(triangles))
    home = {edge: i for i, piece in pieces.items() for edge in _edges(piece)}
    inner = {tuple(sorted(edge)) for edge in home if edge[::-1] in home}
    for a, b in sorted(inner, key=lambda edge: -np.hypot(*np.subtract(*edge))):
        one, other = home[a, b], home[b, a]
        joined = _joined(pieces[one], pieces[other], a, b)
        if one != other and _is_convex(joined):
            pieces[one] = joined
            home |= dict.fromkeys(_edges(pieces.pop(other)), one)
    return list(pieces.values())


def _edges(piece: list) -> list[tuple]:
    return list(zip(piece, piece[1:] + piece[:1], strict=True))


def _joined(one: list[Corner], other: list[Corner], a: Corner, b: Corner) -> list:
    """All corners of two counter-clockwise pieces, one with the edge (a, b), the other (b, a)."""
    i, j = one.index(b), other.index(a)
    first = one[i:] + one[:i]  # b ... a
    second = other[j:] + other[:j]  # a ... b
    return first + second[1:-1]


def _is_convex(corners: list) -> bool:
    """In floats: what they get wrong makes a piece its hull, which is more."""
    p = np.array(corners)
    ahead, after = np.roll(p, -1, axis=0) - p, np.roll(p, -2, axis=0) - np.roll(p, -1, axis=0)
    return bool((ahead[:, 0] * after[:, 1] - ahead[:, 1] * after[:, 0] >= 0).all())
