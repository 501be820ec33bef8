"""The question that an answer is about, in exact numbers: problem, network and tube."""

import collections
import copy
import itertools
import math
import operator
from fractions import Fraction

from .errors import AtEnd, Several, Template, Widths
from .exact import (
    FRACTION,
    Rejected,
    array,
    box,
    dot,
    fields,
    halfspaces,
    hex_integers,
    need,
    number,
    parsed_multipliers,
    rejecting,
    vector,
    whole,
    whole_halfspaces,
    whole_numbers,
)

MAX_LAYERS = 64
MAX_REFERENCE_POINTS = 64
MAX_PARAMETERS = 8

# The hull of some reference points, and every point of it grown by a ball of a radius, or by the
# hull of vertices, which are else None.
Part = collections.namedtuple("Part", "points radius vertices")


class Question:
    """Problem, network and tube. Raises Rejected.

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
        """The same network and tube, not read again, under another problem with such axes, K."""
        other = copy.copy(self)
        other._read_problem(problem)
        for name in ("n_p", "n_points", "n_q", "n_k", "T", "dt", "lo", "hi"):
            if getattr(other, name) != getattr(self, name):
                raise Rejected("the other problem has other dimensions or another domain")
        return other

    def spend(self, count, bits=1, other_bits=1):
        """Counts so many products of integers of these lengths."""
        self.work_left -= count * (1 + bits * other_bits // (1 << 16))
        need(self.work_left >= 0, "it asks for more work than the size of the file allows")

    # --- problem -------------------------------------------------------------------------------

    def _read_problem(self, problem):
        sizes = ("n_p", "points", "n_q", "n_k", "steps", "dt")
        fields(problem, (*sizes, "domain", "goal", "start", "obstacles", "body"))
        self.n_p = whole(problem["n_p"], 1, 8)
        self.n_points = whole(problem["points"], 1, MAX_REFERENCE_POINTS)
        self.n_q = whole(problem["n_q"], 0, 64)
        self.n_k = whole(problem["n_k"], 1, MAX_PARAMETERS)
        self.T = whole(problem["steps"], 1, 100_000)
        self.dt = number(problem["dt"])
        need(self.dt > 0, "the time step dt is not positive")
        self.n_c = self.n_points * self.n_p  # coordinates of all points
        self.n_end = self.n_c + self.n_q
        self.n_outputs = (self.T + 1) * self.n_c - self.n_p + self.n_q
        self.end = slice(self.T * self.n_c - self.n_p, None)  # (c_T of all points, q) in y
        self.lo, self.hi = box(problem["domain"], self.n_k)
        self.goal = halfspaces(fields(problem["goal"], ("A", "b")), self.n_end)
        self.start = []
        if problem["start"] is not None:
            self.start = halfspaces(fields(problem["start"], ("A", "b")), self.n_p)
        self.obstacles = [self._obstacle(part) for part in array(problem["obstacles"])]
        self.parts = [self._part(dict(x)) for x in fields(problem["body"], ("parts",))["parts"]]
        need(len(self.parts) > 0, "the body has no part")

    def _obstacle(self, part):
        """(rows, first interval, last interval) of an obstacle."""
        fields(part, ("A", "b"), ("steps",))
        first, last = part.get("steps", [0, self.T - 1])
        whole(first, 0, self.T - 1)
        whole(last, first, self.T - 1)
        return halfspaces(part, self.n_p), first, last

    def _part(self, shape):
        """The Part that grows its points by a disc (or ball) of a radius, or by a polygon."""
        points = [whole(i, 0, self.n_points - 1) for i in shape.pop("points")]
        need(len(points) > 0, "a part of the body has no point")
        if "radius" in shape:
            fields(shape, ("radius",))
            radius = number(shape["radius"])
            need(radius >= 0, "the radius is negative")
            return Part(points, radius, None)
        fields(shape, ("vertices",))
        vertices = [vector(vertex, self.n_p) for vertex in shape["vertices"]]
        need(len(vertices) > 0, "the body has no vertex")
        return Part(points, Fraction(0), vertices)

    def offset(self, s, i):
        """Where the offset of point i from p0 at knot s is among the outputs: nowhere for point 0
        at knot 0, which is p0.
        """
        number = s * self.n_points + i
        if number == 0:
            return slice(0)
        return slice((number - 1) * self.n_p, number * self.n_p)

    def along_p0(self, row):
        """How a row over the end, of all points and q, changes with p0."""
        return [sum(row[axis : self.n_c : self.n_p]) for axis in range(self.n_p)]

    # --- network -------------------------------------------------------------------------------

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
            rows = [array(row, width) for row in array(weights)]
            flat, q = whole_numbers([*array(biases, len(rows)), *itertools.chain(*rows)])
            begins = [len(rows) + i * width for i in range(len(rows))]
            W = [flat[begin : begin + width] for begin in begins]
            self.layers.append((W, flat[: len(rows)], q))
            self.layer_bits.append(max((x.bit_length() for x in [*flat, q]), default=1))
            width = len(rows)
        need(width == self.n_outputs, f"the network does not have {self.n_outputs} outputs")
        self.n_neurons = sum(len(W) for W, _, _ in self.layers[:-1])

    def evaluate(self, columns, scale, pattern=None):
        """The network as an exact affine map of its input: columns hold the coefficients of the
        input and, last, the constant; a point is a constant alone.

        The pattern says which neurons pass; without one, at a point, the sign does, which is ReLU.
        Returns the coefficients of each neuron over some positive scale, the columns of the
        outputs, and their scale.
        """
        neurons, columns, scale = self.hidden(columns, scale, pattern)
        return neurons, *self.outputs(columns, scale)

    def hidden(self, columns, scale, pattern=None):
        """The same up to the last hidden layer, its columns and their scale."""
        neurons: list = []
        place = 0
        for depth in range(len(self.layers) - 1):
            columns, scale = self._before_relu(depth, slice(None), columns, scale)
            width = len(columns[0])
            if pattern is None:
                passes = [x > 0 for x in columns[-1]]
            else:
                passes = [bit == "1" for bit in pattern[place : place + width]]
            place += width
            neurons += zip(*columns, strict=True)
            columns = [
                [x if on else 0 for x, on in zip(column, passes, strict=True)] for column in columns
            ]
        return neurons, columns, scale

    def outputs(self, columns, scale, places=slice(None)):
        """Some outputs of the network, and their scale, from the last hidden layer."""
        return self._before_relu(-1, places, columns, scale)

    def _before_relu(self, depth, places, columns, scale):
        """Some rows of a layer, and their scale."""
        W, bias, q = self.layers[depth]
        W, bias = W[places], bias[places]
        longest = max(abs(x).bit_length() for column in columns for x in [*column, scale])
        products = len(columns) * len(W) * (len(columns[0]) + 1)
        self.spend(products, longest, self.layer_bits[depth])
        columns = [[dot(row, column) for row in W] for column in columns]
        columns[-1] = [x + b * scale for x, b in zip(columns[-1], bias, strict=True)]
        return columns, scale * q

    # --- tube ----------------------------------------------------------------------------------

    def _read_tube(self, tube):
        """Edges of the bins as fractions; errors of each, by interval and point and at the end."""
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
        bins = array(tube["interval"], self.n_bins)
        self.interval = [self._during(array(by_interval, self.T)) for by_interval in bins]
        self.final = [self._at_end(entry) for entry in array(tube["final"], self.n_bins)]

    def _during(self, by_interval):
        """The errors of each point in every interval of a bin. Widths in hex floats are read
        together, over one denominator.
        """
        n = self.n_p
        entries = []
        for by_point in by_interval:
            entries += array(by_point, self.n_points)
        found = None
        if all(type(entry) is list and len(entry) == n for entry in entries):
            found = hex_integers([text for entry in entries for text in entry])
        if found is None:
            errors = [self._errors(entry) for entry in entries]
        else:
            e, scale = found
            errors = [Widths(e[i : i + n], scale) for i in range(0, len(e), n)]
        return [errors[i : i + self.n_points] for i in range(0, len(errors), self.n_points)]

    def _errors(self, entry):
        """The errors of one point in one interval."""
        if type(entry) is list:
            return Widths(*whole_numbers(array(entry, self.n_p)))
        fields(entry, ("A", "b"))
        rows, scale = whole_halfspaces(entry, self.n_p)
        return Template(rows, scale, self.n_p)

    def _at_end(self, entry):
        """The errors at the end."""
        if type(entry) is list:
            return Widths(*whole_numbers(array(entry, self.n_end)))
        fields(entry, ("A", "b", "goal"))
        rows, scale = whole_halfspaces(entry, self.n_end)
        named = array(entry["goal"], len(self.goal))
        ways = [[parsed_multipliers(way, len(rows)) for way in array(some)] for some in named]
        return Template(rows, scale, self.n_end, ways)

    def bins_without_model(self):
        """How many bins have a tube that leaves out the model's own trajectory: some template there
        does not allow the error zero.
        """
        return self._bins_where(lambda each: not each.allows_none)

    def bins_without_claim(self):
        """How many bins have a tube that is so wide that it stands for no claim."""
        return self._bins_where(lambda each: each.open)

    def _bins_where(self, holds):
        both = zip(self.interval, self.final, strict=True)
        errors = ([final, *itertools.chain(*by_interval)] for by_interval, final in both)
        return sum(any(map(holds, of_bin)) for of_bin in errors)

    def bins_meeting(self, lo, hi, closed):
        """Bins that meet the box [lo, hi] of k, row-major: as closed boxes or with interiors."""
        bins, before = [0], operator.le if closed else operator.lt
        for edge, a, b in zip(self.edges, lo, hi, strict=True):
            self.spend(FRACTION * len(edge))
            pairs = enumerate(itertools.pairwise(edge))
            places = [i for i, (low, high) in pairs if before(low, b) and before(a, high)]
            bins = [number * (len(edge) - 1) + i for number in bins for i in places]
        return bins

    def errors(self, bins, pick):
        """(errors by interval and point, errors at the end) of some bins: as far along every
        direction as those of any bin (pick is max), or of each (min). There must be a bin.
        """
        first, *others = bins
        if not others:
            return self.interval[first], self.final[first]
        self.spend(len(bins) * (self.T * self.n_points + 1))
        interval = [
            [Several([self.interval[b][t][i] for b in bins], pick) for i in range(self.n_points)]
            for t in range(self.T)
        ]
        return interval, Several([self.final[b] for b in bins], pick)

    def at_end(self, bins):
        """The errors that a trajectory may have at its end in each of some bins."""
        self.spend(len(bins) * FRACTION * self.n_end)
        return Several([AtEnd(self.final[b], self.interval[b][-1], self.n_p) for b in bins], min)


def about_open_bins(report):
    """That some bins have no claim, a line; none where each has one."""
    if report.without_claim:
        of = f"{report.without_claim} of {report.bins}"
        yield f"{of} bins of K have no claim: their tube is 10^100 or more wide"


def about_the_model(report):
    """Whether what is proved is about the trajectory that the model predicts, too."""
    if report.without_model == 0:
        return "The tube holds the model's own trajectory in every bin."
    bins = f"{report.without_model} of {report.bins} bins"
    return (
        f"The tube leaves out the model's own trajectory in {bins}: "
        "what is proved there may be about none."
    )
