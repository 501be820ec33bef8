"""A way for the car as a list of manoeuvres, searched for backwards from the goal, where there is
little room, to the start. It only proposes: what it gets wrong costs time, never safety.
"""

import heapq
from itertools import count, product
from typing import NamedTuple

import numpy as np

import parc_jax as pj
from sims.parking import car as c
from sims.parking.cases import Case
from sims.parking.kinematics import (
    LONGEST,
    MOST,
    backwards,
    compose,
    ends,
    offset_from,
    reach_exactly,
    seconds,
    stand,
    steering,
)
from sims.parking.space import BORDER, LIKED, TIGHT, Space

WAYS = (0.2, 0.45, 0.9, 1.8, 3.2, 5.2, LONGEST)  # [m], forwards and backwards
SHORT = (0.05, 0.1, 0.3)  # [m] of a fine search, too
TURNS = np.linspace(-MOST, MOST, 5)  # shares of the steering, first and last
SAMPLED = 0.3  # [m] of way between poses that are looked at
BLOCK, SECTORS = 0.35, 48  # [m] and number of headings of cells of which one pose is followed
FINER = 16  # times as fine are these cells in a fine search, where it is tight
WIDTH = 0.08  # [m] of a tube that nobody told
LEAST = 0.01  # [m] of clearance beside a tube's
DISLIKED = 3.0  # [s / m] that each m of clearance less than LIKED costs
SINGLE = 2.0  # [s] that each further manoeuvre costs beside its time
# weights of what is thought to be left, most poses followed with each, and whether they are told
# apart finely where it is tight: the next where none was found with the one before
GREEDY = (
    (1.1, 1000, False),
    (1.6, 400, False),
    (2.5, 2500, False),
    (1.6, 1500, True),
    (2.5, 5000, True),
)
BUDGET = 12_000  # poses followed in all searches of a case
STOPS = 1.5  # [m] of way between poses from which a shorter way may go on
SPREADS = (0.0, 1.0, 1.0, 0.7, 0.5, 0.35, 0.25, 0.2)  # of poses near a way, one round after another
# [m, m, rad] of such poses, and how many for each of the way
DRAWN, NEARBY = np.array([0.6, 0.4, 0.2]), 6
REPLACED = 4  # manoeuvres that are tried to be replaced by one
DETOUR = 1.0  # [s] that a manoeuvre may take more than what it is in place of
AVOIDED = 2.0  # [s / m] as DISLIKED, once a way is known


class Way(NamedTuple):
    """Manoeuvres k (n, 3): way, steering first and last; poses (n + 1, 3) where they begin and end.
    clearance: [m] least, about.
    """

    k: np.ndarray
    poses: np.ndarray
    clearance: float


class Guide:
    """Ways of a case. share: of its tube's width by which a manoeuvre has to be clear. width: [m]
    (b,) of the tubes of manoeuvres k (b, 3). aims (n, 3): poses at which a way may end, by default
    the goal. sure: which of k (b, 3) may be the last, aimed at a pose (3,). left: poses that its
    searches may still follow.
    """

    def __init__(
        self,
        case: Case,
        share: float = 1.0,
        width=None,
        sure=None,
        aims=None,
    ):
        self.case, self.share, self.left = case, share, BUDGET
        self._aims = case.goal[None] if aims is None else aims
        self._width = (lambda k: np.full(len(k), WIDTH)) if width is None else width
        self.space = Space(case)
        self._sure = (lambda k, aim: np.ones(len(k), bool)) if sure is None else sure
        listed = product(WAYS + SHORT, (1, -1), TURNS, TURNS)
        self.k = np.array([(s * w, a, b) for w, s, a, b in listed])
        self._short = np.isin(np.abs(self.k[:, 0]), SHORT)
        self._seconds = seconds(self.k)
        self._steering = np.stack(steering(self.k), axis=1)
        self._ends = ends(self.k)[:, 0]
        self._widths = self._width(backwards(self.k))
        counts = samples_of(self.k)
        self._first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        self._last = self._first + counts - 1
        self._samples = np.concatenate(
            [ends(one[None], n)[0] for one, n in zip(self.k, counts, strict=True)]
        )

    def require_reach(self) -> None:
        """Raises InputError where obstacles part the goal from the start for a disc in the car."""
        if not self.space.joins(self.case.start[:2], self.case.goal[:2]):
            raise pj.InputError(
                f"{self.case.name}: expected a goal that the car can reach; within {BORDER:.0f} m "
                "around start and goal obstacles part them."
            )

    def search(self, start=None, wheels: float = 0.0) -> Way | None:
        """A way from a pose (3,), by default the start, to an aim; None where none was found.
        wheels: [rad] the steering there.
        """
        self._wheels = wheels
        start = self.case.start if start is None else np.asarray(start, float)
        ways = self.space.ways_from(start)
        for weight, most, fine in GREEDY:
            way = self._search(start, ways, weight, most, fine)
            if way is not None:
                return self._shorter(way, start)
        return None

    def _search(self, start, ways, weight: float, most: int, fine: bool) -> Way | None:
        number, seen, best = count(), {}, None
        room = self._room(start, fine)
        aims = self._aims[self.space.around(self._aims, fine) >= room]
        # of each node: pose, steering at its beginning, manoeuvre to its parent, parent, cost
        nodes = [(aim, None, None, -1, 0.0) for aim in aims]
        cells = [(*self._cell(aim, fine), i) for i, aim in enumerate(aims)]
        heap = [(0.0, next(number), i) for i in range(len(aims))]
        margins = np.minimum(self.share * self._widths + LEAST, room)
        most = min(most, self.left)
        while heap and most > 0:
            bound, _, i = heapq.heappop(heap)
            if best is not None and bound >= best[0]:
                break
            pose, wheels, _, _, cost = nodes[i]
            if seen.get(cells[i], np.inf) <= cost:
                continue
            seen[cells[i]] = cost
            most, self.left = most - 1, self.left - 1
            found = self._shot(pose, start, wheels, room)
            final = i < len(aims)
            if final and found is not None and not self._sure(found[0][None], pose)[0]:
                found = None
            if found is not None and (best is None or cost + found[1] < best[0]):
                best = (cost + found[1], i, found[0])
                if bound >= best[0]:
                    break
            # the search goes back in time: a manoeuvre that is driven the other way leads here
            some = np.arange(len(self.k)) if fine else np.flatnonzero(~self._short)
            if final:
                some = some[self._sure(backwards(self.k[some]), pose)]
            poses = compose(pose, self._ends[some])
            here = self.space.around(poses, fine)
            fits = np.flatnonzero(here >= margins[some])
            least = self._along(pose, some[fits], fine)
            clear = least >= margins[some[fits]]
            fits, least = fits[clear], least[clear]
            free, poses, tight = some[fits], poses[fits], fine & (here[fits] < TIGHT)
            costs = cost + self._cost(self._seconds[free], self._steering[free, 0], wheels)
            costs += DISLIKED * (LIKED - least)
            left = weight * self.space.left(ways, poses)
            for j, at, sofar, rest, near in zip(free, poses, costs, left, tight, strict=True):
                cell = self._cell(at, near)
                if seen.get(cell, np.inf) <= sofar:
                    continue
                cells.append(cell)
                nodes.append((at, self._steering[j, 1], backwards(self.k[j : j + 1])[0], i, sofar))
                heapq.heappush(heap, (sofar + rest, next(number), len(nodes) - 1))
        if best is None:
            return None
        _, i, shot = best
        k, poses = [shot], [start, nodes[i][0]]
        while nodes[i][3] >= 0:
            k.append(nodes[i][2])
            i = nodes[i][3]
            poses.append(nodes[i][0])
        return self._way(np.array(k), np.array(poses))

    def _shorter(self, way: Way, start) -> Way:
        """The quickest way of single manoeuvres between poses along a way and near it; then near
        that one, and so on.
        """
        draw = np.random.default_rng(0)
        for spread in SPREADS:
            way = self._quickest(way, start, *near(way, spread, draw, self._wheels))
        return way

    def _quickest(self, way: Way, start, stops, order, passed) -> Way:
        """A way by some of the stops (s, 3), each earlier in their order (s,) than the next.
        passed (s,): [s] about, when the way passes there.
        """
        further = order - order[:, None]
        begin, end = np.nonzero((further > 0) & (further <= REPLACED))
        most = passed[end] - passed[begin] + DETOUR
        far = np.hypot(*(stops[end, :2] - stops[begin, :2]).T)
        some = c.profile(np.maximum(far, 1e-3), 0.0)[1] < most
        begin, end = begin[some], end[some]
        k, there = joined(stops[begin], stops[end])
        begin, end = np.tile(begin, len(k) // len(begin)), np.tile(end, len(k) // len(end))
        final = end == len(stops) - 1
        there &= (np.abs(k[:, 0]) > 0.05) & (seconds(k) < passed[end] - passed[begin] + DETOUR)
        there[final] &= self._sure(k[final], stops[-1])
        n = len(way.k)  # what was found already, too
        k = np.concatenate([k[there], way.k])
        begin = np.concatenate([begin[there], np.arange(n)])
        end = np.concatenate([end[there], [*range(1, n), len(stops) - 1]])
        clear = np.full(len(k), -1.0)
        margins = np.minimum(self.share * self._width(k) + LEAST, self._room(start, True))
        n = samples_of(k)
        for m in np.unique(n):
            some = np.flatnonzero(n == m)
            poses = compose(stops[begin[some], None], ends(k[some], int(m)))
            least = self.space.around(poses.reshape(-1, 3), True)
            clear[some] = least.reshape(len(some), -1).min(axis=1)
        some = clear >= margins
        k, begin, end, clear = k[some], begin[some], end[some], clear[some]
        first, last = steering(k)
        drive = seconds(k) + SINGLE + AVOIDED * (LIKED - clear)
        # of each edge the quickest way that ends with it
        took, before = np.full(len(k), np.inf), np.full(len(k), -1)
        for e in np.argsort(order[begin], kind="stable"):
            if begin[e] == 0:
                took[e] = drive[e] + stand(first[e] - self._wheels)
                continue
            into = np.flatnonzero(end == begin[e])
            if len(into):
                costs = took[into] + stand(last[into] - first[e])
                best = int(np.argmin(costs))
                took[e], before[e] = costs[best] + drive[e], into[best]
        finals = np.flatnonzero(end == len(stops) - 1)
        if not len(finals) or not np.isfinite(took[finals]).any():
            return way
        e, edges = finals[np.argmin(took[finals])], []
        while e >= 0:
            edges.append(e)
            e = before[e]
        edges = edges[::-1]
        return self._way(k[edges], stops[[0, *end[edges]]])

    def _way(self, k, poses) -> Way:
        n = samples_of(k)
        along = [compose(p, ends(one[None], m)[0]) for p, one, m in zip(poses, k, n, strict=False)]
        return Way(k, poses, float(self.space.around(np.concatenate(along), True).min()))

    def _room(self, start, fine) -> float:
        """[m] of clearance that no manoeuvre has to have: start or goal have not more."""
        ends_at = np.array([start, self.case.goal])
        return 0.7 * float(self.space.around(ends_at, fine).min())

    def _along(self, pose, rows, fine) -> np.ndarray:
        """[m] least clearance along listed manoeuvres, given by their rows, from a pose."""
        if not len(rows):
            return np.zeros(0)
        n = self._last[rows] - self._first[rows] + 1
        starts = np.concatenate([[0], np.cumsum(n)[:-1]])
        which = np.repeat(self._first[rows] - starts, n) + np.arange(n.sum())
        around = self.space.around(compose(pose, self._samples[which]), fine)
        return np.minimum.reduceat(around, starts)

    def _cost(self, drive, steering, wheels):
        return drive + (0.0 if wheels is None else stand(steering - wheels)) + SINGLE

    def _cell(self, pose, tight):
        finer = FINER if tight else 1
        x, y = np.floor(pose[:2] / BLOCK * finer).astype(int)
        sector = int(np.floor(pose[2] / (2 * np.pi) * SECTORS * finer + 0.5)) % (SECTORS * finer)
        return int(x), int(y), sector, finer

    def _shot(self, pose, start, wheels, room):
        """The manoeuvre (3,) from the start to a pose, and its cost; None without one."""
        if np.hypot(*(pose[:2] - start[:2])) > LONGEST:
            return None
        k, there = joined(start[None], pose[None])
        margins = np.minimum(self.share * self._width(k[there]) + LEAST, room)
        for one, margin in zip(k[there], margins, strict=True):
            n = int(samples_of(one[None])[0])
            least = float(self.space.around(compose(start, ends(one[None], n)[0])).min())
            if least >= margin:
                first, last = (float(x[0]) for x in steering(one[None]))
                cost = self._cost(float(seconds(one[None])[0]), last, wheels)
                cost += stand(first - self._wheels) + DISLIKED * (LIKED - least)
                return one, cost
        return None


def near(way: Way, spread: float, draw, wheels: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses (s, 3) along a way, those where its manoeuvres begin first, and poses near both, drawn;
    where they are in its order (s,), and [s] about, when it passes there (s,). Its end is the last.
    """
    first, last = steering(way.k)
    stood = stand(first - np.concatenate([[wheels], last[:-1]]))
    clock = np.concatenate([[0.0], np.cumsum(stood + seconds(way.k))])
    poses, order = [way.poses[:-1]], [np.arange(len(way.k))]
    for i, (pose, k) in enumerate(zip(way.poses[:-1], way.k, strict=True)):
        n = max(1, int(abs(k[0]) / STOPS))
        poses.append(compose(pose, ends(k[None], n)[0])[:-1])
        order.append(i + np.arange(1, n) / n)
    poses, order = np.concatenate(poses), np.concatenate(order)
    if spread:
        rows = np.tile(np.arange(1, len(poses)), NEARBY)
        moves = spread * DRAWN * draw.normal(size=(len(rows), 3))
        poses = np.concatenate([poses, compose(poses[rows], moves)])
        order = np.concatenate([order, order[rows]])
    poses = np.concatenate([poses, way.poses[-1:]])
    order = np.concatenate([order, [len(way.k)]])
    return poses, order, np.interp(order, np.arange(len(clock)), clock)


def joined(poses: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Manoeuvres (3 n, 3) from poses (n, 3) to others (n, 3), three of each pair, one behind the
    other; and (3 n,) whether they lead there.
    """
    target = offset_from(poses, others)
    far = np.hypot(target[:, 0], target[:, 1])
    way = np.copysign(np.maximum(far, 0.1), target[:, 0])
    near = (far < LONGEST) & (np.abs(target[:, 2]) < c.BEND)
    bend = target[:, 2] / way * c.WHEELBASE / np.tan(c.most_steering(way))
    guess = [np.stack([way, bend + a, bend - a], axis=1) for a in (-0.6, 0.0, 0.6)]
    most = np.array([LONGEST, MOST, MOST])
    k = np.clip(np.concatenate(guess), -most, most)
    near, target = np.tile(near, 3), np.tile(target, (3, 1))
    there = np.zeros(len(k), bool)
    k[near], there[near] = reach_exactly(target[near], k[near])
    return k, there


def samples_of(k: np.ndarray) -> np.ndarray:
    """(b,) poses that are looked at along manoeuvres k (b, 3)."""
    return np.maximum(1, np.ceil(np.abs(k[:, 0]) / SAMPLED).astype(int))
