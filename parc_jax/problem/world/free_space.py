"""Free space, and the obstacles that keep a robot inside it. [T41, T44]"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
from jaxtyping import Float

from parc_jax.common.arrays import as_float64, at_least
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.on_use import Late, package
from parc_jax.common.said import slot
from parc_jax.common.spelling import counted, exact, rounded_down
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.world import outlines
from parc_jax.problem.world.outlines import Edge, place_of, sides_of, thin_pieces

CALL = "free space"
shapely = Late("shapely", CALL)
ROUND = 1.05  # chords of a quarter circle of four are nearer than its radius by 2 %, GEOS adds 1 %
SPLIT = 3  # parts of a gap, so that one of any angle is inside of chords


@dataclass(frozen=True, eq=False)
class Beams:
    """Beams of one scan; none, as in `STANDS`, of a place where the body stands.

    place: (2,) [m] of the sensor.
    angles: (n,) [rad] of the beams in the frame of the place, increasing.
    reach: (n,) [m] up to which both gaps beside a beam are free.
    ends: (n,) [m] ranges of hits, infinite without a hit.
    off: (n,) [m] bound of the error of a hit.
    grown: [m] bound of the error of the place.
    more: bound of the error of a direction, in beams.
    closed: the last beam is the first.
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
        """The part of a free region that this scan refutes: hits near its border; new obstacles and
        all that they hide; the number of beams that hit new obstacles.

        Algorithm: a hit in the region removes its place, with its errors. If all of that lies in
        the region, no obstacle that stood still can have caused it: in the gaps beside it only the
        free part of the scan itself is left. Errors remove more, never less.
        """
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
            gone = _areas(region.intersection(shapely.union_all([behind, *discs[came]])))
        once = met < len(self.ends) - self.closed  # the last beam is the first
        return shapely.union_all(discs[~came]), gone, int((came & once).sum())

    def drifted(self, place: np.ndarray, moved: float, turned: float) -> "Beams":
        """The same beams with a pose that is less certain by so much, as of `FreeSpace.drifted`."""
        moved += turned * np.hypot(*(self.place - place[:2]))
        off = self.off + moved + turned * np.where(np.isfinite(self.ends), self.ends, 0.0)
        more = int(np.ceil(turned / np.diff(self.angles).min()))
        kept = {"reach": -self._most(-self.reach, more), "more": self.more + more}
        return replace(self, off=off, grown=self.grown + moved, **kept)

    def _behind(self, region: "shapely.Geometry", dark: np.ndarray) -> "shapely.Geometry":
        """The area beyond the free part, in the gaps beside beams (n,) bool."""
        if self.closed:  # the first beam stands at both ends
            dark[[0, -1]] = dark[0] | dark[-1]
        dark = self._most(dark, self.more)
        gaps = np.flatnonzero(dark[:-1] | dark[1:])
        x0, y0, x1, y1 = region.bounds
        beyond = np.abs([[x0, y0], [x1, y1]] - self.place).max(axis=0)
        share = np.linspace(0, 1, SPLIT + 1)
        parts = []
        for i in gaps:
            one, other = self.angles[i : i + 2]
            angles = one + share * (other - one)
            far = max(np.hypot(*beyond), *self.reach[i : i + 2])
            # chords between these points stay beyond the region
            rim = (far + 1.0) / np.cos((other - one) / SPLIT / 2)
            outer = self.place + rim * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            inner = self._at(self.reach)[[i + 1, i]]
            parts.append(shapely.Polygon(np.concatenate([outer, inner])))
        return shapely.union_all(parts)

    def _most(self, of: np.ndarray, by: int) -> np.ndarray:
        """(n,) the largest of each beam and of so many to either side."""
        by, mode = min(by, len(of)), "wrap" if self.closed else "edge"
        wide = np.pad(of[: len(of) - self.closed], (by, by + self.closed), mode)
        return np.lib.stride_tricks.sliding_window_view(wide, 2 * by + 1).max(axis=1)

    def _at(self, ranges: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        along = np.stack([np.cos(self.angles), np.sin(self.angles)], axis=1)
        return self.place + ranges[:, None] * along


STANDS = Beams(np.zeros(2), *[np.zeros(0)] * 4, 0.0, 0, False)
BOUNDS = {  # what may be told, and of what: from the least, which alone is sure, to the most
    "noise": "ranges are off by {} m",
    "angle_error": "beams by {} rad",
    "place": "poses by {} m",
    "heading": "headings by {} rad",
    "max_range": "beams without a return are free up to {} m",
    "moved": "the frame drifts by {} m",
    "turned": "it turns by {} rad",
    "margin": "{} m around a body are seen to be free",
    "occupied": "free cells of a map are occupied with less than {}",
}
FLATTEST = 100.0  # ratio of the axes of an ellipse, at most, so that rounding stays small


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """A closed region of the plane that is truly free of (static) obstacles: from a lidar
    (`seen_from`), under the body (`free_place`), of a map (`GridMap.free_space`), and unions.

    region: a valid Shapely Polygon or MultiPolygon [m]; others raise InputError.
    width: [m] least width of an obstacle, as in `seen_from`; 0 without an assumption.
    gone: area that was refuted, and not measured free since.
    standing: what is not free on a map, nor was measured free since: no hole that may be filled.
    refuting: number of beams that refuted some of it, of the last scan that was added.
    beams: of the current scan, `STANDS` under the body; None of a memory.
    newer: what was seen since the last `forget`; None without one.
    memory: scans are in it that can refute nothing any more, so `add` does not take it for newer.
    bounds: the least and the most that was told of anything, as in BOUNDS.
    drift: ([m], [rad]) sums since the oldest of the region was seen; of ellipses, of shorter axes.
    """

    region: Any
    width: float = 0.0
    gone: Any = field(default_factory=lambda: shapely.Polygon())
    standing: Any = field(default_factory=lambda: shapely.Polygon())
    refuting: int = 0
    beams: Beams | None = field(default=None, repr=False)
    newer: "FreeSpace | None" = field(default=None, repr=False)
    memory: bool = field(default=False, repr=False)
    bounds: Mapping[str, tuple[float, ...]] = field(default_factory=dict, repr=False)
    drift: tuple[Fraction, ...] = field(default=(Fraction(0),) * 2, repr=False)

    def __post_init__(self):
        object.__setattr__(self, "width", at_least(f"{CALL} width", self.width))
        for area in (self.region, self.gone, self.standing):
            outlines.require_areas(CALL, area)

    def add(self, other: "FreeSpace") -> "FreeSpace":
        """The union, as a memory. A hole too small for an obstacle of the assumed width is free.
        [T41d] other: a scan, a place or a map that is no older than this: nothing here knows times,
        and the scan added is believed. Raises InputError for a memory.

        The part that a scan refutes leaves: places of its hits inside the other region, and the
        area behind them, until a later scan measures it free. [T44] Two scans refute each other.
        """
        if other.memory:
            raise InputError(
                f"{CALL} add: expected a scan or a place; got a memory, whose scans can refute "
                "nothing any more. Add this to it, or its scans one by one, as they were made."
            )
        widths = [w for w in (self.width, other.width) if w]
        ends, left, some = (other.beams or STANDS).refuted(self.region)
        others, leaves, more = (self.beams or STANDS).refuted(other.region)
        # only what is newer measures free what was refuted
        seen = shapely.Polygon() if other.beams is None else other.region
        gone = _union(left, leaves, _areas(self.gone.difference(seen)), other.gone)
        standing = _union(_areas(self.standing.difference(seen)), other.standing)
        # holes are filled before refuted parts leave, which would look like holes
        region = _filled(_union(self.region, other.region), min(widths, default=0.0))
        for away in (ends, others, gone, standing):
            if not away.is_empty:
                region = _areas(region.difference(away))
        newer, width = self.newer and self.newer.add(other), max(widths, default=0.0)
        told = _ends(self.bounds, other.bounds), tuple(map(max, self.drift, other.drift))
        return FreeSpace(region, width, gone, standing, some + more, None, newer, True, *told)

    def forget(self) -> "FreeSpace":
        """What was seen since the last call alone is free, all of it at the first call: called
        every t seconds, no place stays free that was not seen for 2t. [T44]
        """
        newer = FreeSpace(shapely.Polygon(), self.width)
        if self.newer is None:
            return replace(self, beams=None, newer=newer, memory=True)
        # a later scan may have refuted there what it could not refute within the newer part alone
        left = _areas(self.newer.region.intersection(self.region))
        gone = _areas(self.gone.union(self.region).difference(left))
        told = {"beams": None, "newer": newer, "memory": True, "drift": self.newer.drift}
        return replace(self, region=left, gone=gone, refuting=0, **told)

    @property
    def said(self) -> str:
        """A sentence about the part that the last scan refuted; empty for none."""
        if not self.refuting:
            return ""
        return (
            f"{counted(self.refuting, 'beam')} ended within what was known to be free: something "
            f"came, or the pose is off by more than its uncertainty; {self.gone.area:.2g} m² are "
            "not known to be free any more, until they are seen again"
        )

    def within(self, place: npt.ArrayLike, reach: float) -> "FreeSpace":
        """Its part in a square, reach [m] to each side of (x, y[, heading]). Raises InputError."""
        (x, y), reach = place_of(place), at_least(f"{CALL} reach", reach)
        square = shapely.box(x - reach, y - reach, x + reach, y + reach)
        parts = [_areas(g.intersection(square)) for g in (self.region, self.gone, self.standing)]
        newer = self.newer and self.newer.within(place, reach)
        return replace(self, region=parts[0], gone=parts[1], standing=parts[2], newer=newer)

    def drifted(
        self, place: npt.ArrayLike, moved: float | tuple[float, float], turned: float
    ) -> "FreeSpace":
        """The part that is still free after its frame has drifted, as that of odometry does. [T41e]

        place: (x, y) [m] at which the drift is bounded, or (x, y, heading).
        moved: [m] bound, a radius, or half axes of an ellipse along the heading and across it:
            odometry of wheels is worse along.
        turned: [rad] bound. Far parts lose more: restrict it first (`within`). Raises InputError.
        """
        middle = shapely.Point(place_of(place))
        along, across = (at_least(f"{CALL} moved", x) for x in np.broadcast_to(moved, 2).tolist())
        turned = at_least(f"{CALL} turned", turned)
        newer = self.newer and self.newer.drifted(place, moved, turned)
        if along == across:
            place = [middle.x, middle.y, 0.0]
        place = as_float64("place (x, y, heading)", place, (3,))
        region = _shifted(self.region, place, along, across)
        far = [middle.hausdorff_distance(x.convex_hull) for x in (self.gone, self.standing) if x]
        if turned and not region.is_empty:
            by = turned * middle.hausdorff_distance(region.convex_hull) + TOLERANCES.outline
            region = shrunk(region, by, 0.0)
        most = max(along, across)
        by = ROUND * (most + turned * max(far, default=0.0) + TOLERANCES.outline)
        gone, standing = (x.buffer(by, quad_segs=4) for x in (self.gone, self.standing))
        beams = x.drifted(place, most, turned) if (x := self.beams) and len(x.angles) else x
        bounds = _ends(self.bounds, {"moved": (along, across), "turned": (turned,)})
        since = zip(self.drift, (min(along, across), turned), strict=True)
        drift = tuple(bool(region) * (x + Fraction(exact(y))) for x, y in since)
        told = {"gone": gone, "standing": standing, "beams": beams, "newer": newer}
        return replace(self, region=region, bounds=bounds, drift=drift, **told)

    def near(
        self, place: npt.ArrayLike, reach: float, tolerance: float = 0.04, most: int = 64
    ) -> "FreeSpace":
        """The part around a place, with few corners: its `obstacles` go to `reach_avoid`.

        place: (x, y), or (x, y, heading), of the robot.
        reach: [m] half width of the square around it. The sides of the square become obstacles as
            well: a manoeuvre that leaves it is not safe.
        tolerance: [m] bound by which the boundary moves inwards; it never moves outwards.
        most: pieces; where there are more, the tolerance is doubled, at most twice.
        Raises InputError where the place has no free space around it.
        """
        base, middle = self.within(place, reach), shapely.Point(place_of(place))
        tolerance = at_least(f"{CALL} tolerance", tolerance)
        check_count("near most", most, 1, "64")
        found = []
        for wider in (1, 2, 4):
            inner = shrunk(base.region, TOLERANCES.outline, wider * tolerance)
            home = [part for part in shapely.get_parts(inner) if part.contains(middle)]
            found += [replace(self, region=part) for part in home]
            if home and len(sides_of(found[-1].region)) <= most:
                return found[-1]
        if not found:
            raise InputError(
                f"near: expected a place with free space {tolerance:g} m and more around it; "
                f"({middle.x:g}, {middle.y:g}) has none. Add a free_place where the robot "
                "stands; a pilot does so for its `margin` after a `restart`."
            )
        return min(found, key=lambda one: len(sides_of(one.region)))

    def holds(self, corners: npt.ArrayLike, uncertainty: float = 0.0) -> bool:
        """Does a body lie inside, in one part? It must at the start. [T41]

        corners: (n, 2) [m], the body is their hull.
        uncertainty: [m] bound of the error of its place. Raises InputError.
        """
        body = shapely.MultiPoint(_corners(corners)).convex_hull
        gap = at_least(f"{CALL} uncertainty", uncertainty) + TOLERANCES.outline
        border = self.region.boundary
        return bool(self.region.contains(body) and not shapely.dwithin(border, body, gap))

    def obstacles(self) -> tuple[Edge, ...]:
        """Convex pieces, one an edge, that cover its boundary: a body that lies in this region at
        the start and touches none of them stays in it; another is refused. Raises InputError. [T41]
        """
        if self.region.is_empty:
            raise InputError(f"{CALL}: expected a region with an inside; this one is empty.")
        ends = {x: slot(*map(exact, of)) for x, of in self.bounds.items()}
        told = {x: words.format(ends[x]) for x, words in BOUNDS.items() if x in ends}
        if "turned" in told:  # no more than was allowed for
            off, by = (slot(rounded_down(x)) for x in self.drift)
            told["turned"] += f", in all by {off} m and {by} rad since the oldest of it was seen"
        of = self.region, float(self.width), ", ".join(told.values())
        return tuple(Edge(one.A, one.b, *of) for one in thin_pieces(sides_of(self.region)))

    def __repr__(self) -> str:
        corners = counted(shapely.get_num_coordinates(self.region), "corner")
        return f"<FreeSpace: {self.region.area:.3g} m², {corners}>"


def free_place(corners: npt.ArrayLike, margin: float = 0.0) -> FreeSpace:
    """The free space under a body, the hull of its corners (n, 2) [m].

    margin: [m] grown by this, declared by a person who has looked around the robot before its
        start; negative: shrunk by the uncertainty of the pose. Raises InputError.
    """
    hull = package("shapely", "free_place").MultiPoint(_corners(corners)).convex_hull
    margin = float(as_float64("free_place margin", margin, ()))
    # arcs become chords, which lie inside
    place = shrunk(hull, -margin, 0.0) if margin < 0 else _areas(hull.buffer(margin))
    told = {"margin": (margin,)} if margin > 0 else {"place": (-margin,)} if margin < 0 else {}
    return FreeSpace(place, beams=STANDS, bounds=told)


def shrunk(region: "shapely.Geometry", by: float, tolerance: float):
    """Polygons inside of a region, `by` [m] from its boundary and not above tolerance [m] more
    where that is possible, with few corners.

    Algorithm: a proposal of Shapely counts if its predicates, which are exact or bounded by
    floats, show that it lies inside, so far from the boundary; else nothing is left.
    """
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
    """The erosion by an ellipse with half axes along the heading of a place (3,) and across. [T41e]

    Algorithm: in a frame turned to the longer axis and shortened along it, the ellipse is a disc.
    """
    middle, heading = place[:2], place[2] + (0.5 * np.pi if across > along else 0.0)
    along, across = max(along, across), min(along, across)
    across = max(across, along / FLATTEST) + TOLERANCES.outline
    along += TOLERANCES.outline
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    flat = np.diag([across / along, 1.0]) @ turn
    seen = shapely.transform(region, lambda places: (places - middle) @ flat.T)
    back, left = np.linalg.inv(flat), shrunk(seen, across, 0.0)
    left = shapely.transform(left, lambda places: places @ back.T + middle)
    return left if left.is_valid else shapely.Polygon()


def _areas(geometry: "shapely.Geometry"):
    """Its polygons only: lines and points left over by operations hold no body."""
    if geometry.geom_type == "Polygon":
        return geometry
    parts = shapely.get_parts(shapely.get_parts(geometry))
    parts = [part for part in parts if part.geom_type == "Polygon" and part.area > 0]
    return parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts)


def _union(*areas: "shapely.Geometry"):
    return _areas(shapely.union_all(areas))  # of areas alone, but it too leaves lines over


def _filled(region: "shapely.Geometry", width: float):
    """The region without holes too small for a disc of diameter width. [T41d]"""
    if not width or not shapely.get_num_interior_rings(shapely.get_parts(region)).any():
        return region
    out = []
    for part in shapely.get_parts(region):
        x0, y0, x1, y1 = shapely.bounds(part.interiors).T if part.interiors else np.zeros((4, 0))
        area = np.array([shapely.Polygon(hole).area for hole in part.interiors])
        large = (area >= np.pi / 4 * width**2) & (np.minimum(x1 - x0, y1 - y0) >= width)
        holes = [hole for hole, stays in zip(part.interiors, large, strict=True) if stays]
        out.append(shapely.Polygon(part.exterior, holes))
    return _union(*out)


def _ends(one: Mapping[str, tuple], other: Mapping[str, tuple]) -> dict[str, tuple]:
    """The least and the most that was told of anything in both."""
    both = {x: (*one.get(x, ()), *other.get(x, ())) for x in {**one, **other}}
    return {x: (min(of), max(of)) for x, of in both.items()}


def _corners(corners: npt.ArrayLike) -> np.ndarray:
    corners = as_float64("corners of the body", corners, (None, 2))
    outlines.require_near("corners of the body", corners)
    return corners
