"""The room around a car among the obstacles of a case: how much there is, how much a manoeuvre has
to have, and how far it is for a car in it.
"""

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt, label, minimum_filter
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from shapely import affinity

from sims.parking import car as c
from sims.parking.cases import Case
from sims.parking.kinematics import compose, ends

CELL = 0.05  # [m] of the grid of distances
BORDER = 11.0  # [m] of grid around start and goal
SPACING = 0.2  # [m] between points of the outline
LIKED = 0.35  # [m] of clearance that is liked: more is not told apart
TIGHT = 0.25  # [m] of clearance below which outlines are asked, not the grid
# [m] of clearance beside a tube's; a manoeuvre needs none above this share of that at start or goal
LEAST, ENOUGH = 0.01, 0.7
DISC = 0.7  # [m] radius of a disc around the rear axle that is in the car
DISCS = 4  # along the car, that together hold it
BLOCK, SECTORS = 0.4, 24  # [m] and number of headings of the grid of ways
# [m] from the middle line of the car that the grid of ways keeps free: nearly the car, and less
# where that comes nowhere, which takes so much longer [s]
WIDE, NARROW, SQUEEZED = 0.92, 0.6, 15.0
PACE = (1.0, 0.5)  # [m/s] at which a way is thought to be driven, stops included: straight, turning
UNREACHED = 90.0  # [s] that a place counts as to which no way leads


class Space:
    """The room in a case. turned: [rad], so its grids lie. share: of its tube's width by which a
    manoeuvre has to be clear.
    """

    def __init__(self, case: Case, turned: float = 0.0):
        self.share, self._goal = 1.0, case.goal
        self._frame = np.array([0.0, 0.0, turned])
        both = self.seen(np.stack([case.start, case.goal]))[:, :2]
        self._lo = both.min(axis=0) - BORDER
        shape = np.ceil((both.max(axis=0) + BORDER - self._lo) / CELL).astype(int) + 1
        x, y = (self._lo[i] + CELL * np.arange(n) for i, n in enumerate(shape))
        shapes = [affinity.rotate(one, turned, (0, 0), use_radians=True) for one in case.shapes]
        self._filled = shapely.union_all(shapes).buffer(0)
        self._far = np.full(shape, 1e3, np.float32)
        if not self._filled.is_empty:
            shapely.prepare(self._filled)
            occupied = shapely.contains_xy(self._filled, *np.meshgrid(x, y, indexing="ij"))
            away = distance_transform_edt(~occupied)
            self._far = (CELL * np.maximum(away - 0.7, 0.0)).astype(np.float32)
        for edge in (0, -1):  # what is beyond counts as occupied
            self._far[edge], self._far[:, edge] = 0.0, 0.0
        half = 0.5 * c.LENGTH / DISCS
        self._inside = half - 2 * CELL  # [m] from a disc's middle is in the car
        self._along = half * (2 * np.arange(DISCS) + 1) - c.BEHIND
        self._radius = float(np.hypot(half, 0.5 * c.WIDTH))
        self._outline = outline()
        self._graphs = []

    def seen(self, poses: np.ndarray) -> np.ndarray:
        """Poses (..., 3) as the grids lie."""
        return compose(self._frame, poses)

    def distance(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """[m] from places, as the grids lie, to obstacles: up to 6 cm too little, or CELL too much
        beside a narrow corner; none beyond the grid.
        """
        n, m = self._far.shape
        i = np.clip(((x - self._lo[0]) * (1 / CELL) + 0.5).astype(np.int32), 0, n - 1)
        j = np.clip(((y - self._lo[1]) * (1 / CELL) + 0.5).astype(np.int32), 0, m - 1)
        return self._far.ravel()[i * m + j]

    def around(self, poses: np.ndarray, exact: bool = False) -> np.ndarray:
        """(n,) [m] that the car is clear at poses (n, 3), about; not more than LIKED. exact: where
        it is tight the outlines are asked.
        """
        poses = self.seen(poses)
        x, y, cos, sin = *poses[:, :2].T, np.cos(poses[:, 2]), np.sin(poses[:, 2])
        discs = self._along * np.stack([cos, sin])[..., None]
        away = self.distance(x[:, None] + discs[0], y[:, None] + discs[1]).min(axis=1)
        found = np.clip(away - self._radius, 0.0, LIKED).astype(float)
        near = np.flatnonzero((found < LIKED) & (away > self._inside))
        if len(near):
            ahead, left = self._outline
            cos, sin = cos[near, None], sin[near, None]
            px = x[near, None] + cos * ahead - sin * left
            py = y[near, None] + sin * ahead + cos * left
            least = self.distance(px, py).min(axis=1).astype(float)
            least = np.sqrt(np.maximum(least**2 - (SPACING / 2) ** 2, 0.0))
            if exact:
                tight = np.flatnonzero(least < TIGHT)
                bodies = shapely.polygons(c.corners(*poses[near[tight]].T)[:, 1:])
                least[tight] = shapely.distance(bodies, self._filled)
            found[near] = np.minimum(least, LIKED)
        return found

    def room(self, pose: np.ndarray, exact: bool = False) -> float:
        """[m] of clearance that no manoeuvre from a pose (3,) has to have: it and the goal have
        little more.
        """
        return ENOUGH * float(self.around(np.array([pose, self._goal]), exact).min())

    def needed(self, widths, room: float):
        """[m] of clearance that manoeuvres have to have, of their tubes' widths [m], and `room`."""
        return np.minimum(self.share * widths + LEAST, room)

    def clears(self, poses: np.ndarray, width: float) -> bool:
        """Has a manoeuvre along poses (n, 3) the clearance that it needs?"""
        least = float(self.around(poses, True).min())
        return least >= self.needed(width, self.room(poses[0], True))

    def joins(self, one: np.ndarray, other: np.ndarray) -> bool:
        """Does a way lead from a place (2,) to another for a disc in the car?"""
        parts = label(self._far > DISC)[0]
        both = self.seen(np.array([[*one, 0.0], [*other, 0.0]]))[:, :2]
        i, j = np.rint((both - self._lo) / CELL).astype(int).T
        return bool(parts[i[0], j[0]] == parts[i[1], j[1]] != 0)

    def ways_from(self, start: np.ndarray) -> np.ndarray:
        """[s] (heading, x, y) about how long it takes from a pose (3,) to the poses of a grid;
        UNREACHED where not even a narrower car comes.
        """
        if not self._graphs:
            self._graphs = [self._graph(WIDE), self._graph(NARROW)]
        found = []
        for graph, shape in self._graphs:
            here = np.ravel_multi_index(self._cell(start[None], shape), shape)
            took = dijkstra(graph, directed=False, indices=here, min_only=True).reshape(shape)
            # moves of two blocks leave every other one out
            found.append(minimum_filter(took, (1, 3, 3)))
        return np.minimum(np.minimum(found[0], found[1] + SQUEEZED), UNREACHED)

    def takes(self, ways: np.ndarray, poses: np.ndarray) -> np.ndarray:
        """(n,) [s] at poses (n, 3), of what `ways_from` returned."""
        return ways[self._cell(poses, ways.shape)]

    def _cell(self, poses, shape):
        poses = self.seen(poses)
        at = np.floor((poses[:, :2] - self._lo) / BLOCK).astype(int)
        i, j = np.clip(at, 0, np.array(shape[1:]) - 1).T
        return np.rint(poses[:, 2] / (2 * np.pi) * shape[0]).astype(int) % shape[0], i, j

    def _graph(self, width: float):
        shape = SECTORS, *np.floor(np.array(self._far.shape) * CELL / BLOCK).astype(int)
        h, i, j = (one.ravel() for one in np.indices(shape))
        heading = 2 * np.pi * np.arange(SECTORS) / SECTORS
        x, y = self._lo[0] + BLOCK * (i + 0.5), self._lo[1] + BLOCK * (j + 0.5)
        cos, sin = np.cos(heading)[h, None], np.sin(heading)[h, None]
        away = self.distance(x[:, None] + cos * self._along, y[:, None] + sin * self._along)
        free = away.min(axis=1) > width
        # of each heading: straight on, or to the next heading on either side, in both gears
        turn = 2 * np.pi / SECTORS
        way = turn * c.WHEELBASE / np.tan(c.TURN)
        rows, columns, costs = [], [], []
        for side in (-1, 0, 1):  # the other gear is the same edge the other way
            move = ends(np.array([[way, side * 1.0, side * 1.0]]))[0, 0]
            shift = compose(np.stack([0 * heading, 0 * heading, heading], axis=1), move[None])
            di, dj = np.rint(shift[:, :2] / BLOCK).astype(int).T
            to = (h + side) % SECTORS, i + di[h], j + dj[h]
            inside = (to[1] >= 0) & (to[1] < shape[1]) & (to[2] >= 0) & (to[2] < shape[2])
            one = np.flatnonzero(inside & free)
            other = np.ravel_multi_index([axis[one] for axis in to], shape)
            both = free[other]
            rows.append(one[both])
            columns.append(other[both])
            costs.append(np.full(both.sum(), way / PACE[abs(side)]))
        rows, columns, costs = map(np.concatenate, (rows, columns, costs))
        return csr_matrix((costs, (rows, columns)), shape=(h.size,) * 2), shape


def outline() -> np.ndarray:
    """(2, n) [m] points SPACING apart along the car's outline, seen from the rear axle."""
    found = []
    for one, other in zip(c.CORNERS, np.roll(c.CORNERS, -1, axis=0), strict=True):
        n = int(np.ceil(np.linalg.norm(other - one) / SPACING))
        found.append(one + (other - one) * (np.arange(n) / n)[:, None])
    return np.concatenate(found).T
