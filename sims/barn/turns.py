"""How far it is to the goal from each place and heading around a robot whose way lies behind it: it
turns where its outline has room for that, and drives backwards until there. Only preference, as
guidance is.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from sims.barn.guidance import CELL, FAR, TURN, Guidance, Window
from sims.rectangle import centre_and_corners

HALF = 18  # cells to each side of the robot
N = 2 * HALF + 1
HEADINGS = 16  # of a turn
ANGLE = 2 * np.pi / HEADINGS  # [rad]
STEPS = ((1, 0), (2, 1), (1, 1), (1, 2))  # in cells, along the headings of a quarter, roughly
BACK = 1.2  # how much longer a way is backwards, where the robot does not see
FINE = CELL / 2  # [m] of the map of what stands
SIDES = 5  # points on each side of the outline
# How much longer a way is with less clearance [m], else 1: with none where nothing stands, or
# something does. To turn takes so many cycles that what is remembered behind shrinks by WEARS
ROOM, FACTORS, BLOCKED = (0.08, 0.03), (3.0, 10.0), 40.0
WEARS = 0.04  # [m]
GENTLE = 0.5, 0.9  # [m/s], [rad/s] faster, tyres slide, and more drift is allowed for ...
HARD = 1.0  # [m] ... so such commands cost more


class Lattice(NamedTuple):
    """Places and headings of a window, the nodes. before (nodes, 4): where a step ahead, one back,
    and two turns begin that end at a node; length (nodes, 4) [m] of these, infinite for those from
    beyond the window. around [m]: how much wider than it the map of what stands is, of so many
    cells to a side; outline (m, HEADINGS / 2, N, N): its cells on the outline at a node.
    """

    before: np.ndarray
    length: np.ndarray
    around: float
    cells: int
    outline: np.ndarray


@cache
def lattice(size: tuple[float, float]) -> Lattice:
    """Of robots of a size [m]."""
    turned, x, y = np.meshgrid(np.arange(HEADINGS), np.arange(N), np.arange(N), indexing="ij")
    steps = [np.array(STEPS)]
    for _ in range(3):
        steps.append(steps[-1] @ [[0, 1], [-1, 0]])
    step = np.concatenate(steps)[turned]
    way = CELL * np.linalg.norm(step, axis=-1)
    before, length = [], []
    for sign, longer in ((-1, 1.0), (1, BACK)):
        a, b = x + sign * step[..., 0], y + sign * step[..., 1]
        inside = (np.minimum(a, b) >= 0) & (np.maximum(a, b) < N)
        before.append(np.where(inside, _node(turned, a, b), _node(turned, x, y)))
        length.append(np.where(inside, longer * way, np.inf))
    for sign in (-1, 1):
        before.append(_node((turned + sign) % HEADINGS, x, y))
        length.append(np.full(x.shape, TURN * ANGLE))
    angles = ANGLE * np.arange(HEADINGS // 2)  # half a turn on it covers the same
    corners = centre_and_corners(np.zeros((len(angles), 2)), angles, *size)[:, None, 1:]
    share = np.linspace(0, 1, SIDES, endpoint=False)[:, None, None]
    outline = corners + share * (np.roll(corners, -1, axis=2) - corners)
    outline = np.moveaxis(outline.reshape(len(angles), -1, 2), 1, 0)[:, :, None, None]
    around = float(np.abs(outline).max() + FINE)
    grid = CELL * np.stack(np.meshgrid(*[np.arange(N)] * 2, indexing="ij"), axis=-1)
    cells = int(np.ceil((CELL * N + 2 * around) / FINE))
    i, j = np.moveaxis(np.round((grid + outline + around) / FINE).astype(int), -1, 0)
    before, length = (np.stack(each, axis=-1).reshape(-1, 4) for each in (before, length))
    return Lattice(before, length, around, cells, cells * i + j)


class Turns:
    """Cost to go around a pose (3,), of a robot of a size [m]: to the border of a window, and on
    by guidance. free: the FreeSpace that is known.

    Algorithm: Dijkstra's, from the border.
    """

    def __init__(self, pose, guide: Guidance, free, size: tuple[float, float]):
        self._guide, known = guide, lattice(tuple(size))
        window = guide.window(pose[:2], HALF)
        self._lo = window.lo
        room, stands = self._clearance(free, known)
        worth = []
        for more in (0.0, WEARS):
            factor = np.full(room.shape, BLOCKED)
            factor[(room > 0) | (stands >= ROOM[1])] = FACTORS[1]
            factor[room >= ROOM[1] + more] = FACTORS[0]
            factor[room >= ROOM[0] + more] = 1.0
            worth += 2 * [(window.tried * np.concatenate([factor, factor])).ravel()]
        mean = [(of + of[known.before[:, i]]) / 2 for i, of in enumerate(worth)]
        ways = known.length * np.stack(mean, axis=-1)
        (i, j), first = _leaves(window, guide)
        turned = np.arange(HEADINGS)[:, None]
        ends = np.concatenate([known.before.ravel(), _node(turned, i, j).ravel()])
        pointers = np.append(4 * np.arange(len(ways) + 1), len(ends))
        arrays = np.concatenate([ways.ravel(), first.ravel()]), ends, pointers
        graph = csr_array(arrays, shape=(len(ways) + 1, len(ways) + 1))
        found = dijkstra(graph, indices=len(ways))[:-1]
        self._cost = np.minimum(found, FAR).reshape(HEADINGS, N, N)

    def _clearance(self, free, known: Lattice) -> list[np.ndarray]:
        """(HEADINGS / 2, N, N) [m] from an outline to what is not known to be free, and to what was
        seen to stand.
        """
        from shapely import contains_xy, prepare

        axes = self._lo[:, None] - known.around + FINE * np.arange(known.cells)
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        prepare(free.region)
        return [
            FINE * distance_transform_edt(clear).take(known.outline).min(axis=0)
            for clear in (contains_xy(free.region, *places.T).T, ~self._guide.stands(places))
        ]

    def prefer(self, seen) -> np.ndarray:
        """Of an Outlook: from where it comes to rest; more for what may drift farther."""
        at = (seen.path[:, -1] - self._lo) / CELL
        inside = ((at >= 0) & (at < N - 1)).all(axis=1)
        (i, j), (a, b) = (each.T for each in np.divmod(np.clip(at, 0, N - 1.001), 1.0))
        h, c = np.divmod(seen.heading / ANGLE, 1.0)
        i, j, h = i.astype(int), j.astype(int), h.astype(int)
        cost = 0.0
        for x, y, z in np.ndindex(2, 2, 2):
            part = (a if x else 1 - a) * (b if y else 1 - b) * (c if z else 1 - c)
            cost = cost + part * self._cost[(h + z) % HEADINGS, i + x, j + y]
        hard = (np.abs(seen.k[:, -2:]) > GENTLE).any(axis=1)
        return np.where(inside, cost, self._guide.prefer(seen)) + HARD * hard


def _leaves(window: Window, guide: Guidance) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Cells (2, m) at the border, or in the goal; costs (HEADINGS, m) [m] from there."""
    border = np.ones((N, N), bool)
    border[2:-2, 2:-2] = False  # steps are of two cells, at most
    of = np.nonzero((border & (window.cost < FAR)) | window.goal)
    x, y = guide.ahead((window.rows[of[0]], window.columns[of[1]])).T
    turn = np.arctan2(y, x) - ANGLE * np.arange(HEADINGS)[:, None]
    away = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    return of, window.cost[of] + TURN * np.where(np.hypot(x, y) > 0, away, 0.0)


def _node(turned, x, y):
    return (turned * N + x) * N + y
