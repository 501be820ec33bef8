"""A way for the car as a list of manoeuvres, searched for backwards from the goal, where there is
little room, to the start. It only proposes: what it gets wrong costs time, never safety.
"""

import heapq
from itertools import count, product
from typing import NamedTuple

import numpy as np

import parc_jax as pj
from sims.parking.cases import Case
from sims.parking.kinematics import (
    LONGEST,
    MOST,
    backwards,
    compose,
    ends,
    joined,
    samples_of,
    seconds,
    stand,
    steering,
)
from sims.parking.known import Exact, Known, Learned
from sims.parking.polish import Polish
from sims.parking.quicker import SINGLE, Quicker, costs
from sims.parking.space import BORDER, LIKED, TIGHT, Space
from sims.parking.way import Way, lasts

WAYS = (0.2, 0.45, 0.9, 1.8, 3.2, 5.2, LONGEST)  # [m], forwards and backwards
SHORT = (0.05, 0.1, 0.3)  # [m] of a fine search, too
TURNS = np.linspace(-MOST, MOST, 5)  # shares of the steering, first and last
BLOCK, SECTORS = 0.35, 48  # [m] and number of headings of cells of which one pose is followed
FINER = 16  # times as fine are these cells in a fine search, where it is tight
DISLIKED = 3.0  # [s / m] that each m of clearance less than LIKED costs
# weights of what is thought to be left, most poses followed with each, whether they are told apart
# finely where it is tight, and by how much all cells are turned [rad], as a dead end is one of how
# they lie: the next where none was found with the one before
GREEDY = (
    (1.1, 1000, False, 0.0),
    (1.6, 400, False, 0.0),
    (2.5, 2500, False, 0.0),
    (2.5, 2500, False, 0.5),
    (2.5, 2500, False, 1.0),
    (1.6, 1500, True, 0.0),
    (2.5, 5000, True, 0.0),
)
BUDGET = 15_000  # poses followed in all searches of a case
DRAWS = (1, 2, 3)  # seeds of quicker ways where there is time, before the car drives at all
POLISHED = 2  # of these, the quickest, that are polished


class Node(NamedTuple):
    """A pose (3,) from which a way leads to an aim, and its cell. k (3,): the manoeuvre that begins
    there, wheels: [rad] where it does, parent: number of the node to which it leads; not of an aim.
    cost: [s] from there on.
    """

    pose: np.ndarray
    cell: tuple[int, ...]
    wheels: float | None = None
    k: np.ndarray | None = None
    parent: int = -1
    cost: float = 0.0

    def stands(self, wheels):
        """[s] that a car stands there, its wheels as the manoeuvre before has them [rad]."""
        if self.k is None:
            return 0.0
        return stand(wheels - self.wheels, self.k[0])


class Guide:
    """Ways of a case. known: of the car, by default that it is `Exact`. rolling: may it roll from
    one manoeuvre into the next? budget: poses that its searches may still follow. Raises InputError
    where obstacles part the goal from the start for a disc in the car.
    """

    def __init__(self, case: Case, known: Known | None = None, rolling: bool = True):
        self.case, self.space, self.budget = case, Space(case), BUDGET
        self._spaces = {0.0: self.space}
        if not self.space.joins(case.start[:2], case.goal[:2]):
            raise pj.InputError(
                f"{case.name}: expected a goal that the car can reach; within {BORDER:.0f} m "
                "around start and goal obstacles part them."
            )
        self._known, self._rolling = known or Exact(case), rolling
        # manoeuvres that the search has, listed, and poses along each of them, in one list
        listed = product(WAYS + SHORT, (1, -1), TURNS, TURNS)
        self._k = np.array([(s * w, a, b) for w, s, a, b in listed])
        self._short = np.isin(np.abs(self._k[:, 0]), SHORT)
        self._seconds = seconds(self._k)
        self._steering = np.stack(steering(self._k), axis=1)
        self._ends = ends(self._k)[:, 0]
        self._widths = self._known.width(backwards(self._k))
        counts = samples_of(self._k)
        self._first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        self._last = self._first + counts - 1
        self._samples = np.concatenate(
            [ends(one[None], n)[0] for one, n in zip(self._k, counts, strict=True)]
        )

    def search(self, start=None, wheels: float = 0.0, tried=None, draws=DRAWS[:1]) -> Way | None:
        """A quick way from a pose (3,), by default the start, to an aim; None where none was found.
        wheels: [rad] the steering there. tried: of what `mend` of what is known says of a way,
        start and wheels, what else is known of it. draws: seeds of quicker ways, of which the
        quickest is told; of several, those of a car without errors are among them.
        """
        start = self.case.start if start is None else np.asarray(start, float)
        way, ways = self.first(start, wheels), []
        if way is None:
            return None
        maker = Quicker(self.space, self._known, self._rolling, start, wheels)
        firsts = [way, *(self._bolder(way, start, wheels) if len(draws) > 1 else [])]
        for first, draw in product(firsts, draws):
            quick = maker.quicker(first, draw)
            ways.append(quick)
        if len(draws) > 1 and isinstance(self._known, Learned):
            polish = Polish(self.space, self._known, start, wheels)
            best = sorted(ways, key=costs)[:POLISHED]
            ways += [polish.polished(one.way, draws[0], self._rolling) for one in best]
        if tried:
            ways = [tried(one, start, wheels) for one in ways]
        return min(ways, key=costs).way

    def first(self, start: np.ndarray, wheels: float = 0.0) -> Way | None:
        """As `search`, the first way that is found."""
        ways = {}
        for weight, most, fine, turned in GREEDY:
            space = self._turned(turned)
            if turned not in ways:
                ways[turned] = space.ways_from(start)
            way = self._search(start, wheels, space, ways[turned], weight, most, fine)
            if way is not None or not self.budget:
                return way
        return None

    def _bolder(self, way: Way, start: np.ndarray, wheels: float) -> list[Way]:
        """The first way of a car that drives as it is told, if one little search finds a quicker
        one than a way: made quicker, it may leave the tubes their room.
        """
        if isinstance(self._known, Exact):
            return []
        guide = Guide(self.case, Exact(self.case), self._rolling)
        guide.budget = GREEDY[0][1]
        found = guide.first(start, wheels)
        quicker = found is not None and lasts(found, wheels) < lasts(way, wheels)
        return [found] if quicker else []

    def _turned(self, turned: float) -> Space:
        """The room, its grids turned [rad]."""
        if turned not in self._spaces:
            self._spaces[turned] = Space(self.case, turned)
        self._spaces[turned].share = self.space.share
        return self._spaces[turned]

    def _search(self, start, wheels, space: Space, ways, weight, most, fine) -> Way | None:
        number, seen, best = count(), {}, None
        room, aims = space.room(start, fine), self._known.aims
        aims = aims[space.around(aims, fine) >= room]
        # an aim has its cell alone: poses beside it may be followed too
        nodes = [Node(aim, (*cell_of(space.seen(aim), fine), i)) for i, aim in enumerate(aims)]
        heap = [(0.0, next(number), i) for i in range(len(nodes))]
        most = min(most, self.budget)
        while heap and most > 0:
            bound, _, i = heapq.heappop(heap)
            node = nodes[i]
            if best is not None and bound >= best[0]:
                break
            if seen.get(node.cell, np.inf) <= node.cost:
                continue
            seen[node.cell] = node.cost
            most, self.budget = most - 1, self.budget - 1
            shot = self._shot(node, start, wheels, space, room)
            if shot is not None and (best is None or node.cost + shot[1] < best[0]):
                best = (node.cost + shot[1], i, shot[0])
                if bound >= best[0]:
                    break
            rows, poses, costs, tight = self._before(node, space, room, fine)
            rests = weight * space.takes(ways, poses)
            cells = map(cell_of, space.seen(poses), tight)
            each = zip(rows, poses, cells, costs, rests, strict=True)
            for row, pose, cell, cost, rest in each:
                if seen.get(cell, np.inf) <= cost:
                    continue
                k = backwards(self._k[row : row + 1])[0]
                nodes.append(Node(pose, cell, self._steering[row, 1], k, i, cost))
                heapq.heappush(heap, (cost + rest, next(number), len(nodes) - 1))
        if best is None:
            return None
        _, i, shot = best
        k, poses = [shot], [start, nodes[i].pose]
        while nodes[i].parent >= 0:
            k.append(nodes[i].k)
            i = nodes[i].parent
            poses.append(nodes[i].pose)
        return Way(np.array(k), np.array(poses), np.zeros(len(k), bool))

    def _before(self, node: Node, space: Space, room: float, fine: bool) -> tuple[np.ndarray, ...]:
        """Rows of listed manoeuvres that, driven the other way, lead to a node; poses where they
        begin, costs [s] from there on, and whether cells are finer there.
        """
        some = np.arange(len(self._k)) if fine else np.flatnonzero(~self._short)
        if node.k is None:
            some = some[self._known.sure(backwards(self._k[some]), node.pose)]
        poses, needed = compose(node.pose, self._ends[some]), space.needed(self._widths, room)
        here = space.around(poses, fine)
        fits = np.flatnonzero(here >= needed[some])
        least = self._along(node.pose, some[fits], space, fine)
        clear = least >= needed[some[fits]]
        fits, least = fits[clear], least[clear]
        rows = some[fits]
        costs = node.cost + self._seconds[rows] + node.stands(self._steering[rows, 0]) + SINGLE
        costs += DISLIKED * (LIKED - least)
        return rows, poses[fits], costs, fine & (here[fits] < TIGHT)

    def _along(self, pose, rows, space, fine) -> np.ndarray:
        """[m] least clearance along listed manoeuvres, given by their rows, from a pose."""
        if not len(rows):
            return np.zeros(0)
        n = self._last[rows] - self._first[rows] + 1
        starts = np.concatenate([[0], np.cumsum(n)[:-1]])
        which = np.repeat(self._first[rows] - starts, n) + np.arange(n.sum())
        around = space.around(compose(pose, self._samples[which]), fine)
        return np.minimum.reduceat(around, starts)

    def _shot(self, node: Node, start, wheels, space: Space, room):
        """The manoeuvre (3,) from the start to a node, and its cost; None without one."""
        if np.hypot(*(node.pose[:2] - start[:2])) > LONGEST:
            return None
        k, there = joined(start[None], node.pose[None])
        needed = space.needed(self._known.width(k[there]), room)
        for one, need in zip(k[there], needed, strict=True):
            n = int(samples_of(one[None])[0])
            least = float(space.around(compose(start, ends(one[None], n)[0])).min())
            if least >= need:
                if node.k is None and not self._known.sure(one[None], node.pose)[0]:
                    return None
                first, last = (float(x[0]) for x in steering(one[None]))
                cost = float(seconds(one[None])[0]) + stand(first - wheels, one[0]) + SINGLE
                cost += node.stands(last)
                return one, cost + DISLIKED * (LIKED - least)
        return None


def cell_of(pose: np.ndarray, tight: bool) -> tuple[int, ...]:
    """That a pose (3,) is in, a finer one where it is tight."""
    finer = FINER if tight else 1
    x, y = np.floor(pose[:2] / BLOCK * finer).astype(int)
    sector = int(np.floor(pose[2] / (2 * np.pi) * SECTORS * finer + 0.5)) % (SECTORS * finer)
    return int(x), int(y), sector, finer
