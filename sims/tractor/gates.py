"""Yards for episodes: walls across with a gate in each, to be driven through one after another."""

from typing import NamedTuple

import numpy as np

GATES, APART, WIDE = 4, 12.0, 3.4  # walls across a yard, [m] between them, [m] of a gate
HALF, THICK = 8.0, 1.0  # [m] half width of the yard, thickness of its walls
BEHIND = -8.0  # [m] where the side walls begin
END = APART * (GATES + 1)  # [m] where they end
MOST_ASIDE = 2.5  # [m] from the middle of the yard to that of a gate
START = np.array([1.0, 1.0, 0.2])  # [m, m, rad] by which it differs from the origin, at most


class World(NamedTuple):
    """A yard: middles (GATES,) [m] across of its gates; the start (3,), x, y [m], heading [rad]."""

    gates: np.ndarray
    start: np.ndarray

    @property
    def walls(self) -> np.ndarray:
        """(n, 4) x and y from, x and y to [m]."""
        rows = [[BEHIND, side, END, side + THICK] for side in (HALF, -HALF - THICK)]
        for i, y in enumerate(self.gates, 1):
            rows.append([APART * i, y + WIDE / 2, APART * i + THICK, HALF])
            rows.append([APART * i, -HALF, APART * i + THICK, y - WIDE / 2])
        return np.array(rows)

    @property
    def way(self) -> np.ndarray:
        """(n, 2) [m] corners of a way to the end, straight on for some metres at each gate."""
        ends = [
            [APART * i + x, y] for i, y in enumerate(self.gates, 1) for x in (-2.0, THICK + 1.0)
        ]
        return np.array([self.start[:2], *ends, [END, self.gates[-1]]])


def any_yard(seed) -> World:
    """The law of episodes: every gate and the start uniform."""
    draw = np.random.default_rng(seed)
    return World(draw.uniform(-MOST_ASIDE, MOST_ASIDE, GATES), draw.uniform(-START, START))


def distance(points: np.ndarray, walls: np.ndarray) -> float:
    """[m] least distance of a tractor or its trailer, POINTS (n, 9, 2), to walls (m, 4)."""
    from shapely import STRtree, box, polygons

    bodies = polygons(np.concatenate([points[:, 1:5], points[:, 5:]]))
    nearest = STRtree(box(*walls.T)).query_nearest(bodies, return_distance=True)
    return float(nearest[1].min())
