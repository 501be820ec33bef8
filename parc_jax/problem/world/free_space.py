"""Places known to be free, and the obstacles that keep a robot among them. [T41, T44]"""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from jaxtyping import Float

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import counted
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.world.outlines import THIN, package, require_near, thin_pieces

if TYPE_CHECKING:
    import shapely

ROUND = 1.05  # chords of a quarter circle of four are nearer than its radius by 2 %, GEOS adds 1 %
SPLIT = 3  # parts of a gap, so that one of any angle is inside of chords


@dataclass(frozen=True, eq=False)
class Beams:
    """Beams of one scan, without any where a body stands, which sees nothing.

    place (2,) [m] of the sensor. angles: [rad] of the beams in the frame of the place, increasing.
    reach: [m] up to where both gaps beside a beam are free. ends: [m] where it met something,
    infinite where it met nothing. off: [m] by which that may be off, whatever errors do. grown: [m]
    by which the place may be off. more: beams by which directions may be off. closed: the last beam
    is the first.
    """

    place: np.ndarray
    angles: Float[np.ndarray, " n"]
    reach: Float[np.ndarray, " n"]
    ends: Float[np.ndarray, " n"]
    off: Float[np.ndarray, " n"]
    grown: float
    more: int
    closed: bool

    def refuted(self, region: "shapely.Geometry"):
        """What of a region that was held free is not any more: the places of ends within it; where
        something came, and all that it hides; how many beams say that something came.

        Algorithm: an end in the region takes its place, with its errors. Where all of that lies in
        the region, nothing that stood still can have caused it: in the gaps beside it only what the
        scan itself shows to be free is left. More is taken in doubt, never less.
        """
        shapely = package("shapely", "free space")
        shapely.prepare(region)
        places = self._at(np.where(np.isfinite(self.ends), self.ends, 0.0))
        met = np.flatnonzero(np.isfinite(self.ends) & shapely.contains_xy(region, places))
        spots, off = shapely.points(places[met]), self.off[met]
        discs = shapely.buffer(spots, ROUND * off, quad_segs=4)
        came = shapely.contains(region, shapely.buffer(spots, off))
        gone = shapely.Polygon()
        if came.any():
            dark = np.zeros(len(self.ends), bool)
            dark[met] = came
            grown = ROUND * (self.grown + TOLERANCES.outline)
            behind = self._behind(region, dark).buffer(grown, quad_segs=4)
            gone = region.intersection(shapely.union_all([behind, *discs[came]]))
        return shapely.union_all(discs[~came]), gone, int(came.sum())

    def drifted(self, by: float) -> "Beams":
        """The same, of a place that is off by so much [m] more."""
        return replace(self, grown=self.grown + by, off=self.off + by)

    def _behind(self, region: "shapely.Geometry", dark: np.ndarray) -> "shapely.Geometry":
        """All that lies beyond what is seen free, in the gaps beside beams (n,) bool."""
        shapely = package("shapely", "free space")
        if self.closed:
            dark[[0, -1]] = dark[0] | dark[-1]
        for _ in range(self.more):
            ring = np.pad(dark[:-1] if self.closed else dark, 1, "wrap" if self.closed else "edge")
            wider = ring[:-2] | ring[1:-1] | ring[2:]
            dark = np.append(wider, wider[0]) if self.closed else wider
        gaps = np.flatnonzero(dark[:-1] | dark[1:])
        x0, y0, x1, y1 = region.bounds
        beyond = np.abs([[x0, y0], [x1, y1]] - self.place).max(axis=0)
        share = np.linspace(0, 1, SPLIT + 1)
        found = []
        for i in gaps:
            one, other = self.angles[i : i + 2]
            angles = one + share * (other - one)
            far = max(np.hypot(*beyond), *self.reach[i : i + 2])
            rim = (far + 1.0) / np.cos((other - one) / SPLIT / 2)
            outer = self.place + rim * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            inner = self._at(self.reach)[[i + 1, i]]
            found.append(shapely.Polygon(np.concatenate([outer, inner])))
        return shapely.union_all(found)

    def _at(self, ranges: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        along = np.stack([np.cos(self.angles), np.sin(self.angles)], axis=1)
        return self.place + ranges[:, None] * along


NOTHING = np.zeros(0)
STANDS = Beams(np.zeros(2), NOTHING, NOTHING, NOTHING, NOTHING, 0.0, 0, False)


CALL = "free space"
FLATTEST = 100.0  # ratio of the axes of an ellipse, at most, so that rounding stays small


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """A closed region of the plane that is truly free of (static) obstacles: what a lidar saw free
    (`seen_from`), where the body stood (`free_place`), a map (`GridMap.free_space`), and unions.

    region: a Shapely Polygon or MultiPolygon [m]. width: [m] no obstacle is narrower than this, as
    in `seen_from`; 0 where nothing is assumed. gone: what was free until something came, and was
    not seen free since. refuting: beams that did, of the last scan that was added. beams: of what
    is known now, a scan or where the body stands; None of what is remembered.
    """

    region: Any
    width: float = 0.0
    gone: Any = None
    refuting: int = 0
    beams: Beams | None = field(default=None, repr=False)

    def __post_init__(self):
        if self.gone is None:
            object.__setattr__(self, "gone", package("shapely", CALL).Polygon())

    def add(self, other: "FreeSpace") -> "FreeSpace":
        """Both together, remembered. A hole in which no obstacle of the assumed width has room is
        free. [T41d]

        What a scan refutes of the other one leaves: places where its beams ended in what was free,
        and what lies behind, until a scan that is added later has seen it free. [T44] Two scans
        refute one another: which is the newer is not asked.
        """
        widths = [w for w in (self.width, other.width) if w]
        width = min(widths, default=0.0)
        ends, left, some = other._refuted(self.region)
        others, leaves, more = self._refuted(other.region)
        gone = left.union(leaves)
        for one, now in ((self, other), (other, self)):
            gone = gone.union(one.gone if now.beams is None else one.gone.difference(now.region))
        region = _filled(_areas(self.region.union(other.region)), width)
        for away in (ends, others, gone):
            if not away.is_empty:
                region = _areas(region.difference(away))
        return FreeSpace(region, width, gone, some + more)

    @property
    def said(self) -> str:
        """What the last scan that was added refutes, for people; empty for nothing."""
        if not self.refuting:
            return ""
        return (
            f"{counted(self.refuting, 'beam')} ended within what was known to be free: something "
            f"came, or the pose is off by more than its doubt; {self.gone.area:.2g} m² are not "
            "known to be free any more, until they are seen again"
        )

    def _refuted(self, region: "shapely.Geometry"):
        """As of `Beams.refuted`."""
        if self.beams is None or self.beams is STANDS:
            return package("shapely", CALL).Polygon(), package("shapely", CALL).Polygon(), 0
        return self.beams.refuted(region)

    def within(self, place: npt.ArrayLike, reach: float) -> "FreeSpace":
        """What of it lies in the square of half width reach [m] around a place (x, y), or (x, y,
        heading). Raises InputError.
        """
        shapely = package("shapely", CALL)
        (x, y), reach = _place(place), _length("reach", reach)
        square = shapely.box(x - reach, y - reach, x + reach, y + reach)
        parts = [_areas(one.intersection(square)) for one in (self.region, self.gone)]
        return replace(self, region=parts[0], gone=parts[1])

    def drifted(
        self, place: npt.ArrayLike, moved: float | tuple[float, float], turned: float
    ) -> "FreeSpace":
        """What of it is free for sure after the frame that it is told in has drifted, as that of
        odometry does: by at most moved [m] at a place (x, y) and by at most turned [rad]. What is
        far away loses more: keep what is near (`within`). [T41e] Raises InputError.

        moved: a radius, or of a place (x, y, heading) the half axes of an ellipse, along the
        heading and across it: a robot on wheels is told worse how far it went than where to.
        """
        middle = package("shapely", CALL).Point(_place(place))
        along, across = (_length("moved", most) for most in np.broadcast_to(moved, 2).tolist())
        turned = _length("turned", turned)
        if self.region.is_empty:
            return self
        if along == across:
            place = [middle.x, middle.y, 0.0]
        place = as_float64("place (x, y, heading)", place, (3,))
        region = _shifted(self.region, place, along, across)
        far = max(middle.hausdorff_distance(one) for one in (self.region, self.gone) if one)
        if turned and not region.is_empty:
            by = turned * middle.hausdorff_distance(region) + TOLERANCES.outline
            region = shrunk(region, by, 0.0)
        most = max(along, across) + turned * far
        gone = self.gone.buffer(ROUND * most, quad_segs=4)
        beams = None if self.beams is None or self.beams is STANDS else self.beams.drifted(most)
        return replace(self, region=region, gone=gone, beams=beams)

    def near(
        self, place: npt.ArrayLike, reach: float, tolerance: float = 0.04, most: int = 64
    ) -> "FreeSpace":
        """The part of it around a place, with few corners: its `obstacles` go to `reach_avoid`.

        place: (x, y), or (x, y, heading), of the robot. reach: [m] half width of the square around
        it that is kept. The sides of the square become obstacles as well, so nothing is assumed of
        how far a manoeuvre goes; one that leaves the square is not safe. tolerance: [m] the most
        that its boundary moves inwards, never outwards. most: pieces; where there are more, the
        tolerance is doubled, at most twice. Raises InputError where the place has no free space
        around it.
        """
        shapely = package("shapely", CALL)
        base, middle = self.within(place, reach), shapely.Point(_place(place))
        tolerance = _length("tolerance", tolerance)
        found = []
        for wider in (1, 2, 4):
            inner = shrunk(base.region, TOLERANCES.outline, wider * tolerance)
            home = [part for part in shapely.get_parts(inner) if part.contains(middle)]
            found += [replace(self, region=part) for part in home]
            if home and len(found[-1]._edges()) <= most:
                return found[-1]
        if not found:
            raise InputError(
                f"near: expected a place with free space {tolerance:g} m and more around it; "
                f"({middle.x:g}, {middle.y:g}) has none. Add a free_place where the robot stands."
            )
        return min(found, key=lambda one: len(one._edges()))

    def holds(self, corners: npt.ArrayLike, doubt: float = 0.0) -> bool:
        """Does a body, the hull of its corners (n, 2) [m], lie in it, in one part, wherever within
        a doubt [m] it is? It must at the start. [T41] Raises InputError.
        """
        shapely = package("shapely", CALL)
        body = shapely.MultiPoint(_corners(corners)).convex_hull
        gap = _length("doubt", doubt) + TOLERANCES.outline
        border = self.region.boundary
        return bool(self.region.contains(body) and not shapely.dwithin(border, body, gap))

    def obstacles(self, half_width: float = THIN) -> tuple[HPolytope, ...]:
        """Convex pieces, one an edge, that cover its boundary: a body that lies in this region
        at the start (`holds`) and touches none of them stays in it. [T41] Raises InputError.
        """
        return tuple(thin_pieces(self._edges(), _length("half_width", half_width)))

    def _edges(self) -> np.ndarray:
        """(n, 2 ends, 2) all edges of all rings. Raises InputError where there are none."""
        shapely = package("shapely", CALL)
        rings = shapely.get_rings(shapely.get_parts(self.region))
        places, ring = shapely.get_coordinates(rings, return_index=True)
        if not len(places):
            raise InputError(f"{CALL}: expected a region with an inside; this one is empty.")
        same = ring[1:] == ring[:-1]
        return np.stack([places[:-1], places[1:]], axis=1)[same]

    def __repr__(self) -> str:
        corners = counted(package("shapely", CALL).get_num_coordinates(self.region), "corner")
        return f"<FreeSpace: {self.region.area:.3g} m², {corners}>"


def free_place(corners: npt.ArrayLike, margin: float = 0.0) -> FreeSpace:
    """The hull of corners (n, 2) [m] that is known to be free: where the body stood, or stands.

    margin: [m] grown by this, as a person declares who has looked around a robot before its start;
    or negative, shrunk by it: what is left for sure of a body whose pose is in doubt by so much.
    Raises InputError.
    """
    hull = package("shapely", "free_place").MultiPoint(_corners(corners)).convex_hull
    if not (np.ndim(margin) == 0 and np.isfinite(margin)):
        raise InputError(f"free_place: expected a finite margin [m]; got {margin!r:.40}.")
    # arcs become chords, which lie inside
    place = shrunk(hull, -margin, 0.0) if margin < 0 else _areas(hull.buffer(margin))
    return FreeSpace(place, beams=STANDS)


def shrunk(region: "shapely.Geometry", by: float, tolerance: float):
    """Polygons inside of a region, `by` [m] from its boundary and not above tolerance [m] more
    where that is possible, with few corners.

    Algorithm: what Shapely proposes counts where its predicates, which are exact or bounded by
    floats, show that it lies inside, so far from the boundary; of what fails nothing is left.
    """
    shapely = package("shapely", CALL)
    if not region.is_valid:
        return shapely.Polygon()
    shapely.prepare(region)
    border = region.boundary
    shapely.prepare(border)
    rough = region.simplify(tolerance / 10, preserve_topology=False)  # makes the next step quick
    start = rough if rough.is_valid else region
    inner = start.buffer(-ROUND * (by + 0.46 * tolerance), quad_segs=4)
    for share, careful in ((0.35, False), (0.35, True), (0.2, True), (0.0, True)):
        simple = _areas(inner.simplify(share * tolerance, preserve_topology=careful))
        inside = simple.is_valid and region.contains(simple)
        if inside and not shapely.dwithin(border, simple.boundary, by):
            return simple
    return shapely.Polygon()


def _shifted(region: "shapely.Geometry", place: np.ndarray, along: float, across: float):
    """What is left wherever within an ellipse it is shifted, half axes along the heading of a place
    (3,) and across it. [T41e]

    Algorithm: in a frame that is turned to the longer axis and shortened along it, the ellipse is a
    disc.
    """
    shapely = package("shapely", CALL)
    middle, heading = place[:2], place[2] + (0.5 * np.pi if across > along else 0.0)
    along, across = max(along, across), min(along, across)
    across = max(across, along / FLATTEST) + TOLERANCES.outline
    along += TOLERANCES.outline
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    flat = np.diag([across / along, 1.0]) @ turn
    seen = shapely.transform(region, lambda places: (places - middle) @ flat.T)
    back = np.linalg.inv(flat)
    return shapely.transform(shrunk(seen, across, 0.0), lambda places: places @ back.T + middle)


def _areas(geometry: "shapely.Geometry"):
    """Its polygons alone: lines and points that operations leave over hold no body."""
    shapely = package("shapely", CALL)
    if geometry.geom_type == "Polygon":
        return geometry
    parts = shapely.get_parts(shapely.get_parts(geometry))
    parts = [part for part in parts if part.geom_type == "Polygon" and part.area > 0]
    return parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts)


def _filled(region: "shapely.Geometry", width: float):
    """Without holes that have no room for a disc of diameter width. [T41d]"""
    shapely = package("shapely", CALL)
    if not width or not shapely.get_num_interior_rings(shapely.get_parts(region)).any():
        return region
    kept = []
    for part in shapely.get_parts(region):
        holes = shapely.polygons(shapely.get_rings(part)[1:])
        x0, y0, x1, y1 = shapely.bounds(holes).T if len(holes) else np.zeros((4, 0))
        room = (shapely.area(holes) >= np.pi / 4 * width**2) & (
            np.minimum(x1 - x0, y1 - y0) >= width
        )
        rings = [hole.exterior for hole in holes[room]]
        kept.append(shapely.Polygon(part.exterior, rings))
    return shapely.union_all(kept)


def _place(place: npt.ArrayLike) -> np.ndarray:
    place = as_float64("place (x, y)", place, (None,))[:2]
    require_near("place", place)
    return place


def _corners(corners: npt.ArrayLike) -> np.ndarray:
    corners = as_float64("corners of the body", corners, (None, 2))
    require_near("corners of the body", corners)
    return corners


def _length(name: str, value: float) -> float:
    if not (np.ndim(value) == 0 and np.isfinite(value) and value >= 0):
        raise InputError(f"{CALL}: expected a {name} >= 0 m; got {value!r:.40}.")
    return float(value)
