"""A way for the car as a list of manoeuvres, searched for backwards from the goal, where there is
little room, to the start. It only proposes: what it gets wrong costs time, never safety.
"""

import heapq
from functools import cache
from itertools import count, pairwise
from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

import parc_jax as pj
from sims.parking import car as c
from sims.parking.cases import Case

CELL, COARSE = 0.05, 5  # [m] of the grid of distances, and cells of a block of the grid of ways
BORDER = 11.0  # [m] of grid around start and goal
# no farther to the edges of K than this: few runs come from there, so the network is worst there
MOST = np.array([0.97 * c.WAY, 0.92, 0.92])
WAYS = (0.2, 0.45, 0.9, 1.8, 3.2, MOST[0])  # [m], forwards and backwards
SHORT = (0.1, 0.3)  # [m] of a fine search, too
TURNS = np.linspace(-MOST[1], MOST[1], 5)  # shares of the steering, first and last
SPACING = 0.12  # [m] between points of the outline
SAMPLED = 0.3  # [m] of way between poses that are looked at
BLOCK, SECTORS = 0.35, 48  # [m] and number of headings of cells of which one pose is followed
TIGHT, FINER = 0.2, 5  # [m] of clearance below which these cells are so many times smaller
LIKED, DISLIKED = 0.35, 8.0  # [m] of clearance that is liked, and [s / m] that each less costs
SHOT = 6.5  # [m] from the start: it is tried to be reached at once
SPEED = 0.75  # [m/s] at which the rest of a way is thought to be driven, stops included
SINGLE = 0.6  # [s] that each further manoeuvre costs beside its time
# weights of what is thought to be left, most poses followed with each, and whether they are told
# apart finely where it is tight: the next where none was found with the one before
GREEDY = ((1.6, 400, False), (2.5, 1500, False), (1.6, 1500, True))
BUDGET = 4500  # poses followed in all searches of a case, each about 12 ms of processor time


UNREACHED = 60.0  # [m] that a block counts as where no way leads


class Way(NamedTuple):
    """Manoeuvres k (n, 3): way, steering first and last; poses (n + 1, 3) where they begin and end.
    clearance: [m] least, about.
    """

    k: np.ndarray
    poses: np.ndarray
    clearance: float


def ends(k: np.ndarray, n: int = 1) -> np.ndarray:
    """(b, n, 3) where the rear axle is after 1 / n, ..., n / n of the way of manoeuvres k (b, 3)
    from the origin, of a car without lags and errors.
    """
    parts = n * int(np.ceil(24 / n))
    first, last = steering(k)
    share = (np.arange(parts) + 0.5) / parts
    step = k[:, :1] / parts
    turn = step * np.tan(first[:, None] + (last - first)[:, None] * share) / c.WHEELBASE
    heading = np.cumsum(turn, axis=1)
    middle = heading - 0.5 * turn
    # the chord of an arc is shorter than the arc
    chord = step * np.sinc(turn / (2 * np.pi))
    x, y = np.cumsum(chord * np.cos(middle), axis=1), np.cumsum(chord * np.sin(middle), axis=1)
    return np.stack([x, y, heading], axis=-1)[:, parts // n - 1 :: parts // n]


def steering(k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(b,) [rad] first and last of manoeuvres k (b, 3)."""
    most = np.arctan(
        c.WHEELBASE * c.BEND / np.maximum(np.abs(k[:, 0]), c.WHEELBASE * c.BEND / np.tan(c.TURN))
    )
    return most * k[:, 1], most * k[:, 2]


def compose(pose: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Poses (..., 3) after moves (..., 3) that are told from a pose (..., 3)."""
    cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y, turned = np.moveaxis(move, -1, 0)
    return np.stack(
        [pose[..., 0] + cos * x - sin * y, pose[..., 1] + sin * x + cos * y, pose[..., 2] + turned],
        axis=-1,
    )


def offset_from(pose: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(..., 3) another pose as told from a pose, its heading within half a turn."""
    cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = other[..., 0] - pose[..., 0], other[..., 1] - pose[..., 1]
    turned = (other[..., 2] - pose[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return np.stack([cos * x + sin * y, cos * y - sin * x, turned], axis=-1)


def seconds(k: np.ndarray) -> np.ndarray:
    """(b,) [s] that manoeuvres k (b, 3) drive, brake included."""
    first, last = steering(k)
    lasts = c.profile(np.maximum(np.abs(k[:, 0]), 1e-3), last - first)[1]
    return lasts + c.CREEP + 2 * c.SETTLE


def reach_exactly(
    targets: np.ndarray, k: np.ndarray, predict=ends
) -> tuple[np.ndarray, np.ndarray]:
    """Manoeuvres (b, 3) from the origin that end at targets (b, 3), near k (b, 3), by Newton's
    method; and (b,) whether they do. predict: as `ends`.
    """
    step = np.diag([1e-3, 1e-3, 1e-3])
    for _ in range(8):
        around = k[:, None] + np.concatenate([np.zeros((1, 3)), step])
        end = predict(around.reshape(-1, 3))[:, -1].reshape(-1, 4, 3)
        off = end[:, 0] - targets
        slope = np.moveaxis((end[:, 1:] - end[:, :1]) / 1e-3, 1, 2) + 1e-6 * np.eye(3)
        change = np.linalg.solve(slope, off[..., None])[..., 0]
        k = np.clip(k - np.clip(change, -0.8, 0.8), -MOST, MOST)
    off = predict(k)[:, -1] - targets
    return k, np.abs(off).max(axis=1) < 0.01


class Guide:
    """Ways of a case. margin: [m] of clearance that a way has to have. sure: which of manoeuvres k
    (b, 3) may be the last, which ends in the goal. left: poses that its searches may still follow.
    """

    def __init__(self, case: Case, margin: float = 0.1, sure=None):
        import shapely

        self.case, self.margin, self.left = case, margin, BUDGET
        self._sure = (lambda k: np.ones(len(k), bool)) if sure is None else sure
        both = np.stack([case.start[:2], case.goal[:2]])
        self._lo = both.min(axis=0) - BORDER
        shape = np.ceil((both.max(axis=0) + BORDER - self._lo) / CELL).astype(int) + 1
        x, y = (self._lo[i] + CELL * np.arange(n) for i, n in enumerate(shape))
        filled = shapely.union_all(case.shapes).buffer(0)
        shapely.prepare(filled)
        self._filled = filled
        self._far = np.full(shape, 1e3, np.float32)
        if not filled.is_empty:
            occupied = shapely.contains_xy(filled, *np.meshgrid(x, y, indexing="ij"))
            away = distance_transform_edt(~occupied)
            self._far = (CELL * np.maximum(away - 0.7, 0.0)).astype(np.float32)
        listed = WAYS + SHORT
        k = [(s * w, a, b) for w in listed for s in (1, -1) for a in TURNS for b in TURNS]
        self.k = np.array(k)
        self._short = np.isin(np.abs(self.k[:, 0]), SHORT)
        self._seconds = seconds(self.k)
        self._steering = np.stack(steering(self.k), axis=1)
        self._ends = ends(self.k)[:, 0]
        samples, self._first = [], [0]
        for one in self.k:
            n = max(1, int(np.ceil(abs(one[0]) / SAMPLED)))
            samples.append(ends(one[None], n)[0])
            self._first.append(self._first[-1] + n)
        self._samples = np.concatenate(samples)
        self._outline = outline()

    def distance(self, places: np.ndarray) -> np.ndarray:
        """[m] from places (..., 2) to obstacles; none beyond the grid."""
        cell = np.rint((places - self._lo) / CELL).astype(int)
        inside = ((cell >= 0) & (cell < self._far.shape)).all(axis=-1)
        cell = np.clip(cell, 0, np.array(self._far.shape) - 1)
        return np.where(inside, self._far[cell[..., 0], cell[..., 1]], 0.0)

    def free_around(self, poses: np.ndarray, exact: bool = False) -> np.ndarray:
        """(n,) [m] of the car at poses (n, 3), about; not more than LIKED. exact: where it is tight
        the outlines are asked.
        """
        import shapely

        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        middle = 0.5 * c.LENGTH - c.BEHIND
        centre = poses[:, :2] + middle * np.stack([cos, sin], axis=1)
        away = self.distance(centre)
        found = np.where(away > 0.5 * np.hypot(c.LENGTH, c.WIDTH) + LIKED, LIKED, -1.0)
        near = np.flatnonzero((found < 0) & (away > 0.5 * c.WIDTH))
        if len(near):
            x, y = self._outline.T
            cos, sin = cos[near, None], sin[near, None]
            px = poses[near, :1] + cos * x - sin * y
            py = poses[near, 1:2] + sin * x + cos * y
            least = self.distance(np.stack([px, py], axis=-1)).min(axis=1)
            least = np.sqrt(np.maximum(least**2 - (SPACING / 2) ** 2, 0.0))
            # the grid tells up to 6 cm too little
            tight = least < TIGHT if exact else np.zeros(len(near), bool)
            bodies = shapely.polygons(c.corners(*poses[near[tight]].T)[:, 1:])
            least[tight] = shapely.distance(bodies, self._filled)
            found[near] = np.minimum(least, LIKED)
        return np.maximum(found, 0.0)

    def require_reach(self) -> None:
        """Raises InputError where obstacles part the goal from the start for a disc in the car."""
        far, goal = self._ways(self.case.start), self.case.goal[:2]
        cell = ((goal - self._lo) / (CELL * COARSE)).astype(int)
        if far[tuple(cell)] == UNREACHED:
            raise pj.InputError(
                f"{self.case.name}: expected a goal that the car can reach; within {BORDER:.0f} m "
                "around start and goal obstacles part them."
            )

    def search(self, start=None) -> Way | None:
        """A way from a start (3,) to the goal, None where none was found within the budget."""
        start = self.case.start if start is None else np.asarray(start, float)
        self._to_start = self._ways(start)
        for weight, most, fine in GREEDY:
            way = self._search(start, weight, most, fine)
            if way is not None:
                return way
        return None

    def _search(self, start: np.ndarray, weight: float, most: int, fine: bool) -> Way | None:
        goal = self.case.goal
        number, heap, seen = count(), [], {}
        # of each node: pose, steering at its beginning, manoeuvre to its parent, parent
        nodes = [(goal, None, None, -1, 0.0, LIKED)]
        cells = [self._cell(goal, fine)]
        heapq.heappush(heap, (0.0, next(number), 0))
        best = None
        margin = min(
            self.margin, 0.7 * float(self.free_around(np.array([start, goal]), fine).min())
        )
        most = min(most, self.left)
        while heap and most > 0:
            bound, _, i = heapq.heappop(heap)
            if best is not None and bound >= best[0]:
                break
            pose, wheels, _, _, cost, clear = nodes[i]
            cell = cells[i]
            if seen.get(cell, np.inf) <= cost:
                continue
            seen[cell] = cost
            most, self.left = most - 1, self.left - 1
            found = self._shot(pose, start, wheels, margin)
            if i == 0 and found is not None and not self._sure(found[0][None])[0]:
                found = None
            if found is not None and (best is None or cost + found[1] < best[0]):
                best = (cost + found[1], i, found[0], min(clear, found[2]))
                if bound >= best[0]:
                    break
            # the search goes back in time: a manoeuvre that is driven the other way leads here
            around = self.free_around(compose(pose, self._samples), fine)
            least = np.minimum.reduceat(around, self._first[:-1])
            tight = fine & (around[np.array(self._first[1:]) - 1] < TIGHT)
            fits = (least >= margin) & (fine | ~self._short)
            if i == 0:
                fits &= self._sure(self.k[:, [0, 2, 1]] * [-1, 1, 1])
            free = np.flatnonzero(fits)
            if not len(free):
                continue
            poses = compose(pose, self._ends[free])
            costs = cost + self._cost(self._seconds[free], self._steering[free, 0], wheels)
            costs += DISLIKED * (LIKED - least[free])
            left = weight * self._left(poses, start)
            for j, at, sofar, rest, near in zip(free, poses, costs, left, least[free], strict=True):
                steer = self._steering[j, 1]
                cell = self._cell(at, tight[j])
                if seen.get(cell, np.inf) <= sofar:
                    continue
                way, first, last = self.k[j]
                cells.append(cell)
                nodes.append((at, steer, np.array([-way, last, first]), i, sofar, min(near, clear)))
                heapq.heappush(heap, (sofar + rest, next(number), len(nodes) - 1))
        if best is None:
            return None
        _, i, shot, clear = best
        k, poses = [shot], [start, nodes[i][0]]
        while nodes[i][3] >= 0:
            k.append(nodes[i][2])
            i = nodes[i][3]
            poses.append(nodes[i][0])
        return Way(np.array(k), np.array(poses), float(clear))

    def _cost(self, drive, steering, wheels):
        stand = 0.0 if wheels is None else np.abs(steering - wheels) / (c.MARGIN * c.RATE)
        return drive + stand + SINGLE

    def _cell(self, pose, tight):
        finer = FINER if tight else 1
        x, y = np.floor((pose[:2] - self._lo) / BLOCK * finer).astype(int)
        sector = int(np.floor(pose[2] / (2 * np.pi) * SECTORS * finer + 0.5)) % (SECTORS * finer)
        return int(x), int(y), sector, finer

    def _left(self, poses, start):
        """[s] that are thought to be left from the start to poses (n, 3)."""
        cell = np.floor((poses[:, :2] - self._lo) / (CELL * COARSE)).astype(int)
        cell = np.clip(cell, 0, np.array(self._to_start.shape) - 1)
        way = self._to_start[cell[:, 0], cell[:, 1]]
        return np.maximum(way / SPEED, in_the_open(offset_from(start, poses)))

    def _shot(self, pose, start, wheels, margin):
        """The manoeuvre (3,) from the start to a pose, its cost and clearance; None without one."""
        target = offset_from(start, pose)
        if np.hypot(*target[:2]) > SHOT or abs(target[2]) > 1.3:
            return None
        way = np.copysign(max(np.hypot(*target[:2]), 0.3), target[0])
        bend = target[2] / way * c.WHEELBASE / np.tan(c.TURN)
        guess = [[way, bend + a, bend - a] for a in (-0.6, 0.0, 0.6)]
        k = np.clip(np.array(guess), -MOST, MOST)
        k, there = reach_exactly(np.tile(target, (3, 1)), k)
        for one in k[there]:
            n = max(1, int(np.ceil(abs(one[0]) / SAMPLED)))
            least = float(self.free_around(compose(start, ends(one[None], n)[0])).min())
            if least >= margin:
                first, last = (float(x[0]) for x in steering(one[None]))
                cost = self._cost(float(seconds(one[None])[0]), last, wheels)
                cost += abs(first) / (c.MARGIN * c.RATE) + DISLIKED * (LIKED - least)
                return one, cost, least
        return None

    def _ways(self, start):
        """[m] of the shortest way from a start to each block, for a point that keeps away."""
        n = np.array(self._far.shape) // COARSE
        far = self._far[: n[0] * COARSE, : n[1] * COARSE]
        far = far.reshape(n[0], COARSE, n[1], COARSE).max(axis=(1, 3))
        free = far > 0.7
        number = np.arange(free.size).reshape(n)
        rows, columns, lengths = [], [], []
        for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
            a = (slice(0, n[0] - dx), slice(max(0, -dy), n[1] - max(0, dy)))
            b = (slice(dx, n[0]), slice(max(0, dy), n[1] - max(0, -dy)))
            both = free[a] & free[b]
            rows.append(number[a][both])
            columns.append(number[b][both])
            lengths.append(np.full(both.sum(), CELL * COARSE * np.hypot(dx, dy)))
        rows, columns, lengths = map(np.concatenate, (rows, columns, lengths))
        graph = coo_matrix((lengths, (rows, columns)), shape=(free.size,) * 2).tocsr()
        at = np.clip(((start[:2] - self._lo) / (CELL * COARSE)).astype(int), 0, n - 1)
        way = dijkstra(graph, directed=False, indices=number[tuple(at)]).reshape(n)
        return np.where(np.isfinite(way), way, UNREACHED)


FIELD, STEP, HEADINGS, SWEEPS = (
    24.0,
    0.5,
    36,
    20,
)  # [m], [m] and number of the table of `in_the_open`


def in_the_open(poses: np.ndarray) -> np.ndarray:
    """[s] of the manoeuvres from the origin to poses (n, 3) among no obstacles, about."""
    table, half = _table(), round(FIELD / STEP)
    at = np.clip(np.rint(poses[:, :2] / STEP).astype(int), -half, half) + half
    sector = np.rint(poses[:, 2] / (2 * np.pi) * HEADINGS).astype(int) % HEADINGS
    return table[sector, at[:, 0], at[:, 1]]


@cache
def _table() -> np.ndarray:
    """The same at the poses of a grid: (heading, x, y), by value iteration."""
    half = round(FIELD / STEP)
    size = 2 * half + 1
    k = np.array(
        [(s * w, a, b) for w in WAYS[2:] for s in (1, -1) for a in TURNS[::2] for b in TURNS[::2]]
    )
    end, cost = ends(k)[:, 0], seconds(k) + SINGLE
    value = np.full((HEADINGS, size, size), 60.0)
    value[0, half, half] = 0.0
    heading = 2 * np.pi * np.arange(HEADINGS) / HEADINGS
    moves = compose(np.stack([0 * heading, 0 * heading, heading], 1)[:, None], end[None])
    shift = np.rint(moves[..., :2] / STEP).astype(int)
    to = np.rint(moves[..., 2] / (2 * np.pi) * HEADINGS).astype(int) % HEADINGS
    for _ in range(SWEEPS):
        before = value.copy()
        for h in range(HEADINGS):
            for (dx, dy), other, lasts in zip(shift[h], to[h], cost, strict=True):
                a = slice(max(0, -dx), size - max(0, dx)), slice(max(0, -dy), size - max(0, dy))
                b = slice(max(0, dx), size - max(0, -dx)), slice(max(0, dy), size - max(0, -dy))
                np.minimum(value[h][a], value[other][b] + lasts, out=value[h][a])
        if np.array_equal(before, value):
            break
    return value


def outline() -> np.ndarray:
    """(n, 2) [m] points SPACING apart along the car's outline, seen from the rear axle."""
    corners = np.concatenate([c.CORNERS, c.CORNERS[:1]])
    parts = []
    for one, other in pairwise(corners):
        n = int(np.ceil(np.linalg.norm(other - one) / SPACING))
        parts.append(one + (other - one) * (np.arange(n) / n)[:, None])
    return np.concatenate(parts)
