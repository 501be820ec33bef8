"""Distances to a goal on a map. They order candidates and decide nothing."""

from collections.abc import Callable

import numpy as np

from parc_jax.problem.world.grid_map import GridMap

MOST = 300  # cells along a side of the grid that ways are looked for on
ASTRAY = 1e6  # [m] beyond all ways: places without one come last, those nearer to the goal first


class Guide:
    """Distance to a goal from any place of a map, through free cells.

    goal (2,) [m]. radius: [m] least space that the robot needs.

    Algorithm: free blocks of cells, at most MOST along a side, farther than the radius from any
    other; shortest ways over their eight neighbours, by Dijkstra's algorithm.
    """

    def __init__(self, grid: GridMap, goal: np.ndarray, radius: float):
        from scipy.ndimage import distance_transform_edt
        from scipy.sparse.csgraph import dijkstra

        self.goal, self.grid = goal, grid
        self.block = -(-max(grid.free.shape) // MOST)
        rows, columns = (-(-n // self.block) for n in grid.free.shape)
        whole = np.zeros((rows * self.block, columns * self.block), bool)
        whole[: grid.free.shape[0], : grid.free.shape[1]] = grid.free
        whole = np.pad(whole, 1)
        # cells beyond the map count as occupied
        wide = distance_transform_edt(whole)[1:-1, 1:-1] * grid.resolution > radius
        free = wide.reshape(rows, self.block, columns, self.block).all(axis=(1, 3))
        self.cost = np.full((rows, columns), np.inf)
        row, column = self._cells(goal[None])
        at = np.argwhere(free)
        if len(at):
            begin = int(((at - [row[0], column[0]]) ** 2).sum(axis=1).argmin())
            ways = _neighbours(free, at) * (self.block * grid.resolution)
            self.cost[free] = dijkstra(ways, indices=begin)

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """(b,) [m] from places (b, 2) to the goal."""
        straight = np.linalg.norm(places - self.goal, axis=1)
        row, column = self._cells(places)
        cost = self.cost[row, column]
        # within a block the straight way orders places
        return np.where(np.isfinite(cost), cost + 1e-3 * straight, ASTRAY + straight)

    def _cells(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of the blocks in which places (b, 2) lie, or the nearest ones."""
        x, y, yaw = self.grid.origin
        c, s = np.cos(yaw), np.sin(yaw)
        off = (places - [x, y]) @ np.array([[c, -s], [s, c]])
        cells = np.floor(off / (self.block * self.grid.resolution)).astype(int)
        rows, columns = self.cost.shape
        return np.clip(cells[:, 1], 0, rows - 1), np.clip(cells[:, 0], 0, columns - 1)


def along_ways(pilot) -> Callable:
    """The preference of a `Pilot`: the distance from the place of rest to the goal, on its map
    through free cells; straight while there is no map.
    """
    corners = pilot.outline.corners
    sides = np.roll(corners, -1, axis=0) - corners
    across = sides[:, 0] * corners[:, 1] - sides[:, 1] * corners[:, 0]
    inner = np.abs(across) / np.linalg.norm(sides, axis=1)
    radius = float(inner.min()) + pilot.driving.room
    known: dict = {}

    def prefer(outlook, goal: np.ndarray) -> np.ndarray:
        ends = outlook.path[:, -1]
        if pilot.map is None:
            return np.linalg.norm(ends - goal, axis=1)
        if known.get("map") is not pilot.map or not np.array_equal(known["goal"], goal):
            known.update(map=pilot.map, goal=goal, guide=Guide(pilot.map, goal, radius))
        return known["guide"](ends)

    return prefer


def _neighbours(free: np.ndarray, at: np.ndarray):
    """Sparse lengths [blocks] of the steps between free blocks, at (n, 2)."""
    from scipy.sparse import coo_array

    number = np.full(np.add(free.shape, 2), -1)
    number[1:-1, 1:-1][free] = np.arange(len(at))
    steps = [(1, 0), (0, 1), (1, 1), (1, -1)]
    parts = []
    for down, right in steps:
        other = number[at[:, 0] + 1 + down, at[:, 1] + 1 + right]
        begun = np.flatnonzero(other >= 0)
        parts.append((begun, other[begun], np.full(len(begun), np.hypot(down, right))))
    begin, end, far = (np.concatenate(part) for part in zip(*parts, strict=True))
    both = (np.append(begin, end), np.append(end, begin))
    return coo_array((np.append(far, far), both), shape=(len(at), len(at))).tocsr()
