"""Where to go: cost to the goal on a grid of what was seen so far, with a memory. Only preference:
what it gets wrong costs time, never safety.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

CELL = 0.05  # [m] of the grid
MARGIN = 1.5  # [m] of grid around start and goal, on all sides
INSIDE = 0.23  # [m] from what was seen to the robot's middle: nearer it does not fit
NEAR = 0.45  # [m] nearer than this, a way is longer than it is
STEEP = 40.0  # [1 / m^2] by how much
NEEDS = 0.3  # [m] of the body and a tube around it: nearer than this little is proved, and a way is
NARROW = 8.0  # ... so many times as long, that a wider one is looked for
HARDLY = 0.28  # [m] nearer than this no robot on odometry was ever seen to pass ...
BARELY = 6.0  # ... and a way is so many times longer still
AHEAD = 8  # cells on, the way shows where to turn to ...
ROOMY = 4 / 3  # m / m of a way, where nothing stands close
TURN = 0.3  # [m / rad] ... and turning is worth this much of it
TRIED = 0.4  # [m] around a place where no manoeuvre was found, cells count as longer ...
FACTOR = 1.5  # ... by this, each time
FAR = 1e3  # [m] cost of a place from which no way is known
MORE = 1.0  # [m] of cost beyond the robot's own that are counted at once: where its manoeuvres end
CLOSE = 5  # cells from the robot, one of which has a cost even where it stands beside something

STEPS = np.array([(1, 0), (0, 1), (1, 1), (1, -1), (-1, 0), (0, -1), (-1, -1), (-1, 1)])
HALF = np.hypot(*STEPS.T) * CELL / 2  # [m]
BEYOND = round(NEAR / CELL)  # cells: from so far on what was seen makes no way longer
ANY = np.finfo(float).max  # [m] the longest way, but for one through what stands there


class Window(NamedTuple):
    """Of cells around a place: lo (2,) [m], the middle of the first; rows and columns of the grid;
    cost [m] from each, FAR where it was not counted; is it at the goal; how much longer it counts
    as it was tried.
    """

    lo: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    cost: np.ndarray
    goal: np.ndarray
    tried: np.ndarray


class Guidance:
    """Cost to go from any place to a goal, (2,) [m] each, over a rectangle that holds both.

    Algorithm: Dijkstra's. Costs below all those beside a cell whose worth changed stay; the next
    search begins at their border.
    """

    def __init__(self, start, goal, near: float, sides: float = 3.0):
        start, goal = np.asarray(start[:2]), np.asarray(goal)
        around = np.array([sides, MARGIN])
        lo, hi = np.minimum(start, goal) - around, np.maximum(start, goal) + around
        self._lo = lo
        self._shape = tuple(np.ceil((hi - lo) / CELL).astype(int) + 1)
        # of all arrays the outermost cells belong to no way, so that each other has eight around it
        x, y = np.meshgrid(*(np.arange(-1, n + 1) for n in self._shape), indexing="ij")
        self._places = lo + CELL * np.stack([x, y], axis=-1)
        self._occupied = np.zeros(x.shape, bool)
        self._tried = np.pad(np.ones(self._shape), 1, constant_values=np.inf)
        self._goal = np.linalg.norm(self._places - goal, axis=-1) < near
        self._worth = np.zeros(x.shape)
        self._cost = np.where(self._goal, 0.0, FAR)
        self._known = 0.0  # [m] up to which costs are counted
        # a graph of all cells and those around them, and at its end room for where a search begins
        n = len(STEPS) * x.size
        self._lengths, self._ends = np.empty(n + x.size), np.empty(n + x.size, np.int32)
        self._ways, self._beside = (
            of[:n].reshape(-1, len(STEPS)) for of in (self._lengths, self._ends)
        )
        around = np.arange(x.size)[:, None] + STEPS @ [x.shape[1], 1]
        self._beside[:] = np.clip(around, 0, x.size - 1)
        self._pointers = len(STEPS) * np.arange(x.size + 2, dtype=np.int32)

    def see(self, hits: np.ndarray, free=None) -> None:
        """Something stands at hits (n, 2) [m], and nothing in the places (FreeSpace) that are free:
        what stood there has been told wrongly, by odometry for one.
        """
        if free is not None:
            from shapely import contains_xy, prepare

            prepare(free.region)
            held = np.nonzero(self._occupied)
            self._occupied[held] = ~contains_xy(free.region, self._places[held])
        cells = np.round((hits - self._lo) / CELL).astype(int)
        a, b = 1 + cells[((cells >= 0) & (cells < self._shape)).all(axis=1)].T
        self._occupied[a, b] = True

    def give_up(self, place) -> None:
        """No manoeuvre was found at a place (2,): other ways become shorter."""
        close = np.linalg.norm(self._places - np.asarray(place)[:2], axis=-1) < TRIED
        self._tried[close] *= FACTOR

    def update(self, place=None) -> None:
        """The cost to go, with all that was seen; at first of what is as near to the goal as a
        place (2,), and a little beyond.
        """
        here = FAR
        if place is not None:
            a, b = self._cell(np.asarray(place)[:2])
            around = np.s_[max(a - CLOSE, 0) : a + CLOSE + 1, max(b - CLOSE, 0) : b + CLOSE + 1]
            here = self._cost[around].min()
        worth = self._tried * WORTH[_apart(self._occupied)]
        changed = np.flatnonzero(_grown(worth != self._worth))
        self._worth, flat = worth, worth.ravel()
        self._ways[changed] = HALF * (flat[changed, None] + flat[self._beside[changed]])
        stays = self._cost.ravel()[changed].min(initial=FAR)
        self._count(ANY if here >= FAR else here + MORE, stays)

    def _count(self, limit: float, stays: float = FAR) -> None:
        """Costs up to a limit [m]: those beyond it are asked for only where a place is. stays: [m]
        below it they are known.
        """
        kept = (self._cost < stays) | self._goal
        cost = np.where(kept, self._cost, FAR).ravel()
        border = np.flatnonzero(_grown(kept) & ~kept & np.isfinite(self._worth))
        beside, ways = self._beside[border], self._ways[border]
        back = kept.ravel()[beside]
        first = np.where(back, cost[beside] + ways, np.inf).min(axis=1)
        n, end = self._ways.size, self._ways.size + len(border)
        self._ends[n:end], self._lengths[n:end], self._pointers[-1] = border, first, end
        self._ways[border] = np.where(back, np.inf, ways)  # for this search
        arrays = self._lengths[:end], self._ends[:end], self._pointers
        graph = csr_array(arrays, shape=(cost.size + 1, cost.size + 1))
        found = dijkstra(graph, indices=cost.size, limit=limit)[:-1]
        self._ways[border] = ways
        self._cost = np.where(np.isfinite(found), found, cost).reshape(kept.shape)
        self._known = limit

    def cost(self, places: np.ndarray) -> np.ndarray:
        """(...) [m] from places (..., 2) to the goal."""
        cells = self._cell(places)
        farther = (self._cost[cells] >= FAR) & np.isfinite(self._worth[cells])
        for limit in (self._known + MORE, ANY):
            if self._known < limit and farther.any():
                self._count(limit)
                farther = farther & (self._cost[cells] >= FAR)
        return self._cost[cells]

    def _cell(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        cell = np.round((places - self._lo) / CELL).astype(int)
        cell = 1 + np.clip(cell, 0, np.array(self._shape) - 1)
        return cell[..., 0], cell[..., 1]

    def ahead(self, cells: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """(n, 2) [m] from cells to where their ways lead, AHEAD cells on."""
        cost, goal = self._cost.ravel(), self._goal.ravel()
        begin, of = np.unique(np.ravel_multi_index(cells, self._cost.shape), return_inverse=True)
        at = begin
        for _ in range(AHEAD):
            beside = self._beside[at].T
            ways = cost[beside] + self._ways[at].T
            nearest = np.where(ways == ways.min(axis=0), cost[beside], np.inf).argmin(axis=0)
            ends = goal[at] | (cost[at] == FAR)
            at = np.where(ends, at, beside[nearest, np.arange(len(at))])
        places = self._places.reshape(-1, 2)
        return (places[at] - places[begin])[of]

    def away(self, pose) -> float:
        """[rad] by which a pose (3,) has to turn to where its way leads; 0 where none does."""
        place = self._cell(np.asarray(pose[:2])[None])
        x, y = self.ahead(place)[0]
        turn = np.arctan2(y, x) - pose[2]
        return float(abs(np.arctan2(np.sin(turn), np.cos(turn)))) if x or y else 0.0

    def roomy(self, place) -> bool:
        """Is nothing as near to a place (2,) as would make a way longer by a third?"""
        return bool(self._worth[self._cell(np.asarray(place)[:2])] < ROOMY)

    def window(self, place, half: int) -> "Window":
        """What is known of the cells around a place (2,), so many to each side."""
        a, b = self._cell(np.asarray(place))
        beside, last = np.arange(-half, half + 1), np.array(self._cost.shape) - 1
        rows, columns = np.clip(a + beside, 0, last[0]), np.clip(b + beside, 0, last[1])
        of = np.ix_(rows, columns)
        told = self._cost[of], self._goal[of], self._tried[of]
        return Window(self._places[a, b] - half * CELL, rows, columns, *told)

    def stands(self, places: np.ndarray) -> np.ndarray:
        """(...) bool, was something seen to stand at places (..., 2)?"""
        return self._occupied[self._cell(places)]

    def prefer(self, seen) -> np.ndarray:
        """Of an Outlook: where it comes to rest, and how far it has to turn there. No heading is
        worse than its neighbours on both sides, so the robot turns around where it has to.
        """
        rest = seen.path[:, -1]
        cost = self.cost(rest)  # first: it may count the ways
        x, y = self.ahead(self._cell(rest)).T
        turn = np.arctan2(y, x) - seen.heading
        away = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
        return cost + TURN * np.where(np.hypot(x, y) > 0, away, 0.0)


def _worth_of(apart: np.ndarray) -> np.ndarray:
    """[m / m] of cells so far [m] from what was seen."""
    worth = 1 + STEEP * np.maximum(0, NEAR - apart) ** 2
    worth *= np.where(apart < NEEDS, NARROW, 1.0) * np.where(apart < HARDLY, BARELY, 1.0)
    return np.where(apart < INSIDE, np.inf, worth)


WORTH = _worth_of(np.sqrt(np.arange(256)) * CELL)


def _apart(occupied: np.ndarray) -> np.ndarray:
    """Squared distance to the nearest occupied cell, in cells; of BEYOND cells and more any such
    number.
    """
    apart = np.where(occupied, 0, BEYOND**2).astype(np.uint8)
    for _ in range(2):
        apart, along = apart.T.copy(), apart.T.copy()
        for step in range(1, BEYOND):
            farther = along + np.uint8(step**2)
            np.minimum(apart[step:], farther[:-step], out=apart[step:])
            np.minimum(apart[:-step], farther[step:], out=apart[:-step])
    return apart


def _grown(cells: np.ndarray) -> np.ndarray:
    """Cells and the eight around each."""
    for _ in range(2):
        grown = cells.T.copy()
        grown[1:] |= cells.T[:-1]
        grown[:-1] |= cells.T[1:]
        cells = grown
    return cells
