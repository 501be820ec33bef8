"""Checks a saved answer in exact arithmetic, independently of the program that wrote it.

    python checker.py answer.json [--json]      exit code 0 accepted, 1 rejected, 2 the file cannot be read

Standard library only. Every number is a rational, every comparison exact; there is no tolerance. A check passes only
on `is True` and any exception is a rejection. docs/certificates.md has the format and what an accepted answer proves.
Letters: p position, q goal extras, k parameters, y = (c_1 .. c_T, q) the network's outputs, p_s = p0 + c_s at knot s,
z = p_T, t interval from knot t to t + 1, e error of the tube, w direction. Vectors are integers over one denominator.
"""

import collections
import contextlib
import hashlib
import importlib
import itertools
import json
import math
import operator
import re
import sys
import types
from fractions import Fraction

FORMAT, PARTS = "parc_jax.answer/1", ("problem", "network", "tube")
MAX_BYTES, MAX_CHARS, MAX_BITS, MAX_LAYERS = 1 << 26, 1000, 1 << 13, 64
HEX = re.compile(r"(-?)0x([0-9a-f]{1,40})(?:\.([0-9a-f]{0,40}))?p([+-]?[0-9]{1,4})")
DECIMAL = re.compile(r"-?[0-9]+(?:/[0-9]+|(?:\.[0-9]+)?(?:e[+-]?[0-9]{1,3})?)")

# What was proved: how many of each, None or kind and exact volumes of no_plan. The claim is only quoted.
Report = collections.namedtuple("Report", "samples sets corridors no_plan claim hash")
# w . p0 + v . y[part] + c >= 0, or > 0 if strict, in integers.
Condition = collections.namedtuple("Condition", "name strict w v part c")


class Rejected(Exception):
    """The answer is not accepted; the message says why in one sentence."""


def need(ok, reason):
    if ok is not True:
        raise Rejected(reason)


@contextlib.contextmanager
def rejecting(where=""):
    """Every exception inside becomes Rejected, so that nothing unforeseen can pass."""
    try:
        yield
    except OSError:
        raise
    except Exception as error:
        kind = "" if isinstance(error, Rejected) else f"malformed input, {type(error).__name__}: "
        raise Rejected(f"{where}{kind}{str(error)[:200]}") from error


def number(x):
    """A hex float, p/q or decimal string as the exact rational that it spells; never through a float."""
    need(len(x) <= MAX_CHARS, "a number is too long")
    if found := HEX.fullmatch(x):
        sign, before, after, power = found.groups("")
        digits, exponent = int(sign + before + after, 16), int(power) - 4 * len(after)
        return Fraction(digits << exponent) if exponent >= 0 else Fraction(digits, 1 << -exponent)
    need(DECIMAL.fullmatch(x) is not None, f"not a finite number: {x[:40]!r}")
    return Fraction(x)


def array(x, n=None):
    need(type(x) is list, "a list was expected")
    need(n is None or len(x) == n, f"a list of {n} entries was expected, got {len(x)}")
    return x


def vector(x, n):
    return [number(v) for v in array(x, n)]


def whole(x, least, most):
    need(type(x) is int, "a whole number was expected")
    need(least <= x <= most, f"the whole number {x} is not in {least}..{most}")
    return x


def fields(x, names, optional=()):
    need(set(names) <= set(x) <= {*names, *optional}, f"expected the fields {names}, got {list(x)[:20]}")
    return x


def halfspaces(x, n):
    """Rows (a, b) of the closed set {a . x <= b}."""
    A = [vector(row, n) for row in array(x["A"])]
    return list(zip(A, vector(x["b"], len(A)), strict=False))


def box(x, n):
    lo, hi = (vector(fields(x, ("lo", "hi"))[side], n) for side in ("lo", "hi"))
    need(all(a <= b for a, b in zip(lo, hi, strict=True)), "a box is reversed")
    return lo, hi


def integers(numbers):
    """Integers n_i and one denominator D > 0 with numbers_i = n_i / D, of bounded length."""
    D = 1
    for x in numbers:
        D = math.lcm(D, x.denominator)
        need(D.bit_length() <= MAX_BITS, "a common denominator is too long")
    return [x.numerator * (D // x.denominator) for x in numbers], D


def dot(a, b):
    return sum(map(operator.mul, a, b))


def combine(rows, multipliers):
    """T12a: for multipliers m >= 0, a_i . x <= b_i gives w . x <= h, where w = sum m_i a_i, h = sum m_i b_i."""
    w, h = [Fraction(0)] * len(rows[0][0]), Fraction(0)
    for row, m in multipliers:
        (a, b), m = rows[whole(row, 0, len(rows) - 1)], number(m)
        need(m >= 0, "a multiplier is negative")
        w, h = [x + m * y for x, y in zip(w, a, strict=True)], h + m * b
    return w, h


def condition(name, strict, w, v, part, c):
    flat, _ = integers([*w, *v, c])
    return Condition(name, strict, flat[: len(w)], flat[len(w) : -1], part, flat[-1])


def holds(condition, p0, p_scale, y, y_scale):
    _, strict, w, v, part, c = condition
    value = dot(w, p0) * y_scale + dot(v, y[part]) * p_scale + c * p_scale * y_scale
    return value > 0 if strict else value >= 0


class Context:
    """Problem, network and tube as exact integers, ready to check many samples and sets. Raises Rejected."""

    @rejecting()
    def __init__(self, problem, network, tube):
        self._read_problem(problem)
        self._read_network(fields(network, ("weights", "biases")))
        self._read_tube(fields(tube, ("edges", "interval", "final")))

    @rejecting()
    def about(self, problem):
        """The same network and tube, not read again, under another problem of the same dimensions and domain."""
        vars(other := object.__new__(Context)).update(vars(self))
        other._read_problem(problem)
        if other.frame == self.frame:
            return other
        raise Rejected("the other problem has other dimensions or another domain")

    def _read_problem(self, problem):
        fields(problem, ("n_p", "n_q", "n_k", "domain", "goal", "obstacles", "body", "start", "steps", "dt"))
        self.n_p, self.n_k = whole(problem["n_p"], 1, 8), whole(problem["n_k"], 1, 8)
        self.n_q, self.T = whole(problem["n_q"], 0, 64), whole(problem["steps"], 1, 100_000)
        self.end = slice((self.T - 1) * self.n_p, None)  # (c_T, q) in y
        self.lo, self.hi = box(problem["domain"], self.n_k)
        self.frame = self.n_p, self.n_q, self.n_k, self.T, self.lo, self.hi
        self.goal = halfspaces(fields(problem["goal"], ("A", "b")), self.n_p + self.n_q)
        self.start = [] if problem["start"] is None else halfspaces(fields(problem["start"], ("A", "b")), self.n_p)
        self.obstacles = [self._obstacle(o) for o in array(problem["obstacles"])]
        if "radius" in fields(problem["body"], (), ("radius", "vertices")):
            self.radius, self.vertices = number(fields(problem["body"], ("radius",))["radius"]), None
            need(self.radius >= 0, "the radius is negative")
        else:
            self.radius, self.vertices = None, [vector(v, self.n_p) for v in array(problem["body"]["vertices"])]

    def _obstacle(self, o):
        first, last = fields(o, ("A", "b"), ("steps",)).get("steps", [0, self.T - 1])
        return halfspaces(o, self.n_p), whole(first, 0, self.T - 1), whole(last, first, self.T - 1)  # rows, its steps

    def _read_network(self, network):
        """Layers (integer weights, integer biases, their common denominator)."""
        self.layers, width = [], self.n_k
        need(0 < len(network["weights"]) <= MAX_LAYERS, "too few or too many layers")
        for W, b in zip(network["weights"], network["biases"], strict=True):
            W = [vector(row, width) for row in array(W)]
            flat, q = integers([*itertools.chain(*W), *vector(b, len(W))])
            self.layers.append(([flat[i * width :][:width] for i in range(len(W))], flat[len(W) * width :], q))
            width = len(W)
        need(width == self.T * self.n_p + self.n_q, "the network does not have T n_p + n_q outputs")
        self.n_neurons = sum(len(W) for W, _, _ in self.layers[:-1])

    def _read_tube(self, tube):
        """Bin edges as fractions; widths of all bins as integers over e_scale."""
        self.edges = [[number(v) for v in array(edge)] for edge in tube["edges"]]
        for edge, lo, hi in zip(self.edges, self.lo, self.hi, strict=True):
            need(all(a < b for a, b in itertools.pairwise(edge)), "the edges of the tube do not increase")
            need(edge[0] <= lo and hi <= edge[-1], "the tube does not cover the domain")
        self.n_bins = math.prod(len(edge) - 1 for edge in self.edges)
        interval = [[vector(e, self.n_p) for e in array(b, self.T)] for b in array(tube["interval"], self.n_bins)]
        final = [vector(e, self.n_p + self.n_q) for e in array(tube["final"], self.n_bins)]
        flat, self.e_scale = integers([v for b in (*interval, final) for e in b for v in e])
        need(all(v >= 0 for v in flat), "the tube has a negative width")
        entries = iter(flat)
        *self.interval, self.final = ([[next(entries) for _ in e] for e in b] for b in (*interval, final))

    def widths(self, lo, hi, before, pick):
        """(Interval by t, final) widths of the tube over e_scale: componentwise pick (max or min) over all bins that
        meet the box [lo, hi] of k: as closed sets with before = le, with their interiors with before = lt."""
        bins = [0]
        for edge, a, b in zip(self.edges, lo, hi, strict=False):
            inside = [i for i in range(len(edge) - 1) if before(edge[i], b) and before(a, edge[i + 1])]
            bins = [n * (len(edge) - 1) + i for n in bins for i in inside]
        intervals = zip(*(self.interval[b] for b in bins), strict=True)
        finals = zip(*(self.final[b] for b in bins), strict=True)
        return [list(map(pick, zip(*e, strict=True))) for e in intervals], list(map(pick, finals))

    def evaluate(self, columns, scale, pattern=None):
        """The network as an exact affine map: columns hold the coefficients of k and, last, the constant.

        The pattern says which neurons pass; without one (a point: only the constant) the sign does, which is ReLU.
        Returns the coefficients of each neuron over some positive scale, the columns of outputs, and their scale.
        """
        neurons: list = []
        for depth, (W, bias, q) in enumerate(self.layers, 1):
            columns = [[dot(w, column) for w in W] for column in columns]
            columns[-1] = [x + b * scale for x, b in zip(columns[-1], bias, strict=True)]
            scale *= q
            if depth < len(self.layers):
                on = ["01"[x > 0] for x in columns[-1]] if pattern is None else pattern[len(neurons) :][: len(W)]
                neurons += zip(*columns, strict=True)
                columns = [[x if bit == "1" else 0 for x, bit in zip(column, on, strict=True)] for column in columns]
        return neurons, columns, scale

    def shrunken_goal(self, final):
        """a . y + |a| . e <= b for the predicted end gives a . y' <= b for every end y' in the tube."""
        return [(a, b - Fraction(dot(map(abs, a), final), self.e_scale)) for a, b in self.goal]

    def body_support(self, w):
        """Upper bound of max over the body of -w . x, the body's share of the obstacle grown by it; roots go up."""
        if self.vertices is not None:
            return max(-dot(w, v) for v in self.vertices)
        ints, scale = integers(w)
        square = dot(ints, ints) << 160
        root = math.isqrt(square)
        return self.radius * Fraction(root + (root * root < square), scale << 80)

    def conditions(self, sep, interval, final):
        """The conditions on (p0, y) that make a plan safe for every trajectory in the tube of these widths."""
        for i, (a, b) in enumerate(self.start):
            yield condition(f"start row {i}", False, [-x for x in a], [], slice(0), b)
        for i, (a, b) in enumerate(self.shrunken_goal(final)):
            yield condition(f"goal row {i}", False, [-x for x in a[: self.n_p]], [-x for x in a], self.end, b)
        for o, runs in enumerate(array(sep, len(self.obstacles))):
            rows, t, last = self.obstacles[o]
            for stop, multipliers in runs:
                whole(stop, t + 1, last + 1)  # runs are not empty, follow each other, stay within the obstacle's steps
                w, h = combine(rows, multipliers)
                need(any(w), f"a separating direction of obstacle {o} is zero")
                # T14: w . p > h + support of -B + |w| . e_t at knots t and t + 1 holds on the segment between them, so
                # during interval t no body point of a trajectory in the tube is in the obstacle. e_t serves both knots.
                (*W, H), _ = integers([*w, h + self.body_support(w)])
                grow = [dot(map(abs, W), e) for e in interval[t:stop]]
                W, H = [x * self.e_scale for x in W], H * self.e_scale
                for s in range(t, stop + 1):  # knot s bounds intervals s - 1 and s: the wider one of the run decides
                    width = max(grow[max(s - 1 - t, 0)], grow[min(s, stop - 1) - t])
                    part = slice((s - 1) * self.n_p, s * self.n_p) if s else slice(0)  # c_0 = 0 is not an output
                    yield Condition(f"obstacle {o} at knot {s}", True, W, W if s else [], part, -H - width)
                t = stop
            need(t == last + 1, f"the runs of obstacle {o} do not cover its steps")

    @rejecting()
    def check_sample(self, sample):
        """Proves that (p0, k) reaches the goal and touches no obstacle, for every trajectory in the tube."""
        fields(sample, ("p0", "k", "sep"))
        p0, k = vector(sample["p0"], self.n_p), vector(sample["k"], self.n_k)
        need(all(a <= x <= b for a, x, b in zip(self.lo, k, self.hi, strict=False)), "k is outside the domain")
        widths = self.widths(k, k, operator.le, max)  # on a shared boundary the claim of any of the bins may be the one
        (k, k_scale), (p0, p_scale) = integers(k), integers(p0)
        _, (y,), y_scale = self.evaluate([k], k_scale)
        for asked in self.conditions(sample["sep"], *widths):
            need(holds(asked, p0, p_scale, y, y_scale), f"the condition of {asked.name} fails")

    @rejecting()
    def set_rows(self, piece):
        """The polytope S of a set piece: (name, strict, a, c) in integers, a . (p0, k) + c >= 0 (strict: > 0).

        On S the pattern's affine map is the network (induction over the layers: every sign agrees), so the rows say
        for each (p0, k) in S what check_sample asks. S lies in the domain and in the closed bin whose widths it uses.
        """
        fields(piece, ("p0", "k", "bin", "pattern", "sep"))
        number_, pattern, axes = whole(piece["bin"], 0, self.n_bins - 1), piece["pattern"], range(self.n_k)
        need(type(pattern) is str and set(pattern) <= {"0", "1"}, "the pattern is not a string of 0 and 1")
        need(len(pattern) == self.n_neurons, "the pattern does not have one digit for each hidden neuron")
        widths, rows, free = (self.interval[number_], self.final[number_]), [], [0] * self.n_p
        for i in reversed(axes):
            number_, place = divmod(number_, len(self.edges[i]) - 1)
            low, high = self.edges[i][place : place + 2]
            for sign, x in ((1, self.lo[i]), (1, low), (-1, self.hi[i]), (-1, high)):
                unit = [sign * x.denominator * (i == j) for j in axes]
                rows.append((f"axis {i} of k", False, free + unit, -sign * x.numerator))
        identity = [[int(i == j) for j in axes] for i in axes] + [[0] * self.n_k]
        neurons, columns, scale = self.evaluate(identity, 1, pattern)
        for i, (bit, row) in enumerate(zip(pattern, neurons, strict=False)):
            *a, c = row if bit == "1" else [-x for x in row]
            rows.append((f"neuron {i}", False, free + a, c))
        for name, strict, w, v, part, constant in self.conditions(piece["sep"], *widths):
            *a, c = (dot(v, column[part]) for column in columns)
            rows.append((name, strict, [x * scale for x in w] + a, c + constant * scale))
        return rows

    @rejecting()
    def check_set(self, piece):
        """Proves that every (p0, k) in the polytope of set_rows is safe, and that this polytope has interior points.

        Safety needs no test: the rows are its conditions. The point is strictly inside each row that is not constant,
        hence so is a ball around it; a constant row has only to be true.
        """
        point, scale = integers(vector(piece["p0"], self.n_p) + vector(piece["k"], self.n_k))
        for name, strict, a, c in self.set_rows(piece):
            value, constant = dot(a, point) + c * scale, not strict and not any(a)
            need(value >= 0 if constant else value > 0, f"the point is not inside the set's row of {name}")


def unique(pairs):
    need(len(dict(pairs)) == len(pairs), "a key appears twice")
    return dict(pairs)


def refuse(text):
    raise Rejected(f"the JSON number {text[:40]} is not whole; numbers are strings here")


@rejecting()
def load(path):
    """The content of a file. Raises OSError if it cannot be read, Rejected if it is not strict JSON."""
    with open(path, "rb") as file:
        data = file.read(MAX_BYTES + 1)
    need(len(data) <= MAX_BYTES, "the file is too large")
    return json.loads(data.decode("utf-8"), object_pairs_hook=unique, parse_float=refuse, parse_constant=refuse)


@rejecting()
def check_answer(answer):
    """Checks all that an answer (as `load` returns it) claims; returns a Report or raises Rejected."""
    need(answer["format"] == FORMAT, f"the format is not {FORMAT}")
    parts = {part: json.dumps(answer[part], sort_keys=True, separators=(",", ":")) for part in PARTS}
    hashes = {part: hashlib.sha256(text.encode()).hexdigest() for part, text in parts.items()}
    need(answer["hash"] == hashes, "a hash does not match its content")
    if (claim := answer["claim"]) is not None:
        need(claim["network_hash"] == hashes["network"], "the claim is about another network")
        need(claim["tube_hash"] == hashes["tube"], "the claim is about another tube")
    context = Context(answer["problem"], answer["network"], answer["tube"])
    # A corridor is the set of all (p0, k) that meet what check_sample asks with its directions, in whatever region and
    # bin: each of them is safe as a sample is (T14). Its own (p0, k) is one of them, so the set is not empty.
    checks = {"samples": context.check_sample, "sets": context.check_set, "corridors": context.check_sample}
    answer = {"corridors": [], **answer}  # older files have none
    for kind, check in checks.items():
        for i, entry in enumerate(array(answer[kind])):
            with rejecting(f"{kind}[{i}]: "):
                check(entry)
    if (plan := answer["no_plan"]) is not None:  # a second file keeps this one short; it imports nothing and gets this
        cells = importlib.import_module("parc_jax.checker_cells" if __package__ else "checker_cells")
        with rejecting("no_plan: "):
            plan = cells.check_no_plan(types.SimpleNamespace(**globals()), context, plan)
    return Report(len(answer["samples"]), len(answer["sets"]), len(answer["corridors"]), plan, claim, hashes)


def summary(report):
    """What was proved and what it rests on, as lines fit for a terminal: quotes from the file are escaped."""
    yield "ACCEPTED. Proved in exact arithmetic, for every trajectory inside the tube:"
    yield f"  {report.samples} samples (p0, k) reach the goal and touch no obstacle"
    yield f"  {report.sets} polytopes of (p0, k) do so at every point of them"
    yield f"  {report.corridors} corridors: so does every (p0, k) of the domain that meets all conditions of one"
    if report.no_plan is not None and report.no_plan["kind"] == "proved":
        yield "  no (p0, k) of the model is safe: a longer search cannot find one"
    elif report.no_plan is not None:
        sizes = {key: Fraction(report.no_plan[key]) for key in ("safe", "unsafe", "undecided")}
        shares = (f"{key} {float(100 * size / sum(sizes.values())):.4g} %" for key, size in sizes.items())
        yield f"  of the (p0, k) whose end lies in the goal's box by volume: {', '.join(shares)}"
    claim = report.claim or {"kind": "no claim"}
    known = claim.get("kind") in ("pac", "conformal", "cover")
    yield "The proof rests on the tube, " + ("of which the file says (unchecked):" if known else "which is ASSUMED:")
    yield f"  {ascii(claim.get('kind'))[:40]} {ascii(claim.get('statement'))[:2000]}"
    yield from (f"  sha256 {part} {value}" for part, value in report.hash.items())


def main(arguments=None):
    """Command line; returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    paths, as_json = [a for a in arguments if a != "--json"], "--json" in arguments
    if len(paths) != 1 or paths[0].startswith("-"):
        print("usage: checker.py answer.json [--json]", file=sys.stderr)
        return 2
    try:
        report = check_answer(load(paths[0]))
        result, lines, code = {"accepted": True, **report._asdict()}, summary(report), 0
    except Rejected as why:
        result, lines, code = {"accepted": False, "reason": str(why)}, [f"REJECTED: {ascii(str(why))[1:-1]}"], 1
    except OSError as error:
        print(f"The file cannot be read: {error}", file=sys.stderr)
        return 2
    print(json.dumps(result, indent=1) if as_json else "\n".join(lines))
    return code


if __name__ == "__main__":
    sys.exit(main())
