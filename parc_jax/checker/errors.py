"""Sets of errors that a tube allows, and their support along a direction. [T14, T26]

Each has `support(w, goal_row)`: a number that no w . x of an error x exceeds. goal_row is the
number of the row of the goal that w is, where it is one: a file may name multipliers for those.
"""

import itertools
import math
from fractions import Fraction

from .exact import FRACTION, Rejected, dot, integers, need, weighted

MOST_AXES = 3  # multipliers are found here in one to three dimensions
NO_CLAIM = 10**100  # errors so large stand for none that are known


class Widths:
    """The errors x with |x_j| <= e_j."""

    is_box = True

    def __init__(self, e, scale):
        """e: integers over this scale."""
        need(min(e) >= 0, "the tube has a negative width")
        self.e = e
        self.scale = scale
        self.cost = len(e)  # of support, in products
        self.allows_none, self.open = True, max(e) >= NO_CLAIM * scale

    def support(self, w, goal_row=None):
        return Fraction(dot([abs(x) for x in w], self.e), self.scale)

    def contains(self, x):
        """Whether x is one of the errors."""
        return all(abs(v) * self.scale <= e for v, e in zip(x, self.e, strict=True))

    def fractions(self):
        """The half widths."""
        return [Fraction(e, self.scale) for e in self.e]


class Template:
    """The errors x with a . x <= b for all rows (a, b), in n dimensions.

    rows: in integers over one scale. ways: for each row of the goal, lists of parsed multipliers
    that may give it.
    """

    is_box = False

    def __init__(self, rows, scale, n, ways=()):
        self.rows = rows
        self.scale = scale
        self.n = n
        self.ways = ways
        self.known = None
        self.allows_none = all(b >= 0 for _, b in rows)
        self.open = any(b >= NO_CLAIM * scale for _, b in rows)
        named = max((sum(map(len, some)) for some in ways), default=0)
        self.cost = FRACTION * n * named
        if n <= MOST_AXES:
            longest = scale.bit_length()
            longest += max((x.bit_length() for a, b in rows for x in (*a, b)), default=0)
            self.cost += n * (n + 1) * math.comb(len(rows), n) * (1 + longest**2 // (1 << 16))

    def support(self, w, goal_row=None):
        """The least of the bounds: nonnegative multipliers m of the rows with sum m_i a_i = w give
        w . x = sum m_i a_i . x <= sum m_i b_i.
        """
        bounds = []
        found = self.least(w)
        if found is not None:
            bounds.append(found)
        if goal_row is not None:
            scaled = [x * self.scale for x in w]
            for way in self.ways[goal_row]:
                v, h = weighted(self.rows, way, self.n)
                if v == scaled and all(m >= 0 for _, m in way):
                    bounds.append(h / self.scale)
        if not bounds:
            raise Rejected("no multipliers of the tube's rows give a direction")
        return min(bounds)

    def least(self, w):
        """The least bound by multipliers of n rows, None if no n of them give w."""
        walls, bases = self.bases()
        ahead = {number for wall, number in walls.items() if dot(wall, w) >= 0}
        least = None
        det = 1
        for own, corner, own_det in bases:
            if own <= ahead:
                bound = dot(corner, w)
                if least is None or bound * det < least * own_det:
                    least, det = bound, own_det
        return None if least is None else Fraction(least, det)

    def bases(self):
        """(walls, bases): of any n rows that span the space, (numbers of their walls, corner, det).

        The only multipliers of these rows that give w are wall . w over something positive, and
        with them sum m_i b_i = corner . w / det, det > 0. walls: {wall: number}, in integers.
        """
        if self.known is None:
            rows = []
            if self.n <= MOST_AXES:
                rows = [shortest([*a, b]) for a, b in self.rows]
            walls: dict = {}
            bases = []
            for some in itertools.combinations(rows, self.n):
                duals, corner, det = basis(some)
                if det > 0:
                    own = [walls.setdefault(shortest(dual), len(walls)) for dual in duals]
                    bases.append((frozenset(own), corner, det))
            self.known = walls, bases
        return self.known

    def contains(self, x):
        """Whether x is one of the errors."""
        return all(dot(a, x) <= b for a, b in self.rows)


def shortest(row):
    """Integers without a common divisor, in the same proportions."""
    common = math.gcd(*row) or 1
    return tuple(x // common for x in row)


def basis(rows):
    """(duals, corner, det) of n rows (*a, b) by Cramer's rule, in integers: m_i = dual_i . w / det
    give w = sum m_i a_i and corner . w / det = sum m_i b_i. det is zero where they do not span.
    """
    normals = [row[:-1] for row in rows]
    if len(rows) == 1:
        duals = [[1]]
    elif len(rows) == 2:
        a, b = normals
        duals = [[b[1], -b[0]], [-a[1], a[0]]]
    else:
        a, b, c = normals
        duals = [cross(b, c), cross(c, a), cross(a, b)]
    det = dot(duals[0], normals[0])
    if det < 0:
        duals = [[-x for x in dual] for dual in duals]
    offsets = [row[-1] for row in rows]
    corner = [dot(offsets, along) for along in zip(*duals, strict=True)]
    return duals, corner, abs(det)


def cross(a, b):
    """The vector product in space."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class AtEnd:
    """The errors of a trajectory at its end, of all points and q: there it keeps to those of the
    end, and each point to its own of the last interval.
    """

    def __init__(self, final, last, n_p):
        self.final = final
        self.last = last
        self.n_p = n_p
        self.cost = final.cost + sum(each.cost for each in last)
        self.is_box = final.is_box and all(each.is_box for each in last)
        if self.is_box:
            least = final.fractions()
            positions = [e for each in last for e in each.fractions()]
            least[: len(positions)] = map(min, positions, least)
            self.least = Widths(*integers(least))

    def support(self, w, goal_row=None):
        if not self.is_box:
            raise Rejected("a goal row names no error, and the tube has no half widths")
        return self.least.support(w)

    def contains(self, x):
        """Whether x is one of the errors."""
        held = self.final.contains(x)
        for i, each in enumerate(self.last):
            held = held and each.contains(x[i * self.n_p : (i + 1) * self.n_p])
        return held


class Several:
    """The errors of several bins: how far any of them reaches (pick is max), or all (min)."""

    def __init__(self, sets, pick):
        self.sets = sets
        self.pick = pick
        self.cost = sum(each.cost for each in sets)
        self.is_box = all(each.is_box for each in sets)

    def support(self, w, goal_row=None):
        return self.pick(each.support(w, goal_row) for each in self.sets)

    def contains(self, x):
        """Whether x is an error of every bin."""
        return all(each.contains(x) for each in self.sets)
