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
    LEFT,
    LONGEST,
    MOST,
    backwards,
    compose,
    ends,
    offset_from,
    reach_exactly,
    rolls,
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
SINGLE = 1.0  # [s] that each further manoeuvre from rest costs beside its time
ROLLED = 0.3  # [s] likewise, of one that begins while the car rolls
# such a one begins with the wheels about where the one before has them: their difference, squared,
# by the speed, turns the car by as much [rad] before they are; and faster than that [m/s]
TURNED, ROLLING = 0.12, 0.5
CORRECTS = 2.0  # of the steering that corrects it, as a share, for each of that and of m of way
BEYOND = 0.4  # [m] of its way, at least, beyond what it takes to stop
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
# of poses near a way, one round after another
SPREADS = (0.0, 1.0, 1.0, 1.0, 0.7, 0.7, 0.5, 0.5, 0.35, 0.35, 0.25, 0.2, 0.15)
# [m, m, rad] of such poses, and how many for each of the way
DRAWN, NEARBY = np.array([0.6, 0.4, 0.2]), 12
MOST_NEARBY = 240  # of all poses of a way, about
REPLACED = 4  # manoeuvres that are tried to be replaced by one
DRAWS = (1, 2, 3)  # seeds of these poses, of which the next is for what cannot be driven
UNSURE = 5.0  # [s] that a manoeuvre which may not be driven counts as
DETOUR = 3.0  # [s] that a manoeuvre may take more than what it is in place of
AVOIDED = 2.0  # [s / m] as DISLIKED, once a way is known


class Way(NamedTuple):
    """Manoeuvres k (n, 3): way, steering first and last; poses (n + 1, 3) where they begin and end.
    clearance: [m] least, about. left (n,): is each left for the next while the car rolls?
    """

    k: np.ndarray
    poses: np.ndarray
    clearance: float
    left: np.ndarray

    @property
    def upto(self) -> np.ndarray:
        """(n,) of each manoeuvre the share that is driven."""
        return np.where(self.left, LEFT, 1.0)

    def unleft(self, i: int) -> "Way":
        """The way whose manoeuvre number i ends at rest where it was left."""
        k, left = self.k.copy(), self.left.copy()
        (size, first, last), left[i] = k[i], False
        share = c.most_steering(size) / c.most_steering(size * LEFT)
        k[i] = size * LEFT, share * first, share * (first + (last - first) * LEFT)
        return self._replace(k=k, left=left)


class Guide:
    """Ways of a case. share: of its tube's width by which a manoeuvre has to be clear. width: [m]
    (b,) of the tubes of manoeuvres k (b, 3), begun at a speed [m/s]. aims (n, 3): poses at which a
    way may end, by default the goal. sure: which of k (b, 3), begun at a speed, may be the last,
    aimed at a pose (3,). left: poses that its searches may still follow. rolling: may the car roll
    from one into the next? mend: makes of a way from a pose (3,), and steering [rad], one that the
    car can drive, and tells how many of its manoeuvres it may not.
    """

    def __init__(
        self,
        case: Case,
        share: float = 1.0,
        width=None,
        sure=None,
        aims=None,
        rolling: bool = True,
        mend=None,
    ):
        self.case, self.share, self.left = case, share, BUDGET
        self._aims = case.goal[None] if aims is None else aims
        self.rolling, self.spreads = rolling, SPREADS
        self._mend = (lambda way, start, wheels: (way, 0)) if mend is None else mend
        self._width = (lambda k, begins=0.0: np.full(len(k), WIDTH)) if width is None else width
        self.space = Space(case)
        self._sure = (lambda k, aim, begins=0.0: np.ones(len(k), bool)) if sure is None else sure
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

    def clears(self, poses, width: float) -> bool:
        """Whether poses (n, 3) are clear by their share of a tube's width [m]."""
        least = float(self.space.around(np.asarray(poses), True).min())
        return least >= min(self.share * width + LEAST, self._room(poses[0], True))

    def search(self, start=None, wheels: float = 0.0, tried=None) -> Way | None:
        """A way from a pose (3,), by default the start, to an aim; None where none was found.
        wheels: [rad] the steering there. tried: as `mend`; a way of which it likes all is taken at
        once.
        """
        tried = tried or self._mend
        self._wheels = wheels
        start = self.case.start if start is None else np.asarray(start, float)
        ways = self.space.ways_from(start)
        for weight, most, fine in GREEDY:
            way = self._search(start, ways, weight, most, fine)
            if way is not None:
                ways = []
                for draw in DRAWS:
                    ways.append(tried(self._shorter(way, start, draw), start, wheels))
                    if not ways[-1][1]:
                        break
                return min(ways, key=self._costs)[0]
        return None

    def _costs(self, tried: tuple[Way, int]) -> float:
        """[s] that a way takes, and more for each manoeuvre that may not be driven."""
        return lasts(tried[0], self._wheels) + UNSURE * tried[1]

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
            pose, wheels, move, _, cost = nodes[i]
            ahead = np.inf if move is None else move[0]
            if seen.get(cells[i], np.inf) <= cost:
                continue
            seen[cells[i]] = cost
            most, self.left = most - 1, self.left - 1
            found = self._shot(pose, start, wheels, ahead, room)
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
            turned = 0.0 if wheels is None else self._steering[free, 0] - wheels
            costs = cost + self._seconds[free] + stand(turned, ahead) + SINGLE
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

    def _shorter(self, way: Way, start, seed: int) -> Way:
        """The quickest way of single manoeuvres between poses along a way and near it, as the car
        can drive it; then near that one, and so on.
        """
        draw = np.random.default_rng(seed)
        best = self._mend(way, start, self._wheels)
        for spread in self.spreads:
            way = self._quickest(best[0], start, *near(best[0], spread, draw, self._wheels))
            best = min(best, self._mend(way, start, self._wheels), key=self._costs)
        return best[0]

    def _quickest(self, way: Way, start, stops, order, passed) -> Way:
        """A way by some of the stops (s, 3), each earlier in their order (s,) than the next.
        passed (s,): [s] about, when the way passes there.
        """
        further = order - order[:, None]
        begin, end = np.nonzero((further > 0) & (further <= REPLACED))
        most = passed[end] - passed[begin] + DETOUR
        far = np.hypot(*(stops[end, :2] - stops[begin, :2]).T)
        some = far / (c.MARGIN * c.SPEED) < most
        begin, end = begin[some], end[some]
        found = [(way.k, np.arange(len(way.k)), [*range(1, len(way.k)), len(stops) - 1], way.left)]
        for left in (False, True)[: 1 + self.rolling]:  # at rest, or while the car rolls
            some = (end < len(stops) - 1) | (not left)
            first, then = begin[some], end[some]
            k, there = joined(stops[first], stops[then], LEFT if left else 1.0)
            first, then = np.tile(first, 3), np.tile(then, 3)  # three of each pair
            # at its quickest, for those that are left the car may roll already
            lasts = rolls(k, c.SPEED)[0] if left else seconds(k)
            there &= (np.abs(k[:, 0]) > 0.05) & (lasts < passed[then] - passed[first] + DETOUR)
            found.append((k[there], first[there], then[there], np.full(there.sum(), left)))
        k, begin, end, left = (np.concatenate(each) for each in zip(*found, strict=True))
        clear = np.full(len(k), -1.0)
        n = samples_of(k)
        for m in np.unique(n):
            some = np.flatnonzero(n == m)
            poses = compose(stops[begin[some], None], ends(k[some], int(m)))
            least = self.space.around(poses.reshape(-1, 3), True)
            clear[some] = least.reshape(len(some), -1).min(axis=1)
        # may begin at rest, and while the car rolls
        final, room, may = end == len(stops) - 1, self._room(start, True), []
        for begins in (0.0, c.SPEED / 2):
            fits = clear >= np.minimum(self.share * self._width(k, begins) + LEAST, room)
            fits[final] &= self._sure(k[final], stops[-1], begins)
            may.append(fits)
        may[1] &= self.rolling
        some = may[0] | may[1]
        k, begin, end, left, clear, stands, rolled = (
            each[some] for each in (k, begin, end, left, clear, *may)
        )
        first, last = steering(k)
        leaves = np.where(left, first + (last - first) * LEFT, last)  # [rad] of the wheels there
        beside, steered = AVOIDED * (LIKED - clear), np.abs(k[:, 1:]).max(axis=1)
        # of each edge the quickest way that ends with it, and the speed there
        took, speed = np.full(len(k), np.inf), np.zeros(len(k))
        before = np.full(len(k), -1)
        for e in np.argsort(order[begin], kind="stable"):
            into = np.flatnonzero((end == begin[e]) & np.isfinite(took)) if begin[e] else []
            if begin[e] == 0:
                since = np.array([stand(first[e] - self._wheels, k[e, 0]) + SINGLE])
                begins = np.zeros(1)
                fits = stands[e : e + 1]
            elif len(into):
                begins, turned = speed[into], leaves[into] - first[e]
                on = (np.sign(k[into, 0]) == np.sign(k[e, 0])) & (begins * turned**2 < TURNED)
                on &= c.stopping(begins) + BEYOND < abs(k[e, 0])
                on &= begins * turned**2 * CORRECTS < (MOST - steered[e]) * abs(k[e, 0])
                fits = np.where(left[into], on & rolled[e], stands[e])
                since = took[into] + np.where(left[into], ROLLED, stand(turned, k[e, 0]) + SINGLE)
            else:
                continue
            move = np.repeat(k[e : e + 1], len(begins), axis=0)
            if left[e]:
                lasts, ends_at = rolls(move, begins)
                fits &= ends_at > ROLLING
            else:
                lasts, ends_at = seconds(move, begins), np.zeros(len(move))
            costs = np.where(fits, since + lasts, np.inf)
            best = int(np.argmin(costs))
            took[e], speed[e] = costs[best] + beside[e], ends_at[best]
            if begin[e]:
                before[e] = into[best]
        finals = np.flatnonzero(end == len(stops) - 1)
        if not len(finals) or not np.isfinite(took[finals]).any():
            return way
        e, edges = finals[np.argmin(took[finals])], []
        while e >= 0:
            edges.append(e)
            e = before[e]
        edges = edges[::-1]
        return self._way(k[edges], stops[[0, *end[edges]]], left[edges])

    def _way(self, k, poses, left=None) -> Way:
        n, left = samples_of(k), np.zeros(len(k), bool) if left is None else left
        along = [compose(p, ends(one[None], m)[0]) for p, one, m in zip(poses, k, n, strict=False)]
        return Way(k, poses, float(self.space.around(np.concatenate(along), True).min()), left)

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

    def _cell(self, pose, tight):
        finer = FINER if tight else 1
        x, y = np.floor(pose[:2] / BLOCK * finer).astype(int)
        sector = int(np.floor(pose[2] / (2 * np.pi) * SECTORS * finer + 0.5)) % (SECTORS * finer)
        return int(x), int(y), sector, finer

    def _shot(self, pose, start, wheels, ahead, room):
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
                cost = float(seconds(one[None])[0]) + stand(first - self._wheels, one[0]) + SINGLE
                cost += 0.0 if wheels is None else stand(last - wheels, ahead)
                return one, cost + DISLIKED * (LIKED - least)
        return None


def near(way: Way, spread: float, draw, wheels: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses (s, 3) along a way, those where its manoeuvres begin first, and poses near both, drawn;
    where they are in its order (s,), and [s] about, when it passes there (s,). Its end is the last.
    """
    first, last = steering(way.k)
    leaves = np.where(way.left, first + (last - first) * LEFT, last)
    stood = stand(first - np.concatenate([[wheels], leaves[:-1]]), way.k[:, 0])
    rolled, begins = np.concatenate([[False], way.left[:-1]]), 0.0
    each = []
    for k, on, left in zip(way.k[:, None], rolled, way.left, strict=True):
        begins = begins if on else 0.0
        (took,), (speed,) = rolls(k, begins)
        each.append(took if left else seconds(k, begins)[0])
        begins = speed
    clock = np.concatenate([[0.0], np.cumsum(np.where(rolled, 0.0, stood) + each)])
    poses, order = [way.poses[:-1]], [np.arange(len(way.k))]
    for i, (pose, k, upto) in enumerate(zip(way.poses[:-1], way.k, way.upto, strict=True)):
        n = max(1, int(abs(k[0]) * upto / STOPS))
        poses.append(compose(pose, ends(k[None], n, upto)[0])[:-1])
        order.append(i + np.arange(1, n) / n)
    poses, order = np.concatenate(poses), np.concatenate(order)
    if spread:
        rows = np.tile(np.arange(1, len(poses)), int(np.clip(MOST_NEARBY // len(poses), 2, NEARBY)))
        moves = spread * DRAWN * draw.normal(size=(len(rows), 3))
        poses = np.concatenate([poses, compose(poses[rows], moves)])
        order = np.concatenate([order, order[rows]])
    poses = np.concatenate([poses, way.poses[-1:]])
    order = np.concatenate([order, [len(way.k)]])
    return poses, order, np.interp(order, np.arange(len(clock)), clock)


def lasts(way: Way, wheels: float) -> float:
    """[s] about, that a way takes from rest, its wheels [rad] there."""
    return float(near(way, 0.0, None, wheels)[2][-1])


def joined(
    poses: np.ndarray, others: np.ndarray, upto: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Manoeuvres (3 n, 3) from poses (n, 3) to others (n, 3), three of each pair, one behind the
    other; and (3 n,) whether they lead there after a share of their way.
    """
    target = offset_from(poses, others)
    far = np.hypot(target[:, 0], target[:, 1]) / upto
    way = np.copysign(np.maximum(far, 0.1), target[:, 0])
    near = (far < LONGEST) & (np.abs(target[:, 2]) < c.BEND)
    bend = target[:, 2] / (upto * way) * c.WHEELBASE / np.tan(c.most_steering(way))
    guess = [np.stack([way, bend + a, bend - a], axis=1) for a in (-0.6, 0.0, 0.6)]
    most = np.array([LONGEST, MOST, MOST])
    k = np.clip(np.concatenate(guess), -most, most)
    near, target = np.tile(near, 3), np.tile(target, (3, 1))
    there = np.zeros(len(k), bool)
    k[near], there[near] = reach_exactly(target[near], k[near], lambda k: ends(k, 1, upto))
    return k, there


def samples_of(k: np.ndarray) -> np.ndarray:
    """(b,) poses that are looked at along manoeuvres k (b, 3)."""
    return np.maximum(1, np.ceil(np.abs(k[:, 0]) / SAMPLED).astype(int))
