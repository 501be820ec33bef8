"""Proofs about single plans, corridors and polytopes of plans."""

import collections
import contextlib
import itertools
import math
from fractions import Fraction

from .exact import (
    FRACTION,
    Rejected,
    array,
    combine,
    dot,
    fields,
    integers,
    need,
    rejecting,
    vector,
    whole,
)
from .question import Question

MAX_CONDITIONS = 1 << 19  # kept together
GRID = 1 << 40  # per metre: boxes are rounded outward to short integers

# w . p0 + v . y[outputs] + c >= 0, or > 0 if strict, in integers.
Condition = collections.namedtuple("Condition", "name strict w v outputs c")


def condition(name, strict, w, v, outputs, c):
    """The Condition with these coefficients, which are fractions."""
    flat, _ = integers([*w, *v, c])
    return Condition(name, strict, flat[: len(w)], flat[len(w) : -1], outputs, flat[-1])


def value_at(condition, p0, p_scale, y, y_scale):
    """Something that has the sign of the condition's left side at p0 / p_scale, y / y_scale."""
    along_p0 = dot(condition.w, p0) * y_scale
    along_y = dot(condition.v, y[condition.outputs]) * p_scale
    return along_p0 + along_y + condition.c * p_scale * y_scale


def holds(condition, p0, p_scale, y, y_scale):
    """Whether a condition holds at p0 / p_scale, y / y_scale."""
    value = value_at(condition, p0, p_scale, y, y_scale)
    if condition.strict:
        return value > 0
    return value >= 0


def row_of(condition, columns, scale):
    """A condition as a row (name, strict, a, c) over (p0, k), where y has these columns."""
    along = [dot(condition.v, column[condition.outputs]) for column in columns]
    a = [x * scale for x in condition.w] + along[:-1]
    return condition.name, condition.strict, a, along[-1] + condition.c * scale


def check_inside(row, point, scale):
    """Rejects unless point / scale is strictly inside a row; of a constant one, unless it holds."""
    name, strict, a, c = row
    value = dot(a, point) + c * scale
    inside = value > 0 if any(a) or strict else value >= 0
    need(inside, f"the point is not inside the set's row of {name}")


def support(part, w):
    """An upper bound of max -w . x over the shape that grows a part of the body, its share of the
    obstacle grown by it. A root is rounded up by less than 2^-80 of itself, if it is not whole.
    """
    if part.vertices is not None:
        return max(-dot(w, vertex) for vertex in part.vertices)
    whole_w, scale = integers(w)
    square = dot(whole_w, whole_w) << 160
    root = math.isqrt(square)
    if root * root < square:
        root += 1
    return part.radius * Fraction(root, scale << 80)


def along_axes(errors) -> list:
    """How far errors reach along the axes, back and forth, rounded up in units of 1 / GRID."""
    if errors.is_box:
        return 2 * [-(-e * GRID // errors.scale) for e in errors.e]
    axes = [[int(a == axis) for a in range(errors.n)] for axis in range(errors.n)]
    axes = [[-x for x in axis] for axis in axes] + axes
    return [math.ceil(errors.support(w) * GRID) for w in axes]


class Context(Question):
    """A question, ready to check many plans against. Raises Rejected.

    reaches: of bins, as `reach` returns them.
    """

    def _read_tube(self, tube):
        super()._read_tube(tube)
        self.reaches = {}

    def reach(self, b):
        """`along_axes` of errors of bin b by interval and point; None if an axis has no bound."""
        if b not in self.reaches:
            self.reaches[b] = None
            with contextlib.suppress(Rejected):
                self.reaches[b] = [[*map(along_axes, each)] for each in self.interval[b]]
        return self.reaches[b]

    # --- conditions ----------------------------------------------------------------------------

    def shrunken_goal(self, final):
        """Rows of the predicted end: a . y <= b - (support of the errors along a) there gives
        a . y' <= b at every end y' in the tube.
        """
        self.spend(len(self.goal) * (FRACTION * self.n_end + final.cost))
        return [(a, b - final.support(a, i)) for i, (a, b) in enumerate(self.goal)]

    def conditions(self, sep, bins, boxes=None):
        """The conditions on (p0, y) that make a plan safe for every trajectory in the tube of each
        of these bins, with the separating directions sep: start, goal, obstacles. With the boxes of
        a plan, those are left out that hold for all of a box.
        """
        interval, final = self.errors(bins, max)
        self.spend(FRACTION * len(self.start) * self.n_p)
        for i, (a, b) in enumerate(self.start):
            yield condition(f"start row {i}", False, [-x for x in a], [], slice(0), b)
        for i, (a, b) in enumerate(self.shrunken_goal(final)):
            away = [-x for x in a]
            yield condition(f"goal row {i}", False, self.along_p0(away), away, self.end, b)
        work = [  # of each part in each interval
            [sum(each[i].cost + 2 * self.n_p for i in part.points) for each in interval]
            for part in self.parts
        ]
        for o, entry in enumerate(array(sep, len(self.obstacles))):
            for part, runs, costs in zip(self.parts, array(entry, len(work)), work, strict=True):
                yield from self._clear(o, part, runs, interval, costs, boxes)

    def listed_conditions(self, sep, bins):
        """The same as a list: a short file may have very many."""
        found = list(itertools.islice(self.conditions(sep, bins), MAX_CONDITIONS + 1))
        need(len(found) <= MAX_CONDITIONS, "too many conditions")
        return found

    def _clear(self, o, part, runs, interval, costs, boxes):
        """The conditions that keep a part of the body clear of obstacle o in all of its steps,
        given the errors and the work by interval.
        """
        rows, t, last = self.obstacles[o]
        for stop, multipliers in runs:
            whole(stop, t + 1, last + 1)  # a run has an interval, and all lie in the steps
            self.spend(sum(costs[t:stop]))
            w, h = combine(rows, multipliers, self.n_p)
            need(any(w), f"a separating direction of obstacle {o} is zero")
            direction, _ = integers([*w, h + support(part, w)])
            near = [(t, stop)] if boxes is None else boxes.near(part, direction, t, stop)
            for first, end in near:
                for i in part.points:
                    errors = [each[i] for each in interval[first:end]]
                    yield from self._separation(o, i, direction, first, errors)
            t = stop
        need(t == last + 1, f"the runs of obstacle {o} do not cover its steps")

    def _separation(self, o, i, direction, first, errors):
        """The conditions that point i keeps beyond obstacle o and the shape around it in a
        direction (*w, h), during the intervals from `first` on that have these errors.

        w . p > h + (support of the errors along -w) at both knots of interval t holds on the
        segment between them. If it holds for all points of a part of the body, no point of the part
        of a trajectory in the tube is in the obstacle during interval t. [T14, T19] Knot s bounds
        the intervals s - 1 and s, and the one with the wider errors counts.
        """
        *w, h = direction
        away = [-x for x in w]
        grow = [each.support(away) for each in errors]
        for s in range(first, first + len(errors) + 1):
            before = grow[max(s - 1, first) - first]
            after = grow[min(s - first, len(errors) - 1)]
            wider = max(before, after)
            W = [x * wider.denominator for x in w]
            H = h * wider.denominator + wider.numerator
            offset = self.offset(s, i)
            along = W if offset.stop else []
            name = f"obstacle {o} at knot {s}, point {i}"
            yield Condition(name, True, W, along, offset, -H)

    # --- proofs --------------------------------------------------------------------------------

    @rejecting()
    def check_sample(self, sample):
        """Proves that (p0, k) reaches the goal and touches no obstacle, for every trajectory in the
        tube; returns (p0, k) as fractions.

        A corridor is the set of all (p0, k) that pass here with its directions, so the same check
        of its own plan shows that it is not empty. [T14, T27]
        """
        fields(sample, ("p0", "k", "sep"))
        p0 = vector(sample["p0"], self.n_p)
        k = vector(sample["k"], self.n_k)
        inside = all(a <= x <= b for a, x, b in zip(self.lo, k, self.hi, strict=True))
        need(inside, "k is outside the domain")
        bins = self.bins_meeting(k, k, closed=True)  # on a border all of them count [T28]
        whole_k, k_scale = integers(k)
        whole_p0, p_scale = integers(p0)
        _, (y,), y_scale = self.evaluate([whole_k], k_scale)
        boxes = Boxes(self, bins, whole_p0, p_scale, y, y_scale)
        for asked in self.conditions(sample["sep"], bins, boxes):
            held = holds(asked, whole_p0, p_scale, y, y_scale)
            need(held, f"the condition of {asked.name} fails")
        return p0, k

    def cell(self, polytope):
        """The rows (name, strict, a, c) of a set, a . (p0, k) + c >= 0, or > 0 if strict, that say
        that k is in its bin and has its pattern; there, the columns of the last hidden layer and
        their scale.
        """
        fields(polytope, ("p0", "k", "bin", "pattern", "sep"))
        whole(polytope["bin"], 0, self.n_bins - 1)
        pattern = polytope["pattern"]
        binary = type(pattern) is str and set(pattern) <= {"0", "1"}
        need(binary, "the pattern is not a string of 0 and 1")
        complete = len(pattern) == self.n_neurons
        need(complete, "the pattern does not have one digit for each hidden neuron")
        rows = self._bin_rows(polytope["bin"])
        identity = [[int(i == j) for j in range(self.n_k)] for i in range(self.n_k)]
        neurons, columns, scale = self.hidden([*identity, [0] * self.n_k], 1, pattern)
        free = [0] * self.n_p
        for i, (bit, coefficients) in enumerate(zip(pattern, neurons, strict=True)):
            sign = 1 if bit == "1" else -1
            signed = [sign * x for x in coefficients]
            rows.append((f"neuron {i}", False, free + signed[:-1], signed[-1]))
        return rows, columns, scale

    def _bin_rows(self, number):
        """Rows of k in the domain, closed, and in a bin, open where another bin borders on it."""
        rows = []
        for i in reversed(range(self.n_k)):
            n_places = len(self.edges[i]) - 1
            number, place = divmod(number, n_places)
            low, high = self.edges[i][place : place + 2]
            ends = (
                (1, self.lo[i], False),
                (1, low, place > 0),
                (-1, self.hi[i], False),
                (-1, high, place < n_places - 1),
            )
            for sign, end, strict in ends:  # sign * (k_i - end) >= 0
                a = [0] * (self.n_p + self.n_k)
                a[self.n_p + i] = sign * end.denominator
                rows.append((f"axis {i} of k", strict, a, -sign * end.numerator))
        return rows

    @rejecting()
    def check_set(self, polytope):
        """Proves that every (p0, k) in the polytope S is safe and that it has interior points.

        Safety needs no test. S lies in one bin of k and leaves out the borders to other bins, where
        their tubes would count too [T28]. On S the affine map of the pattern is the network
        (induction over the layers: every sign agrees), so the rows of its cell and of the listed
        conditions say for each (p0, k) in S what check_sample asks. [T29] The point is strictly
        inside each row that is not constant, hence so is a ball around it; others have to be true.
        """
        given = vector(polytope["p0"], self.n_p) + vector(polytope["k"], self.n_k)
        point, scale = integers(given)
        p0, k = point[: self.n_p], point[self.n_p :]
        rows, columns, cell_scale = self.cell(polytope)
        for row in rows:
            check_inside(row, point, scale)
        hidden = [dot(x, [*k, scale]) for x in zip(*columns, strict=True)]
        (y,), y_scale = self.outputs([hidden], cell_scale * scale)
        for asked in self.listed_conditions(polytope["sep"], [polytope["bin"]]):
            if not value_at(asked, p0, scale, y, y_scale) > 0:
                check_inside(row_of(asked, *self.outputs(columns, cell_scale)), point, scale)


class Boxes:
    """Boxes that hold all points of a part of the body in some intervals, for a plan and every
    trajectory in the tube of some bins; rounded outward, in units of 1 / GRID.
    """

    def __init__(self, context, bins, p0, p_scale, y, y_scale):
        """At p0 / p_scale, y / y_scale."""
        self.context = context
        self.reaches = [context.reach(b) for b in bins]
        scale = p_scale * y_scale
        self.p0 = [x * y_scale * GRID // scale for x in p0]
        self.y = [x * p_scale * GRID // scale for x in y]
        self.known: dict = {}

    def near(self, part, direction: list, t: int, stop: int) -> list:
        """The intervals (first, end) in t .. stop in which not all of a box is beyond a direction
        (*w, h), halved down to single ones: there the errors of one interval count at both knots,
        and all of these ask what the wider errors do.
        """
        *w, h = direction
        if None in self.reaches:
            return [(t, stop)]
        box = zip(w, *self.box(part.points, t, stop), strict=True)
        if sum(min(x * lo, x * hi) for x, lo, hi in box) > h * GRID:
            return []
        if stop - t == 1:
            return [(t, stop)]
        middle = (t + stop) // 2
        return self.near(part, direction, t, middle) + self.near(part, direction, middle, stop)

    def box(self, points: list, t: int, stop: int) -> tuple:
        """(lo, hi) of these points in the intervals t .. stop."""
        name = *points, t, stop
        if name not in self.known:
            if stop - t > 1:
                middle = (t + stop) // 2
                held = [self.box(points, t, middle), self.box(points, middle, stop)]
            else:
                held = [self.around(s, i, t) for s in (t, stop) for i in points]
            lows, highs = zip(*held, strict=True)
            lo, hi = zip(*lows, strict=True), zip(*highs, strict=True)
            self.known[name] = [*map(min, lo)], [*map(max, hi)]
        return self.known[name]

    def around(self, s: int, i: int, t: int) -> tuple:
        """(lo, hi) of point i at knot s with the errors of interval t."""
        offset = self.y[self.context.offset(s, i)] or [0] * len(self.p0)
        reach = [max(far) for far in zip(*(each[t][i] for each in self.reaches), strict=True)]
        at = [a + b for a, b in zip(self.p0, offset, strict=True)]  # less than 2 too low
        n = len(at)
        lo = [x - e for x, e in zip(at, reach[:n], strict=True)]
        return lo, [x + 2 + e for x, e in zip(at, reach[n:], strict=True)]
