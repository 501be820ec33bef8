"""A greedy driver that knows the map: to the goal, round hazards and vases, as fast as it gets. It
promises nothing: a shield behind it does.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from sims.point.manoeuvre import THRUST
from sims.point.world import GOAL, HAZARD, VASE, World

HALF, CELL = 2.4, 0.08  # [m] half the edge of the map, and of its cells
LIKED = 0.14  # [m] beyond what costs
OUTER = 0.13  # [m] the robot's own radius, which counts for vases alone
FAST = 1.7  # [m/s] along the way: more than it gets, so that it always pushes
AHEAD = np.array([0.25, 0.5, 0.8])  # [m] to waypoints
FAN = np.linspace(0, 2 * np.pi, 48, endpoint=False)
TAIL = 2.0  # [rad] from which on it pushes backwards
QUICK = 2.5  # turning action per rad
EAGER = 1.5  # thrust as a share of the greatest, of a robot that points where it wants to go


class Guide:
    """A policy for one world at a time: `guide(world)` is the action (2,)."""

    def __init__(self):
        n = round(2 * HALF / CELL) + 1
        axis = np.linspace(-HALF, HALF, n)
        self._cells = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
        self._n, self._goal = n, np.full(2, np.nan)
        index = np.arange(n * n).reshape(n, n)
        pairs = []
        for i, j in ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1)):
            one = index[: n - i, max(0, -j) : n - max(0, j)]
            pairs.append(np.stack([one, index[i:, max(0, j) : n + min(0, j)]], -1).reshape(-1, 2))
        self._pairs = np.concatenate(pairs)
        self._lengths = np.linalg.norm(np.subtract(*self._cells[self._pairs.T]), axis=1)

    def __call__(self, world: World) -> np.ndarray:
        """Thrust and turning."""
        here, goal = world.place, world.layout["goal"]
        discs, radii = self._discs(world)
        if not np.array_equal(goal, self._goal):
            self._goal, self._far = goal.copy(), self._field(goal, discs, radii)
        way = self._waypoint(here, goal, discs, radii) - here
        pose, speeds = world.pose, world.speeds
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        velocity = np.array([cos * speeds[0] - sin * speeds[1], sin * speeds[0] + cos * speeds[1]])
        push = FAST * way / max(np.linalg.norm(way), 1e-9) - velocity
        off = (np.arctan2(push[1], push[0]) - pose[2] + np.pi) % (2 * np.pi) - np.pi
        sense = 1.0
        if abs(off) > TAIL:
            off, sense = off - np.copysign(np.pi, off), -1.0
        # more than THRUST is no more force; sideways it turns first
        thrust = THRUST * min(1.0, EAGER * max(np.cos(off), 0.0) ** 3)
        return np.array([sense * thrust, np.clip(QUICK * off, -1, 1)])

    def _discs(self, world: World) -> tuple[np.ndarray, np.ndarray]:
        vases = world.vase_boxes().mean(axis=1)
        radii = np.repeat([HAZARD, VASE * 1.4 + OUTER], [len(world.hazards), len(vases)])
        return np.concatenate([world.hazards, vases]), radii + LIKED

    def _field(self, goal: np.ndarray, discs: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """[m] way from each cell to the goal; through what costs tenfold."""
        inside = (np.linalg.norm(self._cells[:, None] - discs, axis=-1) < radii).any(axis=1)
        weight = self._lengths * np.where(inside[self._pairs].any(axis=1), 10.0, 1.0)
        size = (len(self._cells), len(self._cells))
        graph = coo_array((weight, self._pairs.T), size).tocsr()
        start = int(np.argmin(np.linalg.norm(self._cells - goal, axis=1)))
        return dijkstra(graph, directed=False, indices=start).reshape(self._n, self._n)

    def _waypoint(self, here, goal, discs, radii) -> np.ndarray:
        to = goal - here
        if _free(here, goal[None], discs, radii)[0] or np.linalg.norm(to) < GOAL:
            return goal
        spread = AHEAD[:, None, None] * np.stack([np.cos(FAN), np.sin(FAN)], -1)
        points = here + spread.reshape(-1, 2)
        cell = np.clip(np.rint((points + HALF) / CELL).astype(int), 0, self._n - 1)
        cost = self._far[cell[:, 0], cell[:, 1]] + np.linalg.norm(points - here, axis=1)
        cost += 10.0 * ~_free(here, points, discs, radii)
        return points[int(np.argmin(cost))]


def _free(here, points, discs, radii) -> np.ndarray:
    """(n,) do the ways to points (n, 2) keep off the discs; of one that it is in, those out of it
    do.
    """
    way = points[:, None] - here
    away = discs - here
    share = np.clip((way * away).sum(-1) / np.maximum((way**2).sum(-1), 1e-12), 0.0, 1.0)
    gap = np.linalg.norm(away - share[..., None] * way, axis=-1)
    return (gap >= np.minimum(radii, np.linalg.norm(away, axis=-1)) - 1e-9).all(axis=1)
