"""Where to go: cost to the goal on a grid of what was seen so far, with a memory. Only preference:
what it gets wrong costs time, never safety.
"""

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

CELL = 0.05  # [m] of the grid
MARGIN = 1.5  # [m] of grid around start and goal, on all sides
INSIDE = 0.23  # [m] from what was seen to the robot's middle: nearer it does not fit
NEAR = 0.45  # [m] nearer than this, a way is longer than it is
STEEP = 40.0  # [1 / m^2] by how much
NEEDS = 0.3  # [m] of the body and a tube around it: nearer than this little is proved, and a way is
NARROW = 8.0  # ... so many times as long, that a wider one is looked for
AHEAD = 3  # 2 to the power of so many cells on, the way shows where to turn to ...
TURN = 0.3  # [m / rad] ... and turning is worth this much of it
TRIED = 0.4  # [m] around a place where no manoeuvre was found, cells count as longer ...
FACTOR = 1.5  # ... by this, each time
FAR = 1e3  # [m] cost of a place from which no way is known
MORE = 3.0  # [m] of cost beyond the robot's own that are counted at once: where its manoeuvres end
CLOSE = 5  # cells from the robot, one of which has a cost even where it stands beside something

STEPS = ((1, 0), (0, 1), (1, 1), (1, -1))  # and back


class Guidance:
    """Cost to go from any place to a goal, (2,) [m] each, over a rectangle that holds both."""

    def __init__(self, start, goal, near: float, sides: float = 3.0):
        start, goal = np.asarray(start[:2]), np.asarray(goal)
        around = np.array([sides, MARGIN])
        lo, hi = np.minimum(start, goal) - around, np.maximum(start, goal) + around
        self._lo = lo
        self._shape = tuple(np.ceil((hi - lo) / CELL).astype(int) + 1)
        self._occupied = np.zeros(self._shape, bool)
        self._tried = np.ones(self._shape)
        x, y = np.meshgrid(*(np.arange(n) for n in self._shape), indexing="ij")
        self._places = lo + CELL * np.stack([x, y], axis=-1)
        self._goal = np.flatnonzero(np.linalg.norm(self._places - goal, axis=-1) < near)
        self._edges = _edges(self._shape)
        self._cost = np.zeros(self._shape)
        self._way = np.zeros((*self._shape, 2))
        self._known = 0.0  # [m] up to which costs are counted

    def see(self, hits: np.ndarray, free=None) -> None:
        """Something stands at hits (n, 2) [m], and nothing in the places (FreeSpace) that are free:
        what stood there has been told wrongly, by odometry for one.
        """
        if free is not None:
            from shapely import contains_xy

            held = np.argwhere(self._occupied)
            x, y = (self._lo + CELL * held).T
            self._occupied[tuple(held[contains_xy(free.region, x, y)].T)] = False
        cells = np.round((hits - self._lo) / CELL).astype(int)
        cells = cells[((cells >= 0) & (cells < self._shape)).all(axis=1)]
        self._occupied[cells[:, 0], cells[:, 1]] = True

    def give_up(self, place) -> None:
        """No manoeuvre was found at a place (2,): other ways become shorter."""
        close = np.linalg.norm(self._places - np.asarray(place)[:2], axis=-1) < TRIED
        self._tried[close] *= FACTOR

    def update(self, place=None) -> None:
        """The cost to go, with all that was seen; at first of what is as near to the goal as a
        place (2,), and a little beyond.
        """
        self._distance = distance_transform_edt(~self._occupied) * CELL
        weight = self._tried * (1 + STEEP * np.maximum(0, NEAR - self._distance) ** 2)
        weight[self._distance < NEEDS] *= NARROW
        weight[self._distance < INSIDE] = np.inf
        worth = weight.ravel()
        pointers, neighbours, halves = self._edges
        lengths = np.repeat(worth, np.diff(pointers)) + worth[neighbours]
        self._graph = csr_matrix((lengths * halves, neighbours, pointers))
        here = FAR
        if place is not None:
            a, b = self._cell(np.asarray(place)[:2])
            around = np.s_[max(a - CLOSE, 0) : a + CLOSE + 1, max(b - CLOSE, 0) : b + CLOSE + 1]
            here = self._cost[around].min()
        self._count(np.inf if here >= FAR else here + MORE)

    def _count(self, limit: float) -> None:
        """Costs up to a limit [m]: those beyond it are asked for only where a place is."""
        cost, following, _ = dijkstra(
            self._graph, indices=self._goal, min_only=True, return_predecessors=True, limit=limit
        )
        self._known = limit
        self._cost = np.where(np.isfinite(cost), cost, FAR).reshape(self._shape)
        following = np.where(following < 0, np.arange(cost.size), following)
        for _ in range(AHEAD):
            following = following[following]
        places = self._places.reshape(-1, 2)
        self._way = (places[following] - places).reshape(self._places.shape)

    def cost(self, places: np.ndarray) -> np.ndarray:
        """(...) [m] from places (..., 2) to the goal."""
        cells = self._cell(places)
        farther = (self._cost[cells] >= FAR) & (self._distance[cells] >= INSIDE)
        if self._known < np.inf and farther.any():
            self._count(np.inf)
        return self._cost[cells]

    def _cell(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        cell = np.round((places - self._lo) / CELL).astype(int)
        cell = np.clip(cell, 0, np.array(self._shape) - 1)
        return cell[..., 0], cell[..., 1]

    def prefer(self, seen) -> np.ndarray:
        """Of an Outlook: where it comes to rest, and how far it has to turn there. No heading is
        worse than its neighbours on both sides, so the robot turns around where it has to.
        """
        rest = seen.path[:, -1]
        cost = self.cost(rest)  # first: it may count the ways
        x, y = self._way[self._cell(rest)].T
        turn = np.arctan2(y, x) - seen.heading
        away = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
        return cost + TURN * np.where(np.hypot(x, y) > 0, away, 0.0)


def _edges(shape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of a grid: where each cell's neighbours begin, all neighbours, half of the ways [m] there."""
    number = np.arange(np.prod(shape)).reshape(shape)
    found = []
    for dx, dy in STEPS:
        here = number[: shape[0] - dx, max(0, -dy) : shape[1] - max(0, dy)].ravel()
        there = number[dx:, max(0, dy) : shape[1] + min(0, dy)].ravel()
        half = np.full(len(here), np.hypot(dx, dy) * CELL / 2)
        found += [(here, there, half), (there, here, half)]
    here, there, half = map(np.concatenate, zip(*found, strict=True))
    order = np.lexsort((there, here))
    pointers = np.searchsorted(here[order], np.arange(number.size + 1))
    return pointers.astype(np.int32), there[order].astype(np.int32), half[order]
