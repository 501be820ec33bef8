"""Problem, network and tube in exact numbers, and the proofs about single plans, corridors and
polytopes of plans.
"""

import collections
import copy
import itertools
import math
from fractions import Fraction

from .exact import (
    Rejected,
    array,
    box,
    combine,
    dot,
    fields,
    halfspaces,
    integers,
    need,
    number,
    rejecting,
    vector,
    whole,
)

MAX_LAYERS = 64
FRACTION = 16  # work of one operation on fractions, in products of short integers

# w . p0 + v . y[part] + c >= 0, or > 0 if strict, in integers.
Condition = collections.namedtuple("Condition", "name strict w v part c")


def condition(name, strict, w, v, part, c):
    """The Condition with these coefficients, which are fractions."""
    flat, _ = integers([*w, *v, c])
    return Condition(name, strict, flat[: len(w)], flat[len(w) : -1], part, flat[-1])


def holds(condition, p0, p_scale, y, y_scale):
    """Whether a condition holds at p0 / p_scale, y / y_scale."""
    along_p0 = dot(condition.w, p0) * y_scale
    along_y = dot(condition.v, y[condition.part]) * p_scale
    value = along_p0 + along_y + condition.c * p_scale * y_scale
    if condition.strict:
        return value > 0
    return value >= 0


class Context:
    """Problem, network and tube, ready to check many plans against. Raises Rejected.

    work_left: products of short integers that may still be spent, so that a small file cannot ask
    for long work; without end unless somebody sets it.
    """

    @rejecting()
    def __init__(self, problem, network, tube):
        self.work_left = math.inf
        self._read_problem(problem)
        self._read_network(network)
        self._read_tube(tube)

    @rejecting()
    def about(self, problem):
        """The same network and tube, not read again, under another problem of the same dimensions
        and domain.
        """
        other = copy.copy(self)
        other._read_problem(problem)
        for name in ("n_p", "n_q", "n_k", "T", "lo", "hi"):
            if getattr(other, name) != getattr(self, name):
                raise Rejected("the other problem has other dimensions or another domain")
        return other

    def spend(self, count, bits=1, other_bits=1):
        """Counts so many products of integers of these lengths."""
        self.work_left -= count * (1 + bits * other_bits // (1 << 16))
        need(self.work_left >= 0, "it asks for more work than the size of the file allows")

    # --- reading -------------------------------------------------------------------------------

    def _read_problem(self, problem):
        names = ("n_p", "n_q", "n_k", "domain", "goal", "obstacles", "body", "start", "steps", "dt")
        fields(problem, names)
        self.n_p = whole(problem["n_p"], 1, 8)
        self.n_q = whole(problem["n_q"], 0, 64)
        self.n_k = whole(problem["n_k"], 1, 8)
        self.T = whole(problem["steps"], 1, 100_000)
        self.end = slice((self.T - 1) * self.n_p, None)  # (c_T, q) in y
        self.lo, self.hi = box(problem["domain"], self.n_k)
        self.goal = halfspaces(fields(problem["goal"], ("A", "b")), self.n_p + self.n_q)
        self.start = []
        if problem["start"] is not None:
            self.start = halfspaces(fields(problem["start"], ("A", "b")), self.n_p)
        self.obstacles = [self._obstacle(part) for part in array(problem["obstacles"])]
        self._read_body(problem["body"])

    def _obstacle(self, part):
        """(rows, first interval, last interval) of an obstacle."""
        fields(part, ("A", "b"), ("steps",))
        first, last = part.get("steps", [0, self.T - 1])
        whole(first, 0, self.T - 1)
        whole(last, first, self.T - 1)
        return halfspaces(part, self.n_p), first, last

    def _read_body(self, body):
        """A disc (or ball) of a radius, or the convex hull of vertices."""
        self.radius = Fraction(0)
        self.vertices = None
        if "radius" in body:
            fields(body, ("radius",))
            self.radius = number(body["radius"])
            need(self.radius >= 0, "the radius is negative")
        else:
            fields(body, ("vertices",))
            self.vertices = [vector(vertex, self.n_p) for vertex in body["vertices"]]
            need(len(self.vertices) > 0, "the body has no vertex")

    def _read_network(self, network):
        """Layers (integer weights, integer biases, their common denominator), and per layer the
        length of its longest integer.
        """
        fields(network, ("weights", "biases"))
        need(0 < len(network["weights"]) <= MAX_LAYERS, "too few or too many layers")
        self.layers = []
        self.layer_bits = []
        width = self.n_k
        for weights, biases in zip(network["weights"], network["biases"], strict=True):
            rows = [vector(row, width) for row in array(weights)]
            flat = vector(biases, len(rows))
            for row in rows:
                flat += row
            flat, q = integers(flat)
            bias = flat[: len(rows)]
            W = []
            for i in range(len(rows)):
                begin = len(rows) + i * width
                W.append(flat[begin : begin + width])
            self.layers.append((W, bias, q))
            self.layer_bits.append(max((x.bit_length() for x in [*flat, q]), default=1))
            width = len(rows)
        need(width == self.T * self.n_p + self.n_q, "the network does not have T n_p + n_q outputs")
        self.n_neurons = sum(len(W) for W, _, _ in self.layers[:-1])

    def _read_tube(self, tube):
        """Edges of the bins as fractions; widths of all bins as integers over e_scale."""
        fields(tube, ("edges", "interval", "final"))
        self.edges = []
        for edge, lo, hi in zip(tube["edges"], self.lo, self.hi, strict=True):
            edge = [number(value) for value in array(edge)]
            need(len(edge) >= 2, "an axis of the tube has no bin")
            increase = all(a < b for a, b in itertools.pairwise(edge))
            need(increase, "the edges of the tube do not increase")
            need(edge[0] <= lo and hi <= edge[-1], "the tube does not cover the domain")
            self.edges.append(edge)
        self.n_bins = math.prod(len(edge) - 1 for edge in self.edges)
        interval = []
        for part in array(tube["interval"], self.n_bins):
            interval.append([vector(widths, self.n_p) for widths in array(part, self.T)])
        final = [vector(row, self.n_p + self.n_q) for row in array(tube["final"], self.n_bins)]
        everything = []
        for rows in [*interval, final]:
            for row in rows:
                everything += row
        flat, self.e_scale = integers(everything)
        need(all(value >= 0 for value in flat), "the tube has a negative width")
        scaled = iter(flat)
        self.interval = [[[next(scaled) for _ in row] for row in part] for part in interval]
        self.final = [[next(scaled) for _ in row] for row in final]

    # --- tube ----------------------------------------------------------------------------------

    def bins_meeting(self, lo, hi, closed):
        """Numbers of the bins that meet the box [lo, hi] of k, row-major: as closed boxes, or with
        their interiors.
        """
        bins = [0]
        for edge, a, b in zip(self.edges, lo, hi, strict=True):
            self.spend(FRACTION * len(edge))
            places = []
            for i in range(len(edge) - 1):
                if closed:
                    meets = edge[i] <= b and a <= edge[i + 1]
                else:
                    meets = edge[i] < b and a < edge[i + 1]
                if meets:
                    places.append(i)
            bins = [number * (len(edge) - 1) + i for number in bins for i in places]
        return bins

    def widths(self, bins, pick):
        """(widths of each interval, final widths) over e_scale: componentwise the largest (pick is
        max) or the least (min) of some bins. No bins have no widths: an error.
        """
        if len(bins) == 1:
            return self.interval[bins[0]], self.final[bins[0]]
        self.spend(len(bins) * (self.T * self.n_p + self.n_p + self.n_q))
        interval = []
        for t in range(self.T):
            row = [pick(self.interval[b][t][j] for b in bins) for j in range(self.n_p)]
            interval.append(row)
        final = [pick(self.final[b][j] for b in bins) for j in range(self.n_p + self.n_q)]
        return interval, final

    # --- network -------------------------------------------------------------------------------

    def evaluate(self, columns, scale, pattern=None):
        """The network as an exact affine map of its input: columns hold the coefficients of the
        input and, last, the constant; a point is a constant alone.

        The pattern says which neurons pass; without one, at a point, the sign does, which is ReLU.
        Returns the coefficients of each neuron over some positive scale, the columns of the
        outputs, and their scale.
        """
        neurons: list = []
        place = 0
        for depth, (W, bias, q) in enumerate(self.layers, 1):
            longest = max(abs(x).bit_length() for column in columns for x in [*column, scale])
            products = len(columns) * len(W) * (len(columns[0]) + 1)
            self.spend(products, longest, self.layer_bits[depth - 1])
            columns = [[dot(row, column) for row in W] for column in columns]
            columns[-1] = [x + b * scale for x, b in zip(columns[-1], bias, strict=True)]
            scale *= q
            if depth < len(self.layers):
                if pattern is None:
                    passes = [x > 0 for x in columns[-1]]
                else:
                    passes = [bit == "1" for bit in pattern[place : place + len(W)]]
                place += len(W)
                neurons += zip(*columns, strict=True)
                columns = [
                    [x if on else 0 for x, on in zip(column, passes, strict=True)]
                    for column in columns
                ]
        return neurons, columns, scale

    # --- conditions ----------------------------------------------------------------------------

    def shrunken_goal(self, final):
        """Rows of the predicted end: a . y + |a| . e <= b there gives a . y' <= b at every end y'
        in the tube.
        """
        self.spend(FRACTION * len(self.goal) * (self.n_p + self.n_q))
        rows = []
        for a, b in self.goal:
            lost = dot([abs(x) for x in a], final)
            rows.append((a, b - Fraction(lost, self.e_scale)))
        return rows

    def body_support(self, w):
        """An upper bound of max -w . x over the body, its share of the obstacle grown by it. A root
        is rounded up by less than 2^-80 of itself, not at all if it is whole.
        """
        if self.vertices is not None:
            return max(-dot(w, vertex) for vertex in self.vertices)
        whole_w, scale = integers(w)
        square = dot(whole_w, whole_w) << 160
        root = math.isqrt(square)
        if root * root < square:
            root += 1
        return self.radius * Fraction(root, scale << 80)

    def conditions(self, sep, interval, final):
        """The conditions on (p0, y) that make a plan safe for every trajectory in the tube of these
        widths, with the separating directions sep: start, goal, obstacles.
        """
        self.spend(FRACTION * len(self.start) * self.n_p)
        for i, (a, b) in enumerate(self.start):
            yield condition(f"start row {i}", False, [-x for x in a], [], slice(0), b)
        for i, (a, b) in enumerate(self.shrunken_goal(final)):
            away = [-x for x in a]
            yield condition(f"goal row {i}", False, away[: self.n_p], away, self.end, b)
        for o, runs in enumerate(array(sep, len(self.obstacles))):
            rows, t, last = self.obstacles[o]
            for stop, multipliers in runs:
                whole(stop, t + 1, last + 1)  # a run has an interval, and all lie in the steps
                yield from self._separation(o, rows, t, stop, multipliers, interval)
                t = stop
            need(t == last + 1, f"the runs of obstacle {o} do not cover its steps")

    def _separation(self, o, rows, first, stop, multipliers, interval):
        """The conditions of one direction w for obstacle o in the intervals first .. stop - 1.

        w . p > h + (support of -body) + |w| . e_t at both knots of interval t holds on the segment
        between them, so during interval t no point of the body of a trajectory in the tube is in
        the obstacle. [T14] One e_t serves both knots of its interval; knot s bounds the intervals
        s - 1 and s, and the wider of those that the run has counts.
        """
        w, h = combine(rows, multipliers, self.n_p)
        need(any(w), f"a separating direction of obstacle {o} is zero")
        scaled, _ = integers([*w, h + self.body_support(w)])
        self.spend(2 * (stop - first) * self.n_p)
        size = [abs(x) for x in scaled[:-1]]
        grow = [dot(size, interval[t]) for t in range(first, stop)]
        W = [x * self.e_scale for x in scaled[:-1]]
        H = scaled[-1] * self.e_scale
        for s in range(first, stop + 1):
            before = grow[max(s - 1, first) - first]
            after = grow[min(s, stop - 1) - first]
            constant = -H - max(before, after)
            name = f"obstacle {o} at knot {s}"
            if s == 0:  # c_0 = 0 is not an output
                yield Condition(name, True, W, [], slice(0), constant)
            else:
                knot = slice((s - 1) * self.n_p, s * self.n_p)
                yield Condition(name, True, W, W, knot, constant)

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
        bins = self.bins_meeting(k, k, closed=True)  # on a border the widest of them counts [T28]
        interval, final = self.widths(bins, max)
        whole_k, k_scale = integers(k)
        whole_p0, p_scale = integers(p0)
        _, columns, y_scale = self.evaluate([whole_k], k_scale)
        y = columns[0]
        for asked in self.conditions(sample["sep"], interval, final):
            held = holds(asked, whole_p0, p_scale, y, y_scale)
            need(held, f"the condition of {asked.name} fails")
        return p0, k

    @rejecting()
    def set_rows(self, polytope):
        """The polytope S of a set: rows (name, strict, a, c) in integers, a . (p0, k) + c >= 0, or
        > 0 if strict.

        S lies in one bin of k and leaves out the borders to other bins, where their tubes would
        count too [T28]. On S the affine map of the pattern is the network (induction over the
        layers: every sign agrees), so the rows say for each (p0, k) in S what check_sample asks.
        [T29]
        """
        fields(polytope, ("p0", "k", "bin", "pattern", "sep"))
        whole(polytope["bin"], 0, self.n_bins - 1)
        pattern = polytope["pattern"]
        binary = type(pattern) is str and set(pattern) <= {"0", "1"}
        need(binary, "the pattern is not a string of 0 and 1")
        complete = len(pattern) == self.n_neurons
        need(complete, "the pattern does not have one digit for each hidden neuron")
        rows = self._bin_rows(polytope["bin"])
        identity = []
        for i in range(self.n_k):
            identity.append([int(i == j) for j in range(self.n_k)])
        nothing = [0] * self.n_k
        neurons, columns, scale = self.evaluate([*identity, nothing], 1, pattern)
        free = [0] * self.n_p
        for i, (bit, coefficients) in enumerate(zip(pattern, neurons, strict=True)):
            sign = 1 if bit == "1" else -1
            signed = [sign * x for x in coefficients]
            rows.append((f"neuron {i}", False, free + signed[:-1], signed[-1]))
        interval, final = self.widths([polytope["bin"]], max)
        for asked in self.conditions(polytope["sep"], interval, final):
            along = [dot(asked.v, column[asked.part]) for column in columns]
            a = [x * scale for x in asked.w] + along[:-1]
            rows.append((asked.name, asked.strict, a, along[-1] + asked.c * scale))
        return rows

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
        """Proves that every (p0, k) in the polytope of set_rows is safe and that it has interior
        points.

        Safety needs no test: the rows are its conditions. The point is strictly inside each row
        that is not constant, hence so is a ball around it; a constant row has only to be true.
        """
        given = vector(polytope["p0"], self.n_p) + vector(polytope["k"], self.n_k)
        point, scale = integers(given)
        for name, strict, a, c in self.set_rows(polytope):
            value = dot(a, point) + c * scale
            if any(a) or strict:
                inside = value > 0
            else:
                inside = value >= 0
            need(inside, f"the point is not inside the set's row of {name}")
