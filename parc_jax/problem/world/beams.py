"""What one scan says of places that were held to be free before it. [T44]"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.world.outlines import package

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
